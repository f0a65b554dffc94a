"""Serial ports, real ones and pseudo-terminals."""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import Callable

import serial

from vistel.devices.transport import OpenTransport, Received, TransportError
from vistel.wire.clock import Clock


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
        """See `Transport.write`."""
        # Not through pyserial, which waits for as long as the line takes; commands are shorter than any buffer.
        try:
            sent = os.write(self._fd, data)
        except OSError as e:
            raise TransportError(f"{self._port}: cannot be written: {e.strerror}") from e
        if sent < len(data):
            raise TransportError(f"{self._port}: takes no more bytes; is the device switched on?")

    def set_baud(self, baud: int) -> None:
        """See `Transport.set_baud`."""
        try:
            self._serial.baudrate = baud
        except (serial.SerialException, OSError, ValueError) as e:
            raise TransportError(f"{self._port}: does not run at {baud} baud: {e}") from e

    def close(self) -> None:
        """See `Transport.close`."""
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
