"""Connects to a VRPN server and receives the reports of one of its devices, a tracker or a glove."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Protocol

from vistel.devices.transport import OpenTransport, TransportError
from vistel.devices.transport.tcp import open_tcp
from vistel.protocol import vrpn
from vistel.protocol.vrpn import VrpnParser, parse_address
from vistel.wire.clock import Clock
from vistel.wire.topics import Topic
from vistel_services.devices.device import Decoder, DeviceError, Link, NoAnswerError

_HELLO_S = 3.0
"""A server must answer the opening of a connection within this time [s]."""
_REPORT_S = 3.0
"""A device that runs must report within this time [s]."""
_GREETING_S = 0.3
"""A server has named all its devices when nothing has come for this time [s]."""
_PING_S = 0.05
"""Time between two pings to a glove, which reports changes only [s]: a glove held still gives 20 messages a second."""


class VrpnDecoder(Decoder, Protocol):
    """What reads a server's bytes."""

    parser: VrpnParser


class VrpnDriver:
    """See the module."""

    stop = b""

    def __init__(self, name: str, topic: Topic, decoder: VrpnDecoder, device: str, has: str, *, pinged: bool = False) -> None:
        """device: its name at the server. has: its sensors, for a person. pinged: it reports changes only, and is pinged so
        that its silence can be told from its absence."""
        self.name = name
        self.topic = topic
        self.decoder = decoder
        self.beat = (_PING_S, vrpn.ping()) if pinged else None
        self._device = device
        self._has = has
        self._greeted = 0

    async def start(self, link: Link) -> str:
        """See `Driver.start`."""
        if link.attached == self._greeted:
            raise TransportError(f"{self._device}: fell silent; joining the server anew")
        self._greeted = link.attached
        parser = self.decoder.parser
        parser.version = parser.refused = ""
        skipped = parser.bytes_skipped
        link.send(vrpn.hello(self._device))
        if await link.wait_for(lambda: parser.version or parser.refused or None, _HELLO_S) is None:
            if parser.bytes_skipped > skipped:
                raise DeviceError("what answers there is no VRPN server")
            raise NoAnswerError("the server does not answer")
        if parser.refused:
            raise DeviceError(f"the server speaks VRPN {parser.refused}; 07 is expected")
        seen = link.frames
        if self.beat is not None:
            link.send(self.beat[1])
        if await link.wait_for(lambda: link.frames if link.frames > seen else None, _REPORT_S) is None:
            link.send(vrpn.ping_all(parser.devices))
            await link.quiet(_GREETING_S, 2 * _GREETING_S)
            if self._device not in parser.pongs:
                there = ", ".join(sorted(parser.pongs)) or "none that answers"
                raise DeviceError(f"the server has no {self._device}; it has {there}")
            raise NoAnswerError(f"{self._device} is there and reports nothing")
        return f"{self._device} of a VRPN server {parser.version}, {self._has}"


def open_vrpn(port: str, link: Path | None) -> Callable[[Clock], OpenTransport]:
    """How the server is reached that `port` of a conference file names. link: the file that holds a simulated server's TCP port."""
    host, number = ("127.0.0.1", 0) if port == "sim" else parse_address(port)[1:]
    return partial(open_tcp, host, number, announced=link)
