"""One participant who speaks to the room: what their microphone brings, what is believed of it, and what came of that."""

from __future__ import annotations

import logging
import secrets
from collections.abc import Callable, Sequence
from typing import Any

from prometheus_client import Counter, Histogram

from vistel.messages.commands import message_of
from vistel.space.actions import Action
from vistel.speech.dialogue import Dialogue, KnownThing, Reading, Response, ResponseKind, reply
from vistel.speech.engines.guarded import GuardedRecogniser
from vistel.speech.grammar import Grammar
from vistel.speech.recognition import Hypotheses, Recogniser
from vistel.speech.voice_reader import VoiceReader
from vistel.v1.audio_pb2 import VoiceControl
from vistel.v1.command_pb2 import CommandResult
from vistel.v1.speech_pb2 import Utterance
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME
from vistel_services.speech.config import Config, Speaker
from vistel_services.speech.echoes import Echoes
from vistel_services.speech.replies import SpokenReplies

log = logging.getLogger("vistel.speech")

_HEARD = Counter("vistel_speech_utterances_total", "Utterances by outcome", ["participant", "outcome"])
_LATENCY = Histogram(
    "vistel_speech_latency_seconds",
    "From the end of an utterance to its command",
    ["participant"],
    buckets=(0.1, 0.2, 0.3, 0.4, 0.6, 1.0, 2.0),
)

PATIENCE_NS = 3_000_000_000
"""How long the world's answer is waited for."""
TALKING = 0.3
"""Of what is believed to be a sentence, this share at least is louder than the noise at the microphone."""
LOST = 0.15
"""A sentence of which more never came is not believed: pieces of long ones sound like short ones."""
_STATES = {
    ResponseKind.REJECTED: Utterance.STATE_REJECTED,
    ResponseKind.ACT: Utterance.STATE_SENT,
    ResponseKind.QUESTION: Utterance.STATE_QUESTION,
    ResponseKind.NOTED: Utterance.STATE_NOTED,
}


class Listener:
    """What one participant says, and what came of it."""

    def __init__(
        self,
        config: Config,
        speaker: Speaker,
        grammar: Grammar,
        found: Recogniser,
        bus: Bus,
        echoes: Echoes,
        replied_at: Callable[[int], bool],
    ) -> None:
        """replied_at: whether the room's own voice could be heard at the site at a time [ns]."""
        self.reader = VoiceReader()
        self.replies = SpokenReplies(speaker.language, bus, speaker.participant, aloud=config.reply == "spoken")
        self._speaker, self._grammar, self._recogniser = speaker, grammar, GuardedRecogniser(found, self._failed)
        self._echoes, self._replied_at = echoes, replied_at
        self._dialogue = Dialogue(speaker.language, config.accept, config.listen == "wake", config.listen == "open")
        self._push = config.listen == "push"
        self._held = self._muted = False
        self._begin_ns: int | None = None
        self._answers = config.reply != "none"
        self._utterances = bus.publish(BY_NAME["utterance"], participant=speaker.participant)
        self._commands = bus.publish(BY_NAME["command"], participant=speaker.participant)
        self._waiting: dict[str, tuple[Utterance, int]] = {}
        self._newest = ""

    def set_control(self, control: VoiceControl, things: Sequence[KnownThing], now_ns: int) -> None:
        """The buttons. When the one for push to talk is let go, what was said ends there; what is cut off by muting is not
        meant for the room."""
        was, self._held = self._held, control.talk
        if self._push and was and not control.talk:
            for heard in self._recogniser.flush(now_ns):
                self._understand(heard, things, now_ns)
            self._begin_anew()
        if control.muted and not self._muted:
            self._begin_anew()
        self._muted = control.muted

    def round(self, things: Sequence[KnownThing], now_ns: int) -> None:
        """Listen to what has come."""
        self.replies.round(now_ns)
        for piece in self.reader.read(now_ns):
            if piece.fresh:
                self._begin_anew()
            if self._muted or (self._push and not self._held) or self._recogniser.rests(now_ns):
                continue
            if self._begin_ns is None:
                self._begin_ns = piece.t_ns
            for heard in self._recogniser.feed(piece.sound, now_ns):
                self._understand(heard, things, now_ns)
        for id, (utterance, until_ns) in list(self._waiting.items()):
            if now_ns > until_ns:
                del self._waiting[id]
                self._publish(utterance, Utterance.STATE_REFUSED, reply("silent", self._speaker.language), now_ns)

    def answered(self, result: CommandResult, now_ns: int) -> None:
        """The world has answered a command; perhaps one of these."""
        utterance, _ = self._waiting.pop(result.id, (None, 0))
        if utterance is None:
            return
        done = result.outcome == CommandResult.OUTCOME_DONE
        if result.id == self._newest:
            self._dialogue.answered(done)
        utterance.things.extend(result.things)
        language = self._speaker.language
        text = reply("done", language) if done else reply("refused", language, result.reason)
        log.info("event=answered participant=%s done=%s reason=%r", self._speaker.participant, done, result.reason)
        self._publish(utterance, Utterance.STATE_DONE if done else Utterance.STATE_REFUSED, text, now_ns)

    def _failed(self, reason: str) -> None:
        _HEARD.labels(self._speaker.participant, "failed").inc()
        log.error("event=recogniser_failed participant=%s reason=%r", self._speaker.participant, reason)
        self._begin_ns = None

    def _begin_anew(self) -> None:
        self._recogniser.reset()
        self._begin_ns = None

    def _unbelieved(self, readings: Sequence[Reading], begin_ns: int, end_ns: int) -> str:
        """Why what was heard between two moments was not said to the room; "" where nothing speaks against it."""
        if self._replied_at(begin_ns):
            return "the room heard itself"
        reception = self.reader.reception(begin_ns, end_ns)
        if reception.talking < TALKING:
            return f"nobody was louder than the noise (for {reception.talking:.0%} of it)"
        best = next((r.sentence for r in readings if r.sentence is not None), None)
        who = self._echoes.of(self._speaker.participant, best.text, begin_ns) if best else ""
        return f"{who} said so" if who else ""

    def _understand(self, heard: Hypotheses, things: Sequence[KnownThing], now_ns: int) -> None:
        began_ns = self._begin_ns or 0
        begin_ns, end_ns = (began_ns + round(s * 1e9) for s in (heard[0].start_s, heard[0].end_s))
        language = self._speaker.language
        readings = [Reading(self._grammar.sentence(h.words, language) if h.words else None, h.confidence) for h in heard]
        if why := self._unbelieved(readings, begin_ns, end_ns):
            _HEARD.labels(self._speaker.participant, "unbelieved").inc()
            log.info("event=not_said_to_the_room participant=%s reason=%r", self._speaker.participant, why)
            return
        lost = self.reader.reception(begin_ns, end_ns).lost
        if lost > LOST:
            log.info("event=heard_in_pieces participant=%s lost=%.2f", self._speaker.participant, lost)
            readings = [Reading(None, 0.0)]
        turn = self._dialogue.respond(readings, things, now_ns)
        _HEARD.labels(self._speaker.participant, turn.outcome.value).inc()
        log.info(
            "event=heard participant=%s outcome=%s confidence=%.2f text=%r",
            self._speaker.participant,
            turn.outcome.value,
            heard[0].confidence,
            turn.sentence.text if turn.sentence else "",
        )
        if turn.outcome is ResponseKind.IGNORED:
            return
        utterance = Utterance(
            id=secrets.token_hex(8),
            participant=self._speaker.participant,
            language=language,
            text=turn.sentence.text if turn.sentence else "",
            spoken=turn.sentence.spoken if turn.sentence else "",
            confidence=turn.confidence or heard[0].confidence,
            start_ns=max(0, begin_ns),
            end_ns=max(0, end_ns),
        )
        for r in readings:
            if r.sentence is not None:
                utterance.readings.add(text=r.sentence.text, confidence=r.confidence)
        if turn.action is not None:
            self._ask(turn, utterance, end_ns, now_ns)
        self._publish(utterance, _STATES[turn.outcome], turn.reply, now_ns)

    def _ask(self, turn: Response, utterance: Utterance, end_ns: int, now_ns: int) -> None:
        if turn.first is not None:
            self._put(turn.first, f"{utterance.id}.first", now_ns)
        utterance.command = self._newest = self._put(turn.action, utterance.id, now_ns)  # type: ignore[arg-type]
        self._waiting[utterance.command] = (utterance, now_ns + PATIENCE_NS)
        _LATENCY.labels(self._speaker.participant).observe(max(0.0, (now_ns - end_ns) * 1e-9))

    def _put(self, action: Action, id: str, now_ns: int) -> str:
        """Send a command; its id."""
        command: Any = message_of(action, id, self._speaker.participant)
        command.header.t_ns = now_ns
        self._commands.put(command)
        return id

    def _publish(self, utterance: Utterance, state: Utterance.State, text: str, now_ns: int) -> None:
        """Publish what has become of it."""
        utterance.state, utterance.reply = state, text if self._answers else ""
        utterance.header.t_ns = now_ns
        message = Utterance()
        message.CopyFrom(utterance)
        self._utterances.put(message)
        self._echoes.add(message)
        if text and state != Utterance.STATE_SENT:
            self.replies.say(text, now_ns)
