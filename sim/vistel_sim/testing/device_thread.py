"""A simulated device that runs beside a test, in a thread with an event loop of its own."""

import asyncio
import threading
from collections.abc import Coroutine
from typing import Any

_END_S = 30.0
"""A device that has not ended by then never will [s]."""


class DeviceThread:
    """Runs `device` from the construction until `end`."""

    def __init__(self, name: str, device: Coroutine[Any, Any, None]) -> None:
        self._name = name
        self._device = device
        self._loop = asyncio.new_event_loop()
        self._task = self._loop.create_task(device)
        self._thread = threading.Thread(target=self._run, name=f"vistel {name}", daemon=True)
        self._thread.start()

    def check(self) -> None:
        """Raises RuntimeError, with its cause, when the device has ended by itself."""
        if self._task.done() and not self._task.cancelled():
            raise RuntimeError(f"simulated device {self._name} ended by itself") from self._task.exception()

    def end(self) -> None:
        """Cancel the device and wait until its thread has ended. Raises RuntimeError as `check` does."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._task.cancel)
        self._thread.join(_END_S)
        if self._thread.is_alive():
            raise RuntimeError(f"simulated device {self._name} does not end")
        self._loop.close()
        self.check()

    def _run(self) -> None:
        self._loop.run_until_complete(self._until_ended())

    async def _until_ended(self) -> None:
        await asyncio.wait([self._task])
        others = asyncio.all_tasks() - {asyncio.current_task()}
        for task in others:
            task.cancel()
        await asyncio.gather(*others, return_exceptions=True)
