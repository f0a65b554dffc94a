"""A renderer tells of each change of who is in its pictures at once, and of nothing else oftener than twice a second."""

from __future__ import annotations

import asyncio
import logging

import pytest

from vistel.figure.posture.posture import standing
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_services.renderer.service import Reporter

START_NS, PICTURE_NS = 10**12, 50_000_000
ON_TIME = Timing(100_000_000, 40_000_000, 2_000_000, False)


def reported(*pictures: tuple[int, int], caplog: pytest.LogCaptureFixture) -> tuple[list[str], list[tuple[int, int]]]:
    """What stands in the log and what was sent, (people, stand-ins), after `pictures` of (people, stand-ins), 20 a second."""
    sent: list[tuple[int, int]] = []

    async def main() -> None:
        network, clock = MemoryNetwork(), SimulatedClock(START_NS)
        reporter = Reporter("osaka", network.bus("c", "osaka", clock).publish(BY_NAME["image_delay"], site="osaka"))
        heard = network.bus("c", "hub", clock).subscribe(BY_NAME["image_delay"], queue_all=True, polled=True)
        for frame, (people, stand_ins) in enumerate(pictures):
            now_ns = START_NS + frame * PICTURE_NS
            those = tuple(PersonNow(ParticipantInfo(f"p{k}", f"P {k}"), standing(), ON_TIME) for k in range(people))
            reporter.drawn(Instant(now_ns, those), now_ns + 10_000_000, stand_ins)
        sent.extend((len(s.message.streams), s.message.stand_ins) for s in heard.take())

    with caplog.at_level(logging.INFO, "vistel.renderer"):
        asyncio.run(main())
    return [r.getMessage().split(" took_ms")[0] for r in caplog.records if "event=picture " in r.getMessage()], sent


def test_somebody_who_comes_with_a_figure_of_their_own_is_reported_though_nobody_was_a_stand_in(
    caplog: pytest.LogCaptureFixture,
) -> None:
    lines, sent = reported((2, 0), (2, 0), (3, 0), (3, 0), (2, 0), caplog=caplog)
    assert lines == [f"event=picture people={n} stand_ins=0" for n in (2, 3, 2)]
    assert sent == [(2, 0), (3, 0), (2, 0)]


def test_each_stand_in_that_gets_its_figure_is_reported(caplog: pytest.LogCaptureFixture) -> None:
    lines, sent = reported((3, 2), (3, 1), (3, 0), caplog=caplog)
    assert lines == [f"event=picture people=3 stand_ins={n}" for n in (2, 1, 0)]
    assert sent == [(3, 2), (3, 1), (3, 0)]


def test_while_nothing_changes_the_log_is_silent_and_the_bus_hears_twice_a_second(caplog: pytest.LogCaptureFixture) -> None:
    lines, sent = reported(*[(1, 0)] * 41, caplog=caplog)
    assert len(lines) == 1
    assert len(sent) == 1 + 4


def test_a_delay_that_turns_is_reported_within_a_tenth_of_a_second() -> None:
    sent: list[float] = []

    async def main() -> None:
        network, clock = MemoryNetwork(), SimulatedClock(START_NS)
        reporter = Reporter("osaka", network.bus("c", "osaka", clock).publish(BY_NAME["image_delay"], site="osaka"))
        heard = network.bus("c", "hub", clock).subscribe(BY_NAME["image_delay"], queue_all=True, polled=True)
        for frame in range(6):
            now_ns, towards_ns = START_NS + frame * PICTURE_NS, 30_000_000 if frame < 2 else 90_000_000
            timing = Timing(40_000_000, 10_000_000, 0, False, 30_000_000, towards_ns, 0.08)
            reporter.drawn(Instant(now_ns, (PersonNow(ParticipantInfo("p", "P"), standing(), timing),)), now_ns, 0)
        sent.extend(s.message.streams[0].towards_s for s in heard.take())

    asyncio.run(main())
    assert sent == [pytest.approx(0.03), pytest.approx(0.09)]
