"""Whose voices of a crowd a site receives."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from vistel.v1.audio_pb2 import Voice
from vistel.wire.bus import Publication
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.motion.interest import LOUD, NEAR
from vistel.wire.topics import BY_NAME
from vistel_services.audio.voice_subscriptions import LOUD_NS, VoiceSubscriptions

PEOPLE = {f"p{i:02d}": f"s{i:02d}" for i in range(30)}
FAR = {name: float(i) for i, name in enumerate(PEOPLE)}
NEAREST = set(list(PEOPLE)[:NEAR])


class Crowd:
    """People who speak, each from a site of their own, and a listener."""

    def __init__(self, crowd: Mapping[str, str]) -> None:
        network, clock = MemoryNetwork(), SystemClock()
        self.clock = clock
        self.heard = VoiceSubscriptions(network.bus("c", "here", clock), crowd, ["p29"])
        self._voices = {n: self._publication(network, s, "voice", n) for n, s in PEOPLE.items()}
        self._levels = {n: self._publication(network, s, "voice_level", n) for n, s in PEOPLE.items()}

    def _publication(self, network: MemoryNetwork, site: str, topic: str, name: str) -> Publication:
        return network.bus("c", site, self.clock).publish(BY_NAME[topic], participant=name)

    def received(self) -> set[str]:
        """Who is received when everybody speaks."""
        for voice in self._voices.values():
            voice.put(Voice(opus=b"x"))
        return {sample.names["participant"] for sample in self.heard.take()}

    def levels(self, levels: Mapping[str, float]) -> None:
        for name, db in levels.items():
            self._levels[name].put(Voice(level_db=db))


def test_of_a_small_conference_all_voices_are_received_whoever_is_near() -> None:
    async def meet() -> None:
        people = Crowd({})
        people.heard.choose(FAR, people.clock.now_ns())
        assert people.received() == set(PEOPLE)
        people.heard.close()
        assert people.received() == set()

    asyncio.run(meet())


def test_of_a_crowd_the_near_are_received_and_those_who_speak_loudest_but_not_oneself() -> None:
    async def meet() -> None:
        people = Crowd(PEOPLE)
        people.heard.choose(FAR, people.clock.now_ns())
        assert people.received() == NEAREST
        people.levels(dict.fromkeys(PEOPLE, -60.0) | dict.fromkeys(list(PEOPLE)[20:30], -10.0))
        people.heard.choose(FAR, people.clock.now_ns())
        loud = people.received() - NEAREST
        assert loud == {f"p{i}" for i in range(20, 20 + LOUD)}
        people.heard.close()

    asyncio.run(meet())


def test_who_has_fallen_silent_is_given_up_after_a_second() -> None:
    async def meet() -> None:
        people = Crowd(PEOPLE)
        people.levels({"p25": -5.0})
        now_ns = people.clock.now_ns()
        people.heard.choose(FAR, now_ns)
        assert "p25" in people.received()
        people.heard.choose(FAR, now_ns + 2 * LOUD_NS)
        assert people.received() == NEAREST
        people.heard.close()

    asyncio.run(meet())
