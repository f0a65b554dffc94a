"""Decides what follows from a speaker's sentences: an action, a question back, or nothing. One for each person who speaks.

Time is an argument [ns].
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

from vistel.space import actions as ask
from vistel.space.actions import Action
from vistel.space.arguments import Which
from vistel.speech.grammar import Language, Sentence
from vistel.speech.meaning import Correction, MeaningError, Remark, asked_for

PATIENCE_NS = 10_000_000_000
"""How long a yes or no is waited for."""
AWAKE_NS = 8_000_000_000
"""How long after a sentence the next ones need no wake word."""
ABSENT = 0.3
"""Factor on the confidence of a reading about things that are not in the room."""
BRIEF = 0.5
"""Share of the way from the required confidence to 1 that a single word must reach in addition while the microphone is always open:
knocks and other talk are mistaken for one word more often than for three."""
CORRECTED_NS = 15_000_000_000
"""How long after a deed "no, the red one" is about it."""
DOUBT = 0.5
"""Below the required confidence and above this share of it, a question is asked back."""


@dataclass(frozen=True)
class KnownThing:
    """A thing in the room, with what words can say about it."""

    id: str
    name: str
    shape: str
    colour: str


@dataclass(frozen=True)
class Reading:
    """One reading of an utterance. sentence: None where it is not a sentence of the grammar."""

    sentence: Sentence | None
    confidence: float


class ResponseKind(Enum):
    """What comes of an utterance."""

    IGNORED = "ignored"
    REJECTED = "rejected"
    ACT = "act"
    QUESTION = "question"
    NOTED = "noted"


@dataclass(frozen=True)
class Response:
    """The result of an utterance. sentence: as understood; action: for the world, first to be done: what takes the last one back,
    where another thing was meant; reply: to the speaker."""

    outcome: ResponseKind
    sentence: Sentence | None = None
    confidence: float = 0.0
    action: Action | None = None
    reply: str = ""
    first: Action | None = None


_REPLIES: dict[str, dict[Language, str]] = {
    "again?": {"ja": "わかりませんでした", "en": "I did not understand"},
    "meant": {"ja": "「{}」ですか？", "en": "did you mean “{}”?"},
    "really": {"ja": "本当に「{}」？ はい／いいえ", "en": "really “{}”? yes or no"},
    "dropped": {"ja": "やめました", "en": "left as it is"},
    "what?": {"ja": "何のことですか", "en": "yes or no to what?"},
    "instead of?": {"ja": "何のかわりですか", "en": "instead of what?"},
    "nothing": {"ja": "まだ何もしていません", "en": "nothing has been done yet"},
    "listening": {"ja": "はい", "en": "yes?"},
    "done": {"ja": "はい", "en": "done"},
    "refused": {"ja": "できません: {}", "en": "{}"},
    "silent": {"ja": "返事がありません", "en": "the world does not answer"},
}


def reply(what: str, language: Language, *about: str) -> str:
    """One line for a person."""
    return _REPLIES[what][language].format(*about)


def referents(action: Action) -> list[Which]:
    """The things an action speaks of."""
    return [w for w in (getattr(action, "which", None), getattr(action, "to", None)) if isinstance(w, Which)]


def exists(which: Which, things: Sequence[KnownThing]) -> bool:
    """Whether the room has anything that fits."""
    words = which.name.lower().split()
    return any(
        (not which.thing or t.id == which.thing)
        and (not which.shape or t.shape == which.shape)
        and (not which.colour or t.colour == which.colour)
        and all(w in f"{t.id} {t.name} {t.shape} {t.colour}".lower().split() for w in words)
        for t in things
    )


def needs_confirmation(action: Action) -> bool:
    """Actions that are confirmed by a question first, because they remove what others may need."""
    return isinstance(action, ask.Reset) or (isinstance(action, ask.Delete) and action.which.every)


UNRECORDED = ask.Select | ask.Grip | ask.Release
"""Actions that the world does not take back: the next one replaces them."""


def corrected(action: Action, meant: Which) -> Action | None:
    """The action with the thing that was meant; a noun that was not said stays what it was. None: it speaks of no thing."""
    which = getattr(action, "which", None)
    if not isinstance(which, Which):
        return None
    named = meant.thing or meant.name or meant.shape or meant.shown or meant.every or meant.is_this
    whole = meant if named else replace(meant, thing=which.thing, name=which.name, shape=which.shape)
    return replace(action, which=whole)  # type: ignore[call-arg]


@dataclass
class Dialogue:
    """accept: the confidence from which a sentence is done at once; wake: sentences need the wake word; wary: the microphone is
    always open, so that a single word needs more confidence."""

    language: Language
    accept: float = 0.5
    wake: bool = False
    wary: bool = False
    _last: Action | None = None
    _deed: tuple[Action, int] | None = field(default=None)
    _done: bool = False
    _asked_back_ns: int | None = None
    _pending: tuple[Action, Sentence, int] | None = field(default=None)
    _awake_ns: int = -2 * AWAKE_NS

    def answered(self, done: bool) -> None:
        """The world has done what was asked for last, or refused it."""
        self._done = done

    def respond(self, readings: Sequence[Reading], things: Sequence[KnownThing], now_ns: int) -> Response:
        """An utterance, its readings the likeliest first; things: in the room, empty when that is not known.

        What is not understood is asked back once: who goes on talking is not interrupted again.
        """
        response = self._respond(readings, things, now_ns)
        if response.outcome is not ResponseKind.REJECTED:
            if response.outcome is not ResponseKind.IGNORED:
                self._asked_back_ns = None
            return response
        asked, self._asked_back_ns = self._asked_back_ns, now_ns
        return replace(response, reply="") if asked is not None and now_ns - asked < PATIENCE_NS else response

    def _respond(self, readings: Sequence[Reading], things: Sequence[KnownThing], now_ns: int) -> Response:
        found = self._best(readings, things)
        if found is None:
            return self._unheard(now_ns)
        sentence, wanted, confidence = found
        if self.wake and not sentence.means.get("wake") and now_ns - self._awake_ns > AWAKE_NS:
            return Response(ResponseKind.IGNORED, sentence, confidence)
        if confidence < DOUBT * self.accept:
            return Response(ResponseKind.REJECTED, sentence, confidence, reply=self._say("again?"))
        if self.wake and confidence >= self.accept:
            self._awake_ns = now_ns
        if isinstance(wanted, Remark | Correction):
            if confidence < self.accept:
                return Response(ResponseKind.REJECTED, sentence, confidence, reply=self._say("again?"))
            if isinstance(wanted, Correction):
                return self._correct(wanted, sentence, confidence, now_ns)
            return self._remark(wanted, sentence, confidence, now_ns)
        needed = self._needed(sentence)
        repeated = self._pending is not None and self._pending[0] == wanted and now_ns - self._pending[2] <= PATIENCE_NS
        if needs_confirmation(wanted) or (confidence < needed and not repeated):
            self._pending = wanted, sentence, now_ns
            question = "really" if confidence >= needed else "meant"
            return Response(ResponseKind.QUESTION, sentence, confidence, reply=self._say(question, sentence.text))
        return self._act(wanted, sentence, confidence, now_ns)

    def _needed(self, sentence: Sentence) -> float:
        """The confidence from which a sentence is done at once."""
        return self.accept + (BRIEF * (1.0 - self.accept) if self.wary and len(sentence.words) == 1 else 0.0)

    def _best(
        self, readings: Sequence[Reading], things: Sequence[KnownThing]
    ) -> tuple[Sentence, Action | Remark | Correction, float] | None:
        """The likeliest of those that ask for something, with preference for things that are in the room."""
        able: list[tuple[float, int, Sentence, Action | Remark | Correction, float]] = []
        for n, r in enumerate(readings):
            if r.sentence is None:
                continue
            try:
                wanted = asked_for(r.sentence.means)
            except MeaningError:
                continue
            spoken_of = (
                [wanted.which] if isinstance(wanted, Correction) else [] if isinstance(wanted, Remark) else referents(wanted)
            )
            weight = ABSENT if things and not all(exists(w, things) for w in spoken_of) else 1.0
            able.append((weight * r.confidence, -n, r.sentence, wanted, r.confidence))
        if not able:
            return None
        _, place, sentence, wanted, confidence = max(able, key=lambda a: a[:2])
        if place and readings[0].sentence is not None:  # the room decided between what sounded nearly alike
            confidence = max(confidence, ABSENT * readings[0].confidence)
        return sentence, wanted, confidence

    def _unheard(self, now_ns: int) -> Response:
        if self.wake and now_ns - self._awake_ns > AWAKE_NS:
            return Response(ResponseKind.IGNORED)
        return Response(ResponseKind.REJECTED, reply=self._say("again?"))

    def _remark(self, remark: Remark, sentence: Sentence, confidence: float, now_ns: int) -> Response:
        def noted(what: str) -> Response:
            return Response(ResponseKind.NOTED, sentence, confidence, reply=self._say(what))

        if remark is Remark.WAKE:
            return noted("listening")
        if remark is Remark.AGAIN:
            return noted("nothing") if self._last is None else self._act(self._last, sentence, confidence, now_ns)
        pending, self._pending = self._pending, None
        if pending is None or now_ns - pending[2] > PATIENCE_NS:
            return noted("what?")
        if remark is Remark.NO:
            return noted("dropped")
        return self._act(pending[0], pending[1], confidence, now_ns)

    def _correct(self, correction: Correction, sentence: Sentence, confidence: float, now_ns: int) -> Response:
        """What was asked about or done last, with another thing. What was done is taken back first; what was refused needs none."""
        asked = self._pending is not None and now_ns - self._pending[2] <= PATIENCE_NS
        action, at_ns = (self._pending[0], self._pending[2]) if asked and self._pending is not None else self._deed or (None, 0)
        instead = corrected(action, correction.which) if action is not None and now_ns - at_ns <= CORRECTED_NS else None
        if instead is None:
            return Response(ResponseKind.NOTED, sentence, confidence, reply=self._say("instead of?"))
        first = ask.Undo() if not asked and self._done and not isinstance(action, UNRECORDED) else None
        if needs_confirmation(instead):
            self._pending = instead, sentence, now_ns
            return Response(ResponseKind.QUESTION, sentence, confidence, reply=self._say("really", sentence.text))
        return replace(self._act(instead, sentence, confidence, now_ns), first=first)

    def _act(self, action: Action, sentence: Sentence, confidence: float, now_ns: int) -> Response:
        self._pending = None
        self._deed, self._done = (action, now_ns), False
        if not isinstance(action, ask.Undo | ask.Redo | ask.Stop | ask.Reset):
            self._last = action
        return Response(ResponseKind.ACT, sentence, confidence, action)

    def _say(self, what: str, *about: str) -> str:
        return reply(what, self.language, *about)
