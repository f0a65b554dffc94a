"""A simulated device's port that a driver in the same process opens: bytes, their time on the line and unplugging as at a
pseudo-terminal, without the kernel. In simulated time it gives the same bytes at the same times in every run."""

import asyncio
from collections.abc import Callable
from pathlib import Path

from vistel.devices.transport import OpenTransport, Received, Transport, TransportError
from vistel.wire.clock import Clock
from vistel_sim.ports.port import GARBLED, SimulatedPort


class Wires:
    """The ports of one process, by the names of their devices."""

    def __init__(self) -> None:
        self._ports: dict[str, WirePort] = {}

    def port(
        self, path: Path, clock: Clock, received: Callable[[bytes], None], baud: int = 115200, *, strict: bool = False
    ) -> SimulatedPort:
        """The port of the device whose name ends `path`; see `SimulatedPort`."""
        made = self._ports[path.name] = WirePort(path, clock, received, baud, strict=strict)
        return made

    def opener(self, name: str, baud: int) -> Callable[[Clock], OpenTransport]:
        """How the driver of the device `name` opens its port, at a speed of `baud`."""

        def opened(received: Received, lost: Callable[[str], None]) -> Transport:
            port = self._ports.get(name)
            if port is None:
                raise TransportError(f"{name}: is not there; plug the device in")
            return port.open(baud, received, lost)

        return lambda _clock: opened


class WirePort(SimulatedPort):
    """One client at a time."""

    _client: "_Client | None" = None
    _plugged = False

    @property
    def plugged(self) -> bool:
        return self._plugged

    def plug(self) -> None:
        """See `SimulatedPort.plug`."""
        if not self._plugged:
            self._plugged, self._free_ns = True, 0

    def unplug(self) -> None:
        """See `SimulatedPort.unplug`."""
        if not self._plugged:
            return
        self._plugged = False
        self.discard_answers()
        client, self._client = self._client, None
        if client is not None:
            client.hang_up(f"{self.path.name}: unplugged")

    def put(self, data: bytes) -> None:
        """See `SimulatedPort.put`."""
        if not self._plugged or self._client is None:
            return
        if self.strict and self._client.baud != self.baud:
            data = data.translate(GARBLED)
        self.tap(">", data)
        self._client.hear(data)

    def open(self, baud: int, received: Received, lost: Callable[[str], None]) -> Transport:
        """The client's end. Raises TransportError where there is no port, or somebody has it open."""
        if not self._plugged:
            raise TransportError(f"{self.path.name}: is not there; plug the device in")
        if self._client is not None:
            raise TransportError(f"{self.path.name}: is in use by another program")
        self._client = _Client(self, baud, received, lost, self._clock)
        return self._client

    def close(self, client: "_Client") -> None:
        """`client` hears nothing more."""
        if self._client is client:
            self._client = None

    def take(self, data: bytes, baud: int) -> None:
        """What the client wrote at `baud`."""
        if self._plugged:
            self.tap("<", data)
            if not self.strict or baud == self.baud:
                self._received(data)


class _Client:
    """The end of the driver; see `Transport`. What crosses the line arrives with the loop's next turn, as from a kernel."""

    def __init__(self, port: WirePort, baud: int, received: Received, lost: Callable[[str], None], clock: Clock) -> None:
        self.baud = baud
        self._port, self._received, self._lost, self._clock = port, received, lost, clock
        self._loop = asyncio.get_running_loop()
        self._open = True

    def write(self, data: bytes) -> None:
        """See `Transport.write`."""
        if not self._open:
            raise TransportError(f"{self._port.path.name}: unplugged")
        self._loop.call_soon(self._port.take, data, self.baud)

    def set_baud(self, baud: int) -> None:
        """See `Transport.set_baud`."""
        self.baud = baud

    def close(self) -> None:
        """See `Transport.close`."""
        self._open = False
        self._port.close(self)

    def hear(self, data: bytes) -> None:
        """Bytes of the device."""
        self._loop.call_soon(self._if_open, lambda: self._received(data, self._clock.now_ns()))

    def hang_up(self, reason: str) -> None:
        """The port has gone."""
        self._loop.call_soon(self._if_open, lambda: self._lost(reason))

    def _if_open(self, call: Callable[[], None]) -> None:
        if self._open:
            call()
