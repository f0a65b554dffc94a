"""An event loop whose time jumps from one timer to the next: seconds of devices, drivers and services in a fraction of one.

Ports and sockets stay real, so before every jump the loop looks once more whether something has arrived: the kernel hands
bytes over a pseudo-terminal by a thread of its own. What comes later than that look is read at the next timer, as on
a machine that is busy; no result depends on how fast or how loaded this one is. Nothing here may wait for other threads
or processes.
"""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

T = TypeVar("T")

START_S = 1_000.0
"""A loop's time at its beginning."""
_LOOK_S = 0.0002


class _Selector(selectors.DefaultSelector):  # type: ignore[misc, valid-type]
    """Waits in virtual time."""

    now_s = START_S

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        found = super().select(0)
        if found or (timeout is not None and timeout <= 0):
            return found
        if timeout is None:
            return super().select(None)
        found = super().select(_LOOK_S)
        if not found:
            self.now_s += timeout
        return found


class VirtualTimeLoop(asyncio.SelectorEventLoop):
    """See the module."""

    def __init__(self) -> None:
        self._virtual = _Selector()
        super().__init__(self._virtual)

    def time(self) -> float:
        return self._virtual.now_s


class LoopClock:
    """Conference time that is the running loop's."""

    def now_ns(self) -> int:
        return round(asyncio.get_running_loop().time() * 1e9)

    steady_ns = now_ns

    async def sleep_until_ns(self, t_ns: int) -> None:
        await asyncio.sleep(max(0.0, (t_ns - self.now_ns()) * 1e-9))

    def call_after(self, seconds: float, callback: Callable[[], object]) -> Callable[[], object]:
        return asyncio.get_running_loop().call_later(seconds, callback).cancel


def run(main: Coroutine[Any, Any, T]) -> T:
    """As `asyncio.run`, in virtual time."""
    with asyncio.Runner(loop_factory=VirtualTimeLoop) as runner:
        return runner.run(main)
