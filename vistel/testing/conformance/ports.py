"""Opens what a device is given as: a serial port, host:port, an object of a module, or something that opens a line."""

import importlib
import os
import re
import select
import socket
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

import serial

from vistel.testing.conformance.line import Line, LineError

T = TypeVar("T")
_CONNECT_S = 5.0
"""A server takes a connection within this time [s]."""
_MOST = 4096
"""Read at once [bytes]."""
_HOST = re.compile(r"(?:[^@/]+@)?([\w.-]+|\[[\da-fA-F:]+\]):(\d{1,5})")
_OBJECT = re.compile(r"([A-Za-z_][\w.]*):([A-Za-z_]\w*)")


class SerialLine(Line):
    """A serial port, or a pseudo-terminal."""

    def __init__(self, path: str, baud: int) -> None:
        try:
            self._serial = serial.Serial(path, baud, write_timeout=_CONNECT_S)
        except (serial.SerialException, OSError, ValueError) as e:
            reason = os.strerror(e.errno) if isinstance(e, OSError) and e.errno else str(e)
            raise LineError(f"{path}: cannot be opened: {reason}") from e
        self._path = path

    def write(self, data: bytes) -> None:
        """See `Line`."""
        try:
            self._serial.write(data)
        except (serial.SerialException, OSError) as e:
            raise LineError(f"{self._path}: unplugged, or takes no more bytes") from e

    def read(self, within_s: float) -> bytes:
        """See `Line`."""
        try:
            self._serial.timeout = within_s
            data = self._serial.read(1)
            return data + self._serial.read(self._serial.in_waiting) if data else b""
        except (serial.SerialException, OSError, TypeError) as e:
            raise LineError(f"{self._path}: unplugged") from e

    def set_baud(self, baud: int) -> None:
        """See `Line`."""
        try:
            self._serial.baudrate = baud
        except (serial.SerialException, OSError, ValueError) as e:
            raise LineError(f"{self._path}: does not run at {baud} baud") from e

    def close(self) -> None:
        """See `Line`."""
        self._serial.close()


class TcpLine(Line):
    """A TCP connection."""

    def __init__(self, host: str, port: int) -> None:
        self._where = f"{host}:{port}"
        try:
            self._socket = socket.create_connection((host.strip("[]"), port), _CONNECT_S)
        except OSError as e:
            raise LineError(f"{self._where}: cannot be reached: {e.strerror or e}") from e
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def write(self, data: bytes) -> None:
        """See `Line`."""
        try:
            self._socket.sendall(data)
        except OSError as e:
            raise LineError(f"{self._where}: the connection was closed") from e

    def read(self, within_s: float) -> bytes:
        """See `Line`."""
        try:
            if not select.select([self._socket], [], [], within_s)[0]:
                return b""
            data = self._socket.recv(_MOST)
        except OSError:
            data = b""
        if not data:
            raise LineError(f"{self._where}: the connection was closed")
        return data

    def close(self) -> None:
        """See `Line`."""
        self._socket.close()


def opener(device: "str | Path | Callable[[], Line]", baud: int) -> Callable[[], Line]:
    """How a line to `device` is opened: a serial port ("/dev/ttyUSB0"), "host:port" (before it "NAME@", for a device of a server),
    "module:object" for a class or function without arguments that gives a `Line`, or such a thing itself.

    baud: of a serial port. Raises LineError for what is none of them."""
    if callable(device):
        return partial(_opened, device)
    text = str(device)
    if found := _HOST.fullmatch(text):
        host, port = found[1], int(found[2])
        return lambda: TcpLine(host, port)
    if (found := _OBJECT.fullmatch(text)) and not Path(text).exists():
        return _object(found[1], found[2])
    return lambda: SerialLine(text, baud)


def _opened(device: Callable[[], T]) -> T:
    """The line that somebody else's code opens."""
    try:
        return device()
    except OSError as e:
        raise LineError(f"{e.filename or 'the device'}: cannot be opened: {e.strerror or e}") from e


def _object(module: str, name: str) -> Callable[[], Line]:
    try:
        found = getattr(importlib.import_module(module), name, None)
    except ImportError as e:
        raise LineError(f"{module}:{name}: cannot be imported: {e}") from e
    if not callable(found):
        raise LineError(f"{module}:{name}: is no class or function that gives a line")

    def opened() -> Line:
        line = _opened(found)
        if not isinstance(line, Line):
            raise LineError(f"{module}:{name}: gave a {type(line).__name__}, expected a vistel.testing.conformance.Line")
        return line

    return opened
