"""A simulated device that runs beside a test, in a thread with an event loop of its own."""

import asyncio
import contextlib
import threading
from collections.abc import Callable, Coroutine
from typing import Any, cast

_END_S = 30.0
"""A device that has not ended by then never will [s]."""


class DeviceThread:
    """Runs `device` from the construction until `end`."""

    def __init__(self, name: str, device: Coroutine[Any, Any, None]) -> None:
        self._name = name
        self._device = device
        self._begun = threading.Event()
        self._cancel: Callable[[], object] = lambda: None
        self._ending = False
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._run, name=f"vistel {name}", daemon=True)
        self._thread.start()
        self._begun.wait()

    def check(self) -> None:
        """Raises RuntimeError, with its cause, when the device has ended by itself."""
        if not self._thread.is_alive() and (self._error is not None or not self._ending):
            raise RuntimeError(f"simulated device {self._name} ended by itself") from self._error

    def end(self) -> None:
        """Cancel the device and wait until its thread has ended. Raises RuntimeError as `check` does."""
        if self._thread.is_alive():
            self._ending = True
            self._cancel()
        self._thread.join(_END_S)
        if self._thread.is_alive():
            raise RuntimeError(f"simulated device {self._name} does not end")
        self.check()

    def _run(self) -> None:
        try:
            with contextlib.suppress(asyncio.CancelledError):
                asyncio.run(self._until_ended())
        except Exception as error:
            self._error = error

    async def _until_ended(self) -> None:
        loop, task = asyncio.get_running_loop(), cast("asyncio.Task[None]", asyncio.current_task())

        def cancel() -> None:
            with contextlib.suppress(RuntimeError):  # the loop has ended meanwhile
                loop.call_soon_threadsafe(task.cancel)

        self._cancel = cancel
        self._begun.set()
        await self._device
