"""The speech of a site as a service: one round every 20 ms, in which voices are listened to and commands are answered."""

from __future__ import annotations

import logging
import secrets
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from prometheus_client import Counter, Histogram

from vistel.space.commands.reference import name_of_colour
from vistel.speech.dialogue import Dialogue, Known, Outcome, Reading, Turn, reply
from vistel.speech.grammar import Grammar
from vistel.speech.heard import Hypotheses, Recogniser
from vistel.speech.recognisers import RecogniserError, checked_grammar, recogniser
from vistel.v1.command_pb2 import CommandResult
from vistel.v1.speech_pb2 import Utterance
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME
from vistel_services.command_messages import message_of
from vistel_services.speech.config import Config, Speaker
from vistel_services.speech.ear import Ear
from vistel_services.speech.mouth import Mouth

F32 = NDArray[np.float32]
log = logging.getLogger("vistel.speech")

_HEARD = Counter("vistel_speech_utterances_total", "What was said, by what came of it", ["participant", "outcome"])
_LATENCY = Histogram(
    "vistel_speech_latency_seconds", "From the end of an utterance to its command", ["participant"],
    buckets=(0.1, 0.2, 0.3, 0.4, 0.6, 1.0, 2.0),
)  # fmt: skip

ROUND_NS = 20_000_000
PATIENCE_NS = 3_000_000_000
"""How long the world's answer is waited for."""
_STATES = {
    Outcome.REJECTED: Utterance.STATE_REJECTED, Outcome.ACT: Utterance.STATE_SENT, Outcome.QUESTION: Utterance.STATE_QUESTION,
    Outcome.NOTED: Utterance.STATE_NOTED,
}  # fmt: skip


async def run_speech(config: Config, bus: Bus, clock: Clock) -> None:
    """Until cancelled."""
    grammar, faults = checked_grammar(*config.grammars)
    for fault in faults:
        log.warning("event=grammar_fault at=%s:%d reason=%r", fault.path, fault.line, fault.text)
    site = _Site(config, grammar.awaited() if config.listen == "wake" else grammar, bus, clock)
    try:
        while True:
            now_ns = clock.now_ns()
            site.round(now_ns)
            await clock.sleep_until_ns((now_ns // ROUND_NS + 1) * ROUND_NS)
    finally:
        site.close()


class _Site:
    """Everybody who speaks to the room at a site."""

    def __init__(self, config: Config, grammar: Grammar, bus: Bus, clock: Clock) -> None:
        self._listeners: dict[str, Listener] = {}
        for speaker in config.speakers:
            try:
                hears = recogniser(speaker.language, grammar, speaker.voice)
            except RecogniserError as e:
                log.error("event=no_recogniser participant=%s language=%s reason=%r", speaker.participant, speaker.language, str(e))
                continue
            self._listeners[speaker.participant] = Listener(config, speaker, grammar, hears, bus)
            log.info("event=listening participant=%s language=%s listen=%s", speaker.participant, speaker.language, config.listen)
        names = self._listeners
        self._voices = bus.subscribe(BY_NAME["voice"], queue_all=True, polled=True, site=config.site)
        self._controls = bus.subscribe(BY_NAME["voice_control"], polled=True, site=config.site)
        self._keys = bus.subscribe(BY_NAME["world_key"], polled=True)
        self._results = [bus.subscribe(BY_NAME["command_result"], polled=True, participant=name) for name in names]
        self._things: tuple[Known, ...] = ()

    def round(self, now_ns: int) -> None:
        """What is done every 20 ms."""
        for sample in self._keys.take():
            if sample.message.things:
                self._things = tuple(Known(t.id, t.name, t.shape, name_of_colour(t.colour)) for t in sample.message.things)
        for sample in self._voices.take():
            if (listener := self._listeners.get(sample.names["participant"])) is not None:
                listener.ear.hear(sample.message)
        for sample in self._controls.take():
            if (listener := self._listeners.get(sample.names["participant"])) is not None:
                listener.press(sample.message.talk, self._things, now_ns)
        for inbox in self._results:
            for sample in inbox.take():
                self._listeners[sample.names["participant"]].answered(sample.message, now_ns)
        for listener in self._listeners.values():
            listener.round(self._things, now_ns)

    def close(self) -> None:
        """Stop listening."""
        for subscription in (self._voices, self._controls, self._keys, *self._results):
            subscription.close()
        for listener in self._listeners.values():
            listener.mouth.close()


class Listener:
    """What one participant says, and what came of it."""

    def __init__(self, config: Config, speaker: Speaker, grammar: Grammar, hears: Recogniser, bus: Bus) -> None:
        self.ear = Ear()
        self.mouth = Mouth(speaker.language, bus, speaker.participant, aloud=config.reply == "spoken")
        self._speaker, self._grammar, self._hears = speaker, grammar, hears
        self._dialogue = Dialogue(speaker.language, config.accept, config.listen == "wake")
        self._push = config.listen == "push"
        self._held = False
        self._answers = config.reply != "none"
        self._utterances = bus.publish(BY_NAME["utterance"], participant=speaker.participant)
        self._commands = bus.publish(BY_NAME["command"], participant=speaker.participant)
        self._waiting: dict[str, tuple[Utterance, int]] = {}

    def press(self, held: bool, things: Sequence[Known], now_ns: int) -> None:
        """The button for push to talk. Let go, what was said ends there."""
        was, self._held = self._held, held
        if self._push and was and not held:
            for heard in self._hears.flush():
                self._understand(heard, things, now_ns)
            self._hears.reset()

    def round(self, things: Sequence[Known], now_ns: int) -> None:
        """Listen to the next 20 ms."""
        self.mouth.round(now_ns)
        sound = self.ear.listen(now_ns)
        if sound is not None and (self._held or not self._push):
            if self.ear.fresh:
                self._hears.reset()
            for heard in self._hears.feed(sound):
                self._understand(heard, things, now_ns)
        for id, (utterance, until_ns) in list(self._waiting.items()):
            if now_ns > until_ns:
                del self._waiting[id]
                self._tell(utterance, Utterance.STATE_REFUSED, reply("silent", self._speaker.language), now_ns)

    def answered(self, result: CommandResult, now_ns: int) -> None:
        """The world has answered a command; perhaps one of these."""
        utterance, _ = self._waiting.pop(result.id, (None, 0))
        if utterance is None:
            return
        done = result.outcome == CommandResult.OUTCOME_DONE
        utterance.things.extend(result.things)
        language = self._speaker.language
        text = reply("done", language) if done else reply("refused", language, result.reason)
        log.info("event=answered participant=%s done=%s reason=%r", self._speaker.participant, done, result.reason)
        self._tell(utterance, Utterance.STATE_DONE if done else Utterance.STATE_REFUSED, text, now_ns)

    def _understand(self, heard: Hypotheses, things: Sequence[Known], now_ns: int) -> None:
        begin_ns, end_ns = self.ear.said_ns(heard[0].start_s), self.ear.said_ns(heard[0].end_s)
        if self.mouth.spoke_at(begin_ns):
            return  # the room heard itself
        language = self._speaker.language
        readings = [Reading(self._grammar.said(h.words, language) if h.words else None, h.confidence) for h in heard]
        turn = self._dialogue.heard(readings, things, now_ns)
        _HEARD.labels(self._speaker.participant, turn.outcome.value).inc()
        log.info(
            "event=heard participant=%s outcome=%s confidence=%.2f text=%r", self._speaker.participant, turn.outcome.value,
            heard[0].confidence, turn.said.text if turn.said else "",
        )  # fmt: skip
        if turn.outcome is Outcome.IGNORED:
            return
        utterance = Utterance(
            id=secrets.token_hex(8), participant=self._speaker.participant, language=language,
            text=turn.said.text if turn.said else "", spoken=turn.said.spoken if turn.said else "",
            confidence=turn.confidence or heard[0].confidence,
            start_ns=max(0, begin_ns), end_ns=max(0, end_ns),
        )  # fmt: skip
        for r in readings:
            if r.said is not None:
                utterance.readings.add(text=r.said.text, confidence=r.confidence)
        if turn.action is not None:
            self._ask(turn, utterance, end_ns, now_ns)
        self._tell(utterance, _STATES[turn.outcome], turn.reply, now_ns)

    def _ask(self, turn: Turn, utterance: Utterance, end_ns: int, now_ns: int) -> None:
        command: Any = message_of(turn.action, utterance.id, self._speaker.participant)  # type: ignore[arg-type]
        command.header.t_ns = now_ns
        utterance.command = command.id
        self._commands.put(command)
        self._waiting[command.id] = (utterance, now_ns + PATIENCE_NS)
        _LATENCY.labels(self._speaker.participant).observe(max(0.0, (now_ns - end_ns) * 1e-9))

    def _tell(self, utterance: Utterance, state: Utterance.State, text: str, now_ns: int) -> None:
        """Publish what has become of it."""
        utterance.state, utterance.reply = state, text if self._answers else ""
        utterance.header.t_ns = now_ns
        message = Utterance()
        message.CopyFrom(utterance)
        self._utterances.put(message)
        if text and state != Utterance.STATE_SENT:
            self.mouth.say(text, now_ns)
