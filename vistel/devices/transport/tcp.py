"""A device behind a TCP connection to a server."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import socket
from collections.abc import Callable
from pathlib import Path

from vistel.devices.transport import OpenTransport, Received, TransportError
from vistel.wire.clock import Clock

_LONGEST = 65_536
_MOST_WAITING = 65_536


class TcpTransport:
    """Connects without holding up the event loop; what is written before it is connected is sent then."""

    def __init__(self, host: str, port: int, clock: Clock, received: Received, lost: Callable[[str], None]) -> None:
        self._where = f"{host}:{port}"
        self._clock, self._received, self._lost = clock, received, lost
        self._waiting = bytearray()
        self._connected = False
        try:
            kind, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
            self._socket = socket.socket(kind, socket.SOCK_STREAM)
        except OSError as e:
            raise TransportError(f"{self._where}: no such host: {e.strerror}") from e
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        state = self._socket.connect_ex(address)
        if state not in (0, errno.EINPROGRESS):
            self._socket.close()
            raise TransportError(f"{self._where}: {os.strerror(state)}; is the server running?")
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._socket.fileno(), self._readable)
        self._loop.add_writer(self._socket.fileno(), self._writable)

    def write(self, data: bytes) -> None:
        """See `Transport.write`."""
        if self._socket.fileno() < 0:
            raise TransportError(f"{self._where}: the connection is gone")
        if len(self._waiting) + len(data) > _MOST_WAITING:
            raise TransportError(f"{self._where}: takes no more bytes")
        self._waiting += data
        if self._connected:
            self._writable()

    def set_baud(self, baud: int) -> None:
        """See `Transport.set_baud`."""
        pass

    def close(self) -> None:
        """See `Transport.close`."""
        if self._socket.fileno() >= 0:
            self._loop.remove_reader(self._socket.fileno())
            self._loop.remove_writer(self._socket.fileno())
            self._socket.close()

    def _writable(self) -> None:
        if self._socket.fileno() < 0:
            return
        if not self._connected:
            state = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            if state:
                self._end(os.strerror(state))
                return
            self._connected = True
        try:
            sent = self._socket.send(self._waiting) if self._waiting else 0
        except BlockingIOError:
            sent = 0
        except OSError as e:
            self._end(e.strerror or "cannot be written")
            return
        del self._waiting[:sent]
        if self._waiting:
            self._loop.add_writer(self._socket.fileno(), self._writable)
        else:
            self._loop.remove_writer(self._socket.fileno())

    def _readable(self) -> None:
        try:
            data = self._socket.recv(_LONGEST)
        except BlockingIOError:
            return
        except OSError as e:
            self._end(e.strerror or "cannot be read")
            return
        if data:
            self._received(data, self._clock.now_ns())
        else:
            self._end("the server closed the connection")

    def _end(self, why: str) -> None:
        self.close()
        self._lost(f"{self._where}: {why}" + ("" if self._connected else "; is the server running?"))


def open_tcp(host: str, port: int, clock: Clock, announced: Path | None = None) -> OpenTransport:
    """How a driver connects. `announced`: file in which a simulated server of this machine has written its port."""

    def opened(received: Received, lost: Callable[[str], None]) -> TcpTransport:
        at = port
        if announced is not None:
            with contextlib.suppress(OSError, ValueError):
                at = int(announced.read_text())
        if not at:
            raise TransportError(f"{host}: the simulated server is not there yet")
        return TcpTransport(host, at, clock, received, lost)

    return opened
