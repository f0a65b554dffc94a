"""Clocks: safe from several threads, and waits that pass in their time."""

from __future__ import annotations

import asyncio
import sys
import threading

import pytest

from vistel.wire.clock import SimulatedClock, SystemClock, sleep, within


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
