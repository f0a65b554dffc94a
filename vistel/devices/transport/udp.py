"""Packets that phones and tracking suites send to a UDP port."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import Collection
from pathlib import Path

from vistel.devices.transport import OpenTransport, Received, TransportError
from vistel.wire.clock import Clock

log = logging.getLogger("vistel.device")

_LONGEST = 65535
_WAITING_BYTES = 1 << 20
"""Of packets that wait while other work goes on; systems may keep fewer."""
_AT_ONCE = 64
"""Packets that are read before others have their turn."""


class UdpTransport:
    """An open UDP port. It receives the packets of `senders`, or of everybody where there are none, and answers none."""

    def __init__(
        self, port: int, clock: Clock, received: Received, announce: Path | None, listen: str, senders: Collection[str]
    ) -> None:
        self._senders, self._refused = senders, False
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _WAITING_BYTES)
        self._clock, self._received = clock, received
        self._announce = announce
        try:
            self._socket.bind(("127.0.0.1" if announce else listen, port))
        except OSError as e:
            self._socket.close()
            raise TransportError(
                f"UDP port {port}: cannot be opened at {listen}: {e.strerror}; does another program use it?"
            ) from e
        if announce is not None:
            announce.parent.mkdir(parents=True, exist_ok=True)
            new = announce.with_name(f".{announce.name}.new")
            new.write_text(str(self._socket.getsockname()[1]))
            new.replace(announce)
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._socket.fileno(), self._readable)

    def write(self, data: bytes) -> None:
        """See `Transport.write`."""
        pass

    def set_baud(self, baud: int) -> None:
        """See `Transport.set_baud`."""
        pass

    def close(self) -> None:
        """See `Transport.close`."""
        self._loop.remove_reader(self._socket.fileno())
        self._socket.close()
        if self._announce is not None:
            self._announce.unlink(missing_ok=True)

    def _readable(self) -> None:
        with contextlib.suppress(OSError):
            for _ in range(_AT_ONCE):
                self._read()

    def _read(self) -> None:
        data, (sender, _) = self._socket.recvfrom(_LONGEST)
        if self._senders and sender not in self._senders:
            if not self._refused:
                self._refused = True
                log.warning("event=packets_refused port=%s sender=%s", self._socket.getsockname()[1], sender)
        elif data:
            self._received(data, self._clock.now_ns())


def open_udp(
    port: int, clock: Clock, *, listen: str = "127.0.0.1", senders: Collection[str] = (), announce: Path | None = None
) -> OpenTransport:
    """How a driver opens its port. listen: an address of this machine; senders: whose packets are received, all where it is
    empty; announce: open any free port of this machine and write its number there."""
    return lambda received, lost: UdpTransport(0 if announce else port, clock, received, announce, listen, senders)
