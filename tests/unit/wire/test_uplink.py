"""What a site sends over a thin uplink: motion first, then voices, then frames of devices, and all again once it is wide."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from google.protobuf.message import Message
from virtual_time import LoopClock, run

from vistel.wire.clock_sync import serve_clock
from vistel.wire.link.probe import follow_uplink
from vistel.wire.link.queue_delay import QueueDelay
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.motion import MotionDecoder, MotionSample
from vistel.wire.motion.publication import MotionPublication
from vistel.wire.topics import BY_NAME, Topic
from vistel.wire.uplink import MOST_FRAMES, SOON_S, Pacer, Share, Uplink
from vistel_sim.network import Conditions
from vistel_sim.network.link import Link

MS = 1_000_000
SECOND = 1_000_000_000
OVERHEAD = 90
"""Of Zenoh, QUIC, UDP and IP, about [bytes]."""


def queue_after(*ways_ms: tuple[float, float], hub_ahead_ms: float = 1e6) -> float:
    """What is found after answers that took so long there and back, asked a quarter of a second apart."""
    queue, found = QueueDelay(), 0.0
    for i, (there_ms, back_ms) in enumerate(ways_ms):
        asked_ns = i * 250 * MS
        there_ns = asked_ns + round((there_ms + hub_ahead_ms) * MS)
        found = queue.answered(asked_ns, there_ns, asked_ns + round((there_ms + back_ms) * MS))
    return found


def test_a_queue_is_what_three_answers_in_a_row_took_longer_than_the_shortest() -> None:
    assert queue_after((50, 50), (50, 50), (50, 50)) == pytest.approx(0.0)
    assert queue_after((50, 50), (250, 50), (350, 50), (300, 50)) == pytest.approx(0.2)
    assert queue_after((50, 50), (50, 50), (850, 50)) == pytest.approx(0.0), "one late answer is a busy machine"


def test_a_queue_on_the_way_back_and_a_clock_that_is_set_are_no_queue_on_the_way_there() -> None:
    assert queue_after((50, 50), *[(50, 900)] * 5) == pytest.approx(0.0)
    queue = QueueDelay()
    found = [queue.answered(i * SECOND, i * SECOND + (50 if i < 3 else 5050) * MS, i * SECOND + 100 * MS) for i in range(9)]
    assert found == pytest.approx([0.0] * 9)


def test_a_question_without_an_answer_tells_how_long_the_queue_is_at_least() -> None:
    queue = QueueDelay()
    assert queue.waiting(0, 3 * SECOND) == 0.0, "nothing is known of the way yet"
    queue.answered(0, 0, 100 * MS)
    assert queue.waiting(SECOND, SECOND + 500 * MS) == 0.0, "it was lost and is sent again"
    assert queue.waiting(SECOND, SECOND + 700 * MS) == pytest.approx(0.6)


def test_a_share_gives_way_step_by_step_waits_while_the_queue_shrinks_and_comes_back() -> None:
    share, levels = Share(4, 0.1, 2.0), []
    for queue_s, at_s in ((0.15, 0.0), (0.15, 0.5), (0.12, 1.2), (0.14, 2.0), (0.14, 2.5)):
        share.follow(queue_s, round(at_s * SECOND))
        levels.append(share.level)
    assert levels == [1, 1, 1, 1, 2], "at first the effect is awaited, then the queue becomes shorter"
    for tenth in range(30, 75):
        share.follow(0.0, tenth * SECOND // 10)
    assert share.level == 0


def test_a_share_gives_way_at_once_where_the_queue_is_long() -> None:
    share = Share(4, 0.1, 2.0)
    share.follow(0.15, 0)
    share.follow(0.5, 100 * MS)
    assert share.level == 4


def test_after_an_attempt_that_proved_too_much_it_goes_back_to_what_had_room() -> None:
    share = Share(4, 0.1, 2.0)
    share.follow(0.15, 0)
    share.follow(0.01, 2 * SECOND)
    share.follow(0.01, 5 * SECOND)
    assert share.level == 0
    share.follow(0.6, 6 * SECOND)
    assert share.level == 1


def test_what_proved_too_much_is_tried_again_later_and_later_until_the_link_is_clear() -> None:
    share, now_ns, raised_s = Share(1, 0.1, 2.0), 0, []
    for _ in range(5):
        share.follow(0.2, now_ns)
        assert share.level == 1
        begun_ns = now_ns = now_ns + 2 * SECOND
        while share.level:
            now_ns += SECOND // 10
            share.follow(0.02, now_ns)
        raised_s.append((now_ns - begun_ns) / SECOND)
        now_ns += SECOND
    assert raised_s == pytest.approx([2.1, 8.1, 32.1, 32.1, 32.1])
    share.follow(0.2, now_ns)
    begun_ns = now_ns
    while share.level:
        now_ns += SECOND // 10
        share.follow(0.001, now_ns)
    assert (now_ns - begun_ns) / SECOND < 9.0


def test_who_begins_to_speak_finds_what_had_room_beside_a_voice() -> None:
    uplink = Uplink()
    uplink.speaks("ann", True)
    uplink.follow(1.0, 0)
    beside_a_voice = uplink.levels
    uplink.speaks("ann", False)
    now_ns = 0
    while uplink.levels["motion"] > 2:
        now_ns += SECOND // 5
        uplink.follow(0.01, now_ns)
    assert uplink.levels["voice"] >= beside_a_voice["voice"] - 1, "nobody has heard yet whether there is room for it"
    uplink.speaks("ann", True)
    assert uplink.levels["motion"] == beside_a_voice["motion"] > 2


def test_what_is_tried_is_taken_back_at_a_short_queue_and_nothing_else_gives_way() -> None:
    uplink, now_ns = Uplink(), 0
    uplink.follow(1.0, now_ns)
    while uplink.motion_hz < 20.0:
        now_ns += SECOND // 5
        uplink.follow(0.01, now_ns)
    before = uplink.levels
    uplink.follow(1.1 * SOON_S, now_ns + SECOND // 5)
    assert uplink.levels == before | {"motion": before["motion"] + 1}


@pytest.mark.parametrize(("hz", "sent"), [(30.0, 300), (20.0, 200), (15.0, 150), (10.0, 100), (0.0, 0)])
def test_a_pacer_lets_as_many_frames_through_as_the_rate_says_whatever_they_jitter(hz: float, sent: int) -> None:
    rng, pacer = random.Random(1), Pacer()
    times = [round((n / 60.0 + rng.uniform(-0.002, 0.002)) * 1e9) + SECOND for n in range(600)]
    assert sum(pacer.due(t, hz) for t in times) == pytest.approx(sent, abs=2)


def test_a_pacer_goes_on_when_time_goes_back() -> None:
    pacer = Pacer()
    assert pacer.due(100 * SECOND, 10.0)
    assert pacer.due(SECOND, 10.0)


@dataclass
class ThinSite:
    """A site that sends as its uplink says, over a simulated link; its questions wait in the same queue."""

    link: Link
    uplink: Uplink = field(default_factory=Uplink)
    connected: bool = True
    speaks: Callable[[float], bool] = lambda t_s: True
    """Whether there is a voice, by the time since the site began."""
    ages_s: list[tuple[float, float]] = field(default_factory=list)
    """Of each motion: when it was received, and how old it was."""
    voices: list[float] = field(default_factory=list)
    """When frames of the voice were received."""

    def __post_init__(self) -> None:
        self.clock = SteadyClock()
        self.hub = MemoryNetwork().bus("demo", "hub", self.clock)
        serve_clock(self.hub, self.clock)

    async def query(self, topic: Topic, request: Message, timeout_s: float) -> Any | None:
        loop = asyncio.get_running_loop()
        while (arrives_s := self.link.datagram(request.ByteSize() + OVERHEAD, loop.time())) is None:
            await asyncio.sleep(1.2 * self.link.conditions.round_trip_s)
        await asyncio.sleep(arrives_s - loop.time())
        reply = await self.hub.query(topic, request)
        await asyncio.sleep(self.link.conditions.delay_s)
        return reply

    def send(self, tick: int, now_s: float) -> None:
        """A sixtieth of a second: a motion, frames of a tracker and two gloves, and five sixths of a frame of a voice."""
        if self._motion.due(tick * SECOND // 60 + SECOND, self.uplink.motion_hz):
            arrives_s = self.link.datagram(60 + OVERHEAD, now_s)
            if arrives_s is not None:
                self.ages_s.append((arrives_s, arrives_s - now_s))
        for device in self._devices:
            if device.due(tick * SECOND // 60 + SECOND, self.uplink.frames_hz):
                self.link.datagram(200 + OVERHEAD, now_s)
        self.uplink.speaks("ann", self.speaks(tick / 60.0))
        if not self.speaks(tick / 60.0):
            return
        together, bits = self.uplink.voice
        self._waiting += 5 / 6
        if self._waiting >= together:
            self._waiting -= together
            arrives_s = self.link.datagram(together * min(bits, 24_000) // 400 + OVERHEAD, now_s)
            self.voices += [] if arrives_s is None else [arrives_s] * together

    async def run(self, *phases: tuple[Conditions, float]) -> None:
        self._motion, self._devices, self._waiting = Pacer(), [Pacer() for _ in range(3)], 0.0
        asking = asyncio.create_task(follow_uplink(self, self.clock))  # type: ignore[arg-type]
        tick = 0
        for conditions, seconds in phases:
            self.link.conditions = conditions
            for _ in range(round(seconds * 60)):
                self.send(tick, asyncio.get_running_loop().time())
                tick += 1
                await asyncio.sleep(1 / 60)
        asking.cancel()
        await asyncio.gather(asking, return_exceptions=True)


class SteadyClock(LoopClock):
    def steady_ns(self) -> int:
        return self.now_ns()


WIDE = Conditions(0.05)
THIN = Conditions(0.05, bits_per_s=64_000)


def test_over_64_kbit_a_second_motion_stays_fresh_and_the_voice_whole_and_all_comes_back() -> None:
    async def scene() -> tuple[ThinSite, float]:
        begun_s = asyncio.get_running_loop().time()
        site = ThinSite(Link(WIDE, random.Random(1)))
        await site.run((WIDE, 10.0), (THIN, 60.0), (WIDE, 60.0))
        return site, begun_s

    site, begun_s = run(scene())
    thin = sorted(age_s for at_s, age_s in site.ages_s if 30.0 < at_s - begun_s < 70.0)
    assert thin[len(thin) // 2] < 0.05 + 0.06
    assert thin[-1] < 0.05 + 0.5, "now and then more is tried"
    assert len(thin) / 40.0 >= 15.0
    voices = [at_s for at_s in site.voices if 30.0 < at_s - begun_s < 70.0]
    assert len(voices) / 40.0 == pytest.approx(50.0, rel=0.02)
    assert max(b - a for a, b in pairwise(voices)) < 0.02 * MOST_FRAMES + 0.5
    assert site.uplink.levels == {"motion": 0, "voice": 0, "frames": 0}


@pytest.mark.parametrize("conditions", [WIDE, Conditions(0.05, 0.05, loss=0.02), Conditions(0.15, bits_per_s=2e6)])
def test_over_a_link_with_room_for_all_nothing_gives_way(conditions: Conditions) -> None:
    async def scene() -> tuple[ThinSite, set[int]]:
        site = ThinSite(Link(conditions, random.Random(1)))
        await site.run((conditions, 30.0))
        return site, set(site.uplink.levels.values())

    site, levels = run(scene())
    assert levels == {0}
    assert len(site.ages_s) > 0.95 * 30 * 60


@pytest.mark.parametrize("jitter_s", [0.0, 0.03])
def test_a_way_that_becomes_longer_is_no_queue_for_long(jitter_s: float) -> None:
    async def scene() -> tuple[ThinSite, float]:
        begun_s = asyncio.get_running_loop().time()
        site = ThinSite(Link(WIDE, random.Random(1)))
        await site.run((WIDE, 10.0), (Conditions(0.13, jitter_s), 40.0))
        return site, begun_s

    site, begun_s = run(scene())
    assert site.uplink.levels == {"motion": 0, "voice": 0, "frames": 0}
    assert sum(at_s - begun_s > 20.0 for at_s, _ in site.ages_s) == pytest.approx(30 * 60, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("bits_per_s", "queue_bytes"), [(24_000, 2000), (48_000, 65_536), (96_000, 65_536), (256_000, 2000)])
def test_a_queue_is_never_taken_for_a_longer_way(bits_per_s: float, queue_bytes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene() -> None:
        site = ThinSite(Link(WIDE, random.Random(1)))
        monkeypatch.setattr(site.uplink, "begin_anew", lambda: begun.append(asyncio.get_running_loop().time()))
        await site.run((WIDE, 10.0), (Conditions(0.05, bits_per_s=bits_per_s, queue_bytes=queue_bytes), 30.0))

    begun: list[float] = []
    run(scene())
    assert not begun


def test_motion_that_gives_way_is_numbered_without_gaps_and_decodes() -> None:
    async def scene() -> None:
        clock, network = SteadyClock(), MemoryNetwork()
        bus, decoder = network.bus("c", "a", clock), MotionDecoder()
        received = network.bus("c", "b", clock).subscribe(BY_NAME["motion"], queue_all=True)
        motion = MotionPublication(bus, "ann", crowded=False)
        for k in range(180):
            if k == 60:
                bus.uplink.follow(1.0, clock.steady_ns())
            posture = np.full(25, 0.001 * k)
            t_ns = clock.now_ns() + k * SECOND // 60
            motion.put(MotionSample(motion.next_seq, t_ns, posture, np.zeros((2, 20)), np.zeros(4)))
        decoded = [decoder.decode(s.message) for s in received.take()]
        assert [d.seq for d in decoded if d is not None] == list(range(1, 60 + 20 + 1))

    run(scene())
