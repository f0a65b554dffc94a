"""Carries bytes between a driver and its device; knows no protocol."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

Received = Callable[[bytes, int], None]
"""Called on the event loop with the bytes that came and the conference time [ns] at which they were read."""


class TransportError(Exception):
    """A port cannot be opened, or was lost; one line for a person."""


class Transport(Protocol):
    """An open connection to a device."""

    def write(self, data: bytes) -> None:
        """Send. Raises TransportError."""
        ...

    def set_baud(self, baud: int) -> None:
        """Change the line's speed, where there is one."""
        ...

    def close(self) -> None:
        """Let the device go; nothing is received any more."""
        ...


OpenTransport = Callable[[Received, Callable[[str], None]], Transport]
"""(received, lost) -> an open transport; `lost(reason)` is called once when the device goes. Raises TransportError."""


class ThreadTransport(ABC):
    """A device that only talks, read on a thread; what is written to it goes nowhere."""

    def __init__(self, name: str, received: Received, lost: Callable[[str], None]) -> None:
        """name: of the thread."""
        self._received, self._lost = received, lost
        self._loop = asyncio.get_running_loop()
        self._closed = threading.Event()
        threading.Thread(target=self._read, name=name, daemon=True).start()

    def write(self, data: bytes) -> None:
        """See `Transport.write`."""
        del data

    def set_baud(self, baud: int) -> None:
        """See `Transport.set_baud`."""
        del baud

    def close(self) -> None:
        """See `Transport.close`."""
        # The thread may be waiting in a read, which ends by itself; it lets the device go.
        self._closed.set()

    @abstractmethod
    def _read(self) -> None:
        """On the thread, until `_closed` is set."""

    def _later(self, call: Callable[..., None], *arguments: object) -> None:
        """Call on the event loop, unless this was closed meanwhile."""
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._unless_closed, call, *arguments)

    def _unless_closed(self, call: Callable[..., None], *arguments: object) -> None:
        if not self._closed.is_set():
            call(*arguments)
