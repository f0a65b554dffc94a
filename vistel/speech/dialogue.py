"""Decides what follows from a speaker's sentences: an action, a question back, or nothing. One for each person who speaks.

Time is an argument [ns].
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

from vistel.space import actions as ask
from vistel.space.actions import Action, Which
from vistel.speech.grammar import Language, Said
from vistel.speech.meaning import MeaningError, Remark, asked_for

PATIENCE_NS = 10_000_000_000
"""How long a yes or no is waited for."""
AWAKE_NS = 8_000_000_000
"""How long after a sentence the next ones need no wake word."""
ABSENT = 0.3
"""Factor on the confidence of a reading about things that are not in the room."""
BRIEF = 0.5
"""Share of the way from the required confidence to 1 that a single word must reach in addition while the microphone is always open:
knocks and other talk are mistaken for one word more often than for three."""
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
    """One reading of an utterance. said: None where it is not a sentence of the grammar."""

    said: Said | None
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
    """The result of an utterance. said: as understood; action: for the world; reply: to the speaker."""

    outcome: ResponseKind
    said: Said | None = None
    confidence: float = 0.0
    action: Action | None = None
    reply: str = ""


_REPLIES: dict[str, dict[Language, str]] = {
    "again?": {"ja": "わかりませんでした", "en": "I did not understand"},
    "meant": {"ja": "「{}」ですか？", "en": "did you mean “{}”?"},
    "really": {"ja": "本当に「{}」？ はい／いいえ", "en": "really “{}”? yes or no"},
    "dropped": {"ja": "やめました", "en": "left as it is"},
    "what?": {"ja": "何のことですか", "en": "yes or no to what?"},
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


@dataclass
class Dialogue:
    """accept: the confidence from which a sentence is done at once; wake: sentences need the wake word; wary: the microphone is
    always open, so that a single word needs more confidence."""

    language: Language
    accept: float = 0.5
    wake: bool = False
    wary: bool = False
    _last: Action | None = None
    _pending: tuple[Action, Said, int] | None = field(default=None)
    _awake_ns: int = -2 * AWAKE_NS

    def respond(self, readings: Sequence[Reading], things: Sequence[KnownThing], now_ns: int) -> Response:
        """An utterance, its readings the likeliest first; things: in the room, empty when that is not known."""
        found = self._best(readings, things)
        if found is None:
            return self._unheard(now_ns)
        said, wanted, confidence = found
        if self.wake and not said.means.get("wake") and now_ns - self._awake_ns > AWAKE_NS:
            return Response(ResponseKind.IGNORED, said, confidence)
        if confidence < DOUBT * self.accept:
            return Response(ResponseKind.REJECTED, said, confidence, reply=self._say("again?"))
        if self.wake and confidence >= self.accept:
            self._awake_ns = now_ns
        if isinstance(wanted, Remark):
            if confidence < self.accept:
                return Response(ResponseKind.REJECTED, said, confidence, reply=self._say("again?"))
            return self._remark(wanted, said, confidence, now_ns)
        needed = self._needed(said)
        if confidence < needed or needs_confirmation(wanted):
            self._pending = wanted, said, now_ns
            question = "really" if confidence >= needed else "meant"
            return Response(ResponseKind.QUESTION, said, confidence, reply=self._say(question, said.text))
        return self._act(wanted, said, confidence)

    def _needed(self, said: Said) -> float:
        """The confidence from which a sentence is done at once."""
        return self.accept + (BRIEF * (1.0 - self.accept) if self.wary and len(said.words) == 1 else 0.0)

    def _best(self, readings: Sequence[Reading], things: Sequence[KnownThing]) -> tuple[Said, Action | Remark, float] | None:
        """The likeliest of those that ask for something, with preference for things that are in the room."""
        able: list[tuple[float, int, Said, Action | Remark, float]] = []
        for n, r in enumerate(readings):
            if r.said is None:
                continue
            try:
                wanted = asked_for(r.said.means)
            except MeaningError:
                continue
            spoken_of = [] if isinstance(wanted, Remark) else referents(wanted)
            weight = ABSENT if things and not all(exists(w, things) for w in spoken_of) else 1.0
            able.append((weight * r.confidence, -n, r.said, wanted, r.confidence))
        if not able:
            return None
        _, place, said, wanted, confidence = max(able, key=lambda a: a[:2])
        if place and readings[0].said is not None:  # the room decided between what sounded nearly alike
            confidence = max(confidence, ABSENT * readings[0].confidence)
        return said, wanted, confidence

    def _unheard(self, now_ns: int) -> Response:
        if self.wake and now_ns - self._awake_ns > AWAKE_NS:
            return Response(ResponseKind.IGNORED)
        return Response(ResponseKind.REJECTED, reply=self._say("again?"))

    def _remark(self, remark: Remark, said: Said, confidence: float, now_ns: int) -> Response:
        def noted(what: str) -> Response:
            return Response(ResponseKind.NOTED, said, confidence, reply=self._say(what))

        if remark is Remark.WAKE:
            return noted("listening")
        if remark is Remark.AGAIN:
            return noted("nothing") if self._last is None else self._act(self._last, said, confidence)
        pending, self._pending = self._pending, None
        if pending is None or now_ns - pending[2] > PATIENCE_NS:
            return noted("what?")
        if remark is Remark.NO:
            return noted("dropped")
        return self._act(pending[0], pending[1], confidence)

    def _act(self, action: Action, said: Said, confidence: float) -> Response:
        self._pending = None
        if not isinstance(action, ask.Undo | ask.Redo | ask.Stop | ask.Reset):
            self._last = action
        return Response(ResponseKind.ACT, said, confidence, action)

    def _say(self, what: str, *about: str) -> str:
        return reply(what, self.language, *about)
