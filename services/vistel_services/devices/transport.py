"""Carries bytes between a driver and its device; knows no protocol."""

from __future__ import annotations

import asyncio
import contextlib
import os
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

import serial

from vistel.wire.clock import Clock

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

    def close(self) -> None: ...


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
        del data

    def set_baud(self, baud: int) -> None:
        del baud

    def close(self) -> None:
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


class SerialTransport:
    """A serial port, read on the event loop as soon as bytes are there."""

    def __init__(self, port: str, baud: int, clock: Clock, received: Received, lost: Callable[[str], None]) -> None:
        try:
            self._serial = serial.Serial(port, baud, timeout=0, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as e:
            raise TransportError(_why_not(port, e)) from e
        # Adapters hold bytes back for up to 16 ms by default; a pseudo-terminal has no such setting.
        with contextlib.suppress(OSError, ValueError, NotImplementedError, AttributeError):
            self._serial.set_low_latency_mode(True)
        self._port = port
        self._fd = self._serial.fileno()
        self._clock, self._received, self._lost = clock, received, lost
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._fd, self._readable)

    def write(self, data: bytes) -> None:
        # Not through pyserial, which waits for as long as the line takes; commands are shorter than any buffer.
        try:
            sent = os.write(self._fd, data)
        except OSError as e:
            raise TransportError(f"{self._port}: cannot be written: {e.strerror}") from e
        if sent < len(data):
            raise TransportError(f"{self._port}: takes no more bytes; is the device switched on?")

    def set_baud(self, baud: int) -> None:
        try:
            self._serial.baudrate = baud
        except (serial.SerialException, OSError, ValueError) as e:
            raise TransportError(f"{self._port}: does not run at {baud} baud: {e}") from e

    def close(self) -> None:
        self._loop.remove_reader(self._fd)
        with contextlib.suppress(OSError):
            self._serial.close()

    def _readable(self) -> None:
        try:
            data = os.read(self._fd, 4096)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            self._received(data, self._clock.now_ns())
            return
        self._loop.remove_reader(self._fd)  # ready to read, nothing there: the device was unplugged
        self._lost(f"{self._port}: unplugged")


def open_serial(port: str, baud: int, clock: Clock) -> OpenTransport:
    """How a driver opens (and opens again) its serial port."""
    return lambda received, lost: SerialTransport(port, baud, clock, received, lost)


def _why_not(port: str, error: Exception) -> str:
    number = getattr(error, "errno", None)
    known = {
        2: "is not there; plug the device in",
        13: "may not be opened; add yourself to its group (dialout)",
        16: "is in use by another program",
        11: "is in use by another program",
    }
    return f"{port}: {known.get(number or 0, str(error))}"
