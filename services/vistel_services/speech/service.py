"""The speech of a site as a service: one round every 20 ms, in which voices are listened to and commands are answered."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping

from vistel.space.commands.reference import name_of_colour
from vistel.speech.dialogue import KnownThing
from vistel.speech.grammar import Grammar
from vistel.speech.recognisers import RecogniserError, checked_grammar, recogniser
from vistel.speech.recognition import Recogniser
from vistel.speech.synthesis import voices
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME
from vistel_services.speech.config import Config
from vistel_services.speech.echoes import Echoes
from vistel_services.speech.listener import Listener

log = logging.getLogger("vistel.speech")

ROUND_NS = 20_000_000
"""From one round to the next [ns]."""


async def run_speech(config: Config, bus: Bus, clock: Clock) -> None:
    """Until cancelled. Grammar and models are loaded in a thread: the process serves others meanwhile."""
    grammar, recognisers = await asyncio.to_thread(_loaded, config)
    site = _Site(config, grammar, recognisers, bus)
    try:
        while True:
            now_ns = clock.now_ns()
            site.round(now_ns)
            await clock.sleep_until_ns((now_ns // ROUND_NS + 1) * ROUND_NS)
    finally:
        site.close()


def _loaded(config: Config) -> tuple[Grammar, dict[str, Recogniser]]:
    """The grammar, and by participant what recognises them; those who cannot be recognised here are left out."""
    grammar, faults = checked_grammar(*config.grammars)
    for fault in faults:
        log.warning("event=grammar_fault at=%s:%d reason=%r", fault.path, fault.line, fault.text)
    if config.listen == "wake":
        grammar = grammar.awaited()
    out: dict[str, Recogniser] = {}
    for speaker in config.speakers:
        try:
            out[speaker.participant] = recogniser(speaker.language, grammar, speaker.voice, speaker.engine)
        except RecogniserError as e:
            log.error("event=no_recogniser participant=%s language=%s reason=%r", speaker.participant, speaker.language, str(e))
    voices()  # asks synthesisers what they have, once
    return grammar, out


class _Site:
    """Everybody who speaks to the room at a site."""

    def __init__(self, config: Config, grammar: Grammar, recognisers: Mapping[str, Recogniser], bus: Bus) -> None:
        self._listeners: dict[str, Listener] = {}
        self._echoes = Echoes()
        for speaker in config.speakers:
            if (found := recognisers.get(speaker.participant)) is None:
                continue
            self._listeners[speaker.participant] = Listener(config, speaker, grammar, found, bus, self._echoes, self._replied_at)
            log.info("event=listening participant=%s language=%s listen=%s", speaker.participant, speaker.language, config.listen)
        names = self._listeners
        self._voices = bus.subscribe(BY_NAME["voice"], queue_all=True, polled=True, site=config.site)
        self._controls = bus.subscribe(BY_NAME["voice_control"], polled=True, site=config.site)
        self._utterances = bus.subscribe(BY_NAME["utterance"], polled=True)
        self._keys = bus.subscribe(BY_NAME["world_key"], polled=True)
        self._results = [bus.subscribe(BY_NAME["command_result"], polled=True, participant=name) for name in names]
        self._things: tuple[KnownThing, ...] = ()

    def round(self, now_ns: int) -> None:
        """What is done every 20 ms."""
        for sample in self._keys.take():
            if sample.message.things:
                self._things = tuple(KnownThing(t.id, t.name, t.shape, name_of_colour(t.colour)) for t in sample.message.things)
        for sample in self._voices.take():
            if (listener := self._listeners.get(sample.names["participant"])) is not None:
                listener.reader.push(sample.message, sample.received_ns)
        for sample in self._controls.take():
            if (listener := self._listeners.get(sample.names["participant"])) is not None:
                listener.set_control(sample.message, self._things, now_ns)
        for sample in self._utterances.take():
            self._echoes.add(sample.message)
        for inbox in self._results:
            for sample in inbox.take():
                self._listeners[sample.names["participant"]].answered(sample.message, now_ns)
        for listener in self._listeners.values():
            listener.round(self._things, now_ns)

    def _replied_at(self, t_ns: int) -> bool:
        """Whether the room's own voice, whoever it answers, could be heard at this site then."""
        return any(listener.replies.spoke_at(t_ns) for listener in self._listeners.values())

    def close(self) -> None:
        """Stop listening."""
        for subscription in (self._voices, self._controls, self._utterances, self._keys, *self._results):
            subscription.close()
        for listener in self._listeners.values():
            listener.replies.close()
