"""Clocks: safe from several threads, and waits that pass in their time."""

from __future__ import annotations

import asyncio
import sys
import threading

import pytest

from vistel.wire.clock import SimulatedClock, SystemClock, sleep, within
from vistel.wire.clock_sync import serve_clock, set_clock
from vistel.wire.memory_bus import MemoryNetwork


def test_a_system_clock_that_several_threads_ask_never_steps_back_and_slews_no_faster_than_it_may() -> None:
    clock = SystemClock()
    clock.adjust(0.0)
    clock.adjust(50e6)
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)  # threads take turns in the middle of a reading
    steps_back: list[int] = []

    def read() -> None:
        last = clock.now_ns()
        for _ in range(20_000):
            now = clock.now_ns()
            if now < last:
                steps_back.append(last - now)
            last = now

    threads = [threading.Thread(target=read) for _ in range(4)]
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(before_s)
    assert steps_back == []


def test_waits_pass_in_simulated_time() -> None:
    async def scene() -> tuple[bool, bool]:
        clock = SimulatedClock(1_000)
        waiting = asyncio.create_task(sleep(clock, 3600.0))

        async def late() -> None:
            async with within(clock, 60.0):
                await asyncio.Event().wait()

        hurried = asyncio.create_task(late())
        await clock.advance_to_ns(59_000_000_000)
        early = waiting.done() or hurried.done()
        await clock.advance_to_ns(61_000_000_000)
        with pytest.raises(TimeoutError):
            await hurried
        await clock.advance_to_ns(3_700_000_000_000)
        return early, waiting.done()

    assert asyncio.run(scene()) == (False, True)


def test_a_block_that_ends_in_time_leaves_nothing_behind() -> None:
    async def scene() -> int:
        clock = SimulatedClock()
        async with within(clock, 1.0):
            await asyncio.sleep(0)
        return len(clock._sleepers)

    assert asyncio.run(scene()) == 0


class Machine:
    """A machine's clocks: seconds it has run, and how far somebody has set its time ahead."""

    def __init__(self, wall_s: float = 1_700_000_000.0) -> None:
        self.ran_s, self.wall_s = 50.0, wall_s

    def pass_by(self, seconds: float) -> None:
        self.ran_s += seconds
        self.wall_s += seconds

    def clock(self) -> SystemClock:
        return SystemClock(lambda: round(self.ran_s * 1e9), lambda: round(self.wall_s * 1e9))


class Conference:
    """A hub and a site, each with a machine of its own."""

    def __init__(self, site_off_s: float = 0.0) -> None:
        self.machines = [Machine(), Machine(1_700_000_000.0 + site_off_s)]
        self.hub, self.site = (m.clock() for m in self.machines)

    @property
    def off_s(self) -> float:
        """How far the site is ahead of the hub."""
        return (self.site.now_ns() - self.hub.now_ns()) * 1e-9

    def pass_by(self, seconds: float) -> None:
        for machine in self.machines:
            machine.pass_by(seconds)

    def measure(self) -> None:
        async def measured() -> bool:
            network = MemoryNetwork()
            serve_clock(network.bus("demo", "hub", self.hub), self.hub)
            return await set_clock(network.bus("demo", "tokyo", self.site), self.site) is not None

        assert asyncio.run(measured())


@pytest.mark.parametrize("off_s", [120.0, -120.0, 0.3, -1.6e9])
def test_a_site_whose_machine_is_wrong_is_on_time_after_one_measurement_and_told_which_machine_to_set(
    off_s: float, caplog: pytest.LogCaptureFixture
) -> None:
    both = Conference(off_s)
    both.measure()
    assert abs(both.off_s) < 1e-3
    told = [r.getMessage() for r in caplog.records]
    assert len(told) == (abs(off_s) > 0.5) and all("this machine's time is" in t and "timedatectl" in t for t in told)


def test_a_machine_that_slept_is_on_time_when_it_wakes() -> None:
    both = Conference()
    both.measure()
    both.pass_by(60.0)  # time asleep counts as running
    assert abs(both.off_s) < 1e-6


def test_a_time_server_that_sets_a_machine_s_time_changes_nothing_in_the_conference() -> None:
    both = Conference()
    both.measure()
    for machine, jump_s in zip(both.machines, (3600.0, -86400.0), strict=True):
        machine.wall_s += jump_s
        both.pass_by(5.0)
        both.measure()
        assert abs(both.off_s) < 1e-6


def test_over_half_a_second_a_clock_is_set_at_once_and_below_it_is_slewed_without_a_step_back(
    caplog: pytest.LogCaptureFixture,
) -> None:
    both = Conference()
    both.measure()
    both.machines[1].ran_s += 60.0  # as a machine whose sleep is not counted, or a hub that was started again
    both.measure()
    assert abs(both.off_s) < 1e-3
    assert [r for r in caplog.records if "clock set by_s=-60.000" in r.getMessage()]
    both.machines[1].ran_s += 0.4
    both.measure()
    last = both.site.now_ns()
    for _ in range(100):
        both.pass_by(0.1)
        assert 0.0989e9 < both.site.now_ns() - last < 0.1e9 + 1
        last = both.site.now_ns()
    assert abs(both.off_s) == pytest.approx(0.3, abs=0.01)
    for _ in range(7):
        both.pass_by(5.0)
        both.measure()
    assert abs(both.off_s) < 1e-3


def test_a_hub_without_a_clock_leaves_the_site_on_its_own() -> None:
    clock = Machine().clock()
    before = clock.now_ns()

    async def alone() -> None:
        assert await set_clock(MemoryNetwork().bus("demo", "tokyo", clock), clock) is None

    asyncio.run(alone())
    assert clock.now_ns() == before


def test_a_sleep_ends_when_the_clock_is_set_past_its_end() -> None:
    machine = Machine()
    clock = machine.clock()
    clock.adjust(0.0)

    async def asleep() -> None:
        waiting = asyncio.create_task(clock.sleep_until_ns(clock.now_ns() + 3_600_000_000_000))
        await asyncio.sleep(0)
        clock.adjust(3_600_000_000_000.0)
        await asyncio.wait_for(waiting, 30.0)

    asyncio.run(asleep())
