"""An event loop whose time jumps from one timer to the next: services compute as fast as the machine can, and twice the same.

Whatever is ready runs first; when nothing is, the time moves to the next timer. Work for threads is done at once, on the loop,
so that no result depends on how threads were scheduled. Nothing may wait for other processes or for the network.
"""

import asyncio
import contextvars
import selectors
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from functools import cached_property
from typing import Any, TypeVar, TypeVarTuple

T = TypeVar("T")
Ts = TypeVarTuple("Ts")


class _Selector(selectors.DefaultSelector):
    """Waits in simulated time."""

    now_s = 0.0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Nothing; the time moves on by `timeout` [s]. Raises RuntimeError where every task would wait for ever."""
        if timeout is None:
            raise RuntimeError("simulated time stands still: every task waits for something that never comes")
        self.now_s += max(0.0, timeout)
        return []


class SimulatedLoop(asyncio.SelectorEventLoop):
    """See the module. Its time begins at 0."""

    def __init__(self) -> None:
        self._waiting = _Selector()
        super().__init__(self._waiting)

    def time(self) -> float:
        """Simulated time [s]."""
        return self._waiting.now_s

    def call_soon_threadsafe(
        self, callback: Callable[[*Ts], object], *args: *Ts, context: contextvars.Context | None = None
    ) -> asyncio.Handle:
        """As `call_soon`: the loop never sleeps, so nobody has to wake it."""
        return self.call_soon(callback, *args, context=context)

    def run_in_executor(self, executor: Executor | None, func: Callable[[*Ts], T], *args: *Ts) -> asyncio.Future[T]:
        """As asyncio's, but on this thread and done when it returns."""
        done: asyncio.Future[T] = self.create_future()
        try:
            done.set_result(func(*args))
        except Exception as e:
            done.set_exception(e)
        return done

    def default_exception_handler(self, context: dict[str, Any]) -> None:
        """As asyncio's, but what a signal raised in a task is no fault of it: whoever runs the loop gets it."""
        if not isinstance(context.get("exception"), KeyboardInterrupt | SystemExit):
            super().default_exception_handler(context)


def _end(over: asyncio.Future[None]) -> None:
    if not over.cancelled():
        over.set_result(None)


class LoopClock:
    """Conference time that passes with the running loop's; see `vistel.wire.clock.Clock`."""

    def __init__(self, begin_ns: int = 0) -> None:
        """begin_ns: conference time at which the loop's time is 0: of the loop that runs when a time is first asked for."""
        self._begin_ns = begin_ns

    @cached_property
    def _loop(self) -> asyncio.AbstractEventLoop:
        return asyncio.get_running_loop()  # asks the kernel each time

    def now_ns(self) -> int:
        """As `Clock.now_ns`."""
        return self._begin_ns + round(self._loop.time() * 1e9)

    steady_ns = now_ns

    async def sleep_until_ns(self, t_ns: int) -> None:
        """As `Clock.sleep_until_ns`."""
        if t_ns <= self.now_ns():
            await asyncio.sleep(0)
            return
        over = self._loop.create_future()  # as `asyncio.sleep`, which asks for the loop, and so for the process, each time
        timer = self._loop.call_later((t_ns - self.now_ns()) * 1e-9, _end, over)
        try:
            await over
        finally:
            timer.cancel()

    def call_after(self, seconds: float, callback: Callable[[], object]) -> Callable[[], object]:
        """As `Clock.call_after`."""
        return self._loop.call_later(seconds, callback).cancel


def run(main: Coroutine[Any, Any, T]) -> T:
    """As `asyncio.run`, in simulated time."""
    with asyncio.Runner(loop_factory=SimulatedLoop) as runner:
        return runner.run(main)
