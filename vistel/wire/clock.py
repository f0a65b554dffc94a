"""Clocks: the only place of the library that reads one. Times are integer nanoseconds of conference time."""

import asyncio
import sys
import threading
import time
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from typing import Protocol, TypeVar

T = TypeVar("T")


class Clock(Protocol):
    """What a service gets instead of the operating system's time."""

    def now_ns(self) -> int:
        """Conference time."""
        ...

    async def sleep_until_ns(self, t_ns: int) -> None:
        """Return once `now_ns() >= t_ns`; at once when that time has passed."""
        ...

    def call_after(self, seconds: float, callback: Callable[[], object]) -> Callable[[], object]:
        """Call `callback` on the event loop when `seconds` have passed; the result calls that off. A duration: that the clock is
        set meanwhile does not change it."""
        ...

    def steady_ns(self) -> int:
        """Time from an arbitrary moment that is never set and passes while the machine sleeps."""
        ...


async def sleep(clock: Clock, seconds: float) -> None:
    """As `asyncio.sleep`, on `clock`."""
    over = asyncio.Event()
    call_off = clock.call_after(seconds, over.set)
    try:
        await over.wait()
    finally:
        call_off()


@asynccontextmanager
async def within(clock: Clock, seconds: float) -> AsyncGenerator[None]:
    """As `asyncio.timeout`, on `clock`: raises TimeoutError when the block takes longer than `seconds`."""
    async with asyncio.timeout(None) as limit:
        loop = asyncio.get_running_loop()
        call_off = clock.call_after(seconds, lambda: limit.reschedule(loop.time()))
        try:
            yield
        finally:
            call_off()


async def on_thread(clock: Clock, work: Callable[[], T]) -> T:
    """What `work` gives, done on a thread. Simulated time stands still meanwhile."""
    if not isinstance(clock, SimulatedClock):
        return await asyncio.to_thread(work)
    clock.held += 1
    try:
        return await asyncio.to_thread(work)
    finally:
        clock.held -= 1


_RUNNING = None if sys.platform == "win32" else getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)


def running_ns() -> int:
    """Time since the machine was started, that in which it slept included; nobody sets it."""
    return time.monotonic_ns() if _RUNNING is None else time.clock_gettime_ns(_RUNNING)


STEP_NS = 500_000_000
"""A clock that is off by more is set at once; one that is off by less is slewed, so that no motion jumps."""


class SystemClock:
    """Conference time: the machine's time when this was made, from then on its running time, plus an offset that is measured
    against the hub. That somebody sets the machine's time changes nothing, and a machine that slept is on time when it wakes.
    """

    MAX_SLEW = 0.01
    """Seconds of correction per second of time, at most, while it is slewed."""
    LOOK_S = 0.5
    """A sleep looks at the clock so often: it may have been set [s]."""

    def __init__(self, running: Callable[[], int] = running_ns, wall: Callable[[], int] = time.time_ns) -> None:
        """running: nanoseconds that only grow; wall: nanoseconds since 1970, as the machine has them."""
        self._running, self._wall = running, wall
        self._base_ns = wall() - running()
        self._offset_ns = 0.0
        self._target_ns = 0.0
        self._slewed_at_ns = running()
        self._set = False
        self._lock = threading.Lock()  # of all above: the bus, sound cards and devices ask from threads of their own

    def now_ns(self) -> int:
        """As `Clock.now_ns`. Safe from any thread."""
        with self._lock:
            return self._slewed_ns()

    def adjust(self, offset_ns: float) -> None:
        """Move towards being `offset_ns` ahead of where it is now: at once the first time and over STEP_NS, else slowly."""
        with self._lock:
            self._slewed_ns()
            self._target_ns = self._offset_ns + offset_ns
            if not self._set or abs(offset_ns) > STEP_NS:
                self._offset_ns, self._set = self._target_ns, True

    @property
    def machine_off_ns(self) -> int:
        """How far the machine's own time is ahead of conference time now."""
        return self._wall() - self.now_ns()

    def _slewed_ns(self) -> int:
        mono = self._running()
        if self._target_ns != self._offset_ns:
            limit = self.MAX_SLEW * (mono - self._slewed_at_ns)
            self._offset_ns += max(-limit, min(limit, self._target_ns - self._offset_ns))
        self._slewed_at_ns = mono
        return int(mono + self._base_ns + self._offset_ns)

    async def sleep_until_ns(self, t_ns: int) -> None:
        """As `Clock.sleep_until_ns`."""
        left_s = (t_ns - self.now_ns()) * 1e-9
        if left_s <= 0.0:
            await asyncio.sleep(0)  # others have their turn all the same
        while left_s > 0.0:
            await asyncio.sleep(min(left_s, self.LOOK_S))
            left_s = (t_ns - self.now_ns()) * 1e-9

    def call_after(self, seconds: float, callback: Callable[[], object]) -> Callable[[], object]:
        """As `Clock.call_after`."""
        return asyncio.get_running_loop().call_later(seconds, callback).cancel

    def steady_ns(self) -> int:
        """As `Clock.steady_ns`."""
        return running_ns()


class SimulatedClock:
    """Time that moves only when told to: for tests and for replaying a log faster than it was recorded."""

    def __init__(self, start_ns: int = 0) -> None:
        self._now_ns = start_ns
        self._sleepers: list[tuple[int, int, Callable[[], object]]] = []
        self._count = 0
        self.held = 0
        """Threads for which time stands still."""

    def now_ns(self) -> int:
        """The time that was last moved to [ns]."""
        return self._now_ns

    steady_ns = now_ns

    async def sleep_until_ns(self, t_ns: int) -> None:
        """As `Clock.sleep_until_ns`: until `advance_to_ns` gets there."""
        if t_ns <= self._now_ns:
            await asyncio.sleep(0)
            return
        future: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._call_at(t_ns, lambda: future.done() or future.set_result(None))
        await future

    def call_after(self, seconds: float, callback: Callable[[], object]) -> Callable[[], object]:
        """As `Clock.call_after`, during `advance_to_ns`."""
        sleeper = self._call_at(self._now_ns + round(seconds * 1e9), callback)
        return lambda: sleeper not in self._sleepers or self._sleepers.remove(sleeper)

    def _call_at(self, t_ns: int, callback: Callable[[], object]) -> tuple[int, int, Callable[[], object]]:
        self._count += 1
        self._sleepers.append((t_ns, self._count, callback))
        return self._sleepers[-1]

    async def advance_to_ns(self, t_ns: int) -> None:
        """Move to `t_ns`, waking every sleeper on the way in the order of their times."""
        await self._settle()
        while True:
            due = sorted(s for s in self._sleepers if s[0] <= t_ns)
            if not due:
                break
            self._now_ns = max(self._now_ns, due[0][0])
            self._sleepers.remove(due[0])
            due[0][2]()
            await self._settle()
        self._now_ns = max(self._now_ns, t_ns)
        await self._settle()

    async def _settle(self) -> None:
        """Let every task that can run do so before time moves on."""
        for _ in range(20):
            await asyncio.sleep(0)
        while self.held:
            await asyncio.sleep(0.0002)
            for _ in range(20):
                await asyncio.sleep(0)
