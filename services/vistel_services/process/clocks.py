"""Which clock a process runs on, as text that can be passed to it."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

from vistel.wire.clock import Clock, SystemClock


class ReplayClock:
    """Conference time of a log played at `speed`: `log_ns` was at `monotonic_ns` of this machine's monotonic clock.

    Processes of one machine that get the same three numbers agree to the nanosecond.
    """

    def __init__(self, log_ns: int, monotonic_ns: int, speed: float) -> None:
        self.log_ns, self._monotonic_ns, self.speed = log_ns, monotonic_ns, speed

    def now_ns(self) -> int:
        return self.log_ns + int((time.monotonic_ns() - self._monotonic_ns) * self.speed)

    steady_ns = now_ns

    async def sleep_until_ns(self, t_ns: int) -> None:
        await asyncio.sleep(max(0.0, (t_ns - self.now_ns()) * 1e-9 / self.speed))

    def call_after(self, seconds: float, callback: Callable[[], object]) -> Callable[[], object]:
        return asyncio.get_running_loop().call_later(seconds / self.speed, callback).cancel

    def text(self) -> str:
        """The form `clock_from_text` reads."""
        return f"replay:{self.log_ns}:{self._monotonic_ns}:{self.speed!r}"


class StandingClock:
    """`clock`, but for that it stands at `begin_ns` until `clock` is there."""

    def __init__(self, clock: ReplayClock, begin_ns: int) -> None:
        self._clock, self._begin_ns = clock, begin_ns

    def now_ns(self) -> int:
        return max(self._begin_ns, self._clock.now_ns())

    steady_ns = now_ns

    async def sleep_until_ns(self, t_ns: int) -> None:
        await self._clock.sleep_until_ns(t_ns)

    def call_after(self, seconds: float, callback: Callable[[], object]) -> Callable[[], object]:
        return self._clock.call_after(seconds + (self.now_ns() - self._clock.now_ns()) * 1e-9, callback)


def begin_ns_of(clock: Clock) -> int:
    """Conference time at which a replay begins; its processes start earlier. 0 for a clock that is no replay's."""
    return clock.log_ns if isinstance(clock, ReplayClock) else 0


def clock_from_text(text: str) -> Clock:
    """ "system", or "replay:LOG_NS:MONOTONIC_NS:SPEED"."""
    if text == "system":
        return SystemClock()
    kind, *numbers = text.split(":")
    if kind != "replay" or len(numbers) != 3:
        raise ValueError(f"clock: expected 'system' or 'replay:LOG_NS:MONOTONIC_NS:SPEED', got {text!r}")
    return ReplayClock(int(numbers[0]), int(numbers[1]), float(numbers[2]))
