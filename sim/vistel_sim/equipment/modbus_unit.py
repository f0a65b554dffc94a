"""What simulated equipment on Modbus has in common: a server on TCP or a serial line, and faults."""

import asyncio
import contextlib
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from vistel.wire.clock import Clock
from vistel_sim.equipment.modbus import COILS, DISCRETE, HOLDING, INPUT, Refusal, SerialFraming, TcpFraming, answer
from vistel_sim.faults import DeviceFaults, Fault
from vistel_sim.ports.pty_port import PtyPort

_TICK_S = 0.05
"""Time between two changes of what the unit measures [s]."""
_GAP_NS = 50_000_000
"""A silence on the serial line after which a new request begins [ns]; the 3.5 characters of the standard pass unseen here."""
_READ_MOST = 4096
"""Bytes that are read at once."""


@dataclass
class Tables:
    """The values of the unit's registers."""

    coils: list[bool] = field(default_factory=lambda: [False] * 16)
    discrete: list[bool] = field(default_factory=lambda: [False] * 16)
    holding: list[int] = field(default_factory=lambda: [0] * 64)
    inputs: list[int] = field(default_factory=lambda: [0] * 64)


class SimulatedUnit(ABC):
    """Serves until cancelled. `path` has its address while it is plugged in. baud: of its serial line; 0: on TCP.

    Faults: stall (it does not answer), garbage (every request is refused with exception 4), cut (busy: exception 6),
    unplug (the connection goes; it comes back at its defaults).
    """

    product = "SIM"

    def __init__(
        self,
        name: str,
        path: Path,
        clock: Clock,
        start_ns: int,
        faults: Iterable[Fault] = (),
        *,
        baud: int = 0,
        device_id: int = 1,
        seed: int = 0,
    ) -> None:
        self.name = name
        self.tables = Tables()
        self._path, self._clock, self._start_ns = path, clock, start_ns
        self._baud, self._id = baud, device_id
        self._faults = DeviceFaults(faults, name, np.random.default_rng(seed))
        self.identity = ("VISTEL", self.product, "1.0")
        self._server: asyncio.Server | None = None
        self._clients: set[asyncio.StreamWriter] = set()
        self._port: PtyPort | None = None

    def set_faults(self, *faults: Fault) -> None:
        """Replace the faults; none: no faults."""
        self._faults.replace(faults)

    async def run(self) -> None:
        """Runs until cancelled."""
        try:
            while True:
                if self._faults.active("unplug", self.t_s):
                    await self._unplug()
                elif self._server is None and self._port is None:
                    await self._plug()
                self.tick()
                await self._clock.sleep_until_ns(self._clock.now_ns() + round(_TICK_S * 1e9))
        finally:
            await self._unplug()

    @property
    def t_s(self) -> float:
        """Time since the start of the simulators [s]."""
        return (self._clock.now_ns() - self._start_ns) * 1e-9

    @abstractmethod
    def reset(self) -> None:
        """Set the state after power-on."""

    @abstractmethod
    def refusal(self, table: int, address: int, values: Sequence[int | bool]) -> Refusal | None:
        """The exception for a write to coils or holding registers; None: accepted."""

    @abstractmethod
    def tick(self) -> None:
        """Update discrete inputs and input registers."""

    def written(self) -> None:  # noqa: B027  few units need it
        """Called after an accepted write."""

    def table(self, function: int) -> list[bool] | list[int]:
        """See `Registers`."""
        t = self.tables
        return {COILS: t.coils, DISCRETE: t.discrete, HOLDING: t.holding, INPUT: t.inputs}[function]

    def write(self, table: int, address: int, values: Sequence[int]) -> Refusal | None:
        """See `Registers`."""
        if (refused := self.refusal(table, address, values)) is not None:
            return refused
        for i, value in enumerate(values, address):
            if table == COILS:
                self.tables.coils[i] = bool(value)
            else:
                self.tables.holding[i] = int(value)
        self.written()
        return None

    def _answer(self, request: bytes) -> bytes:
        if self._faults.active("stall", self.t_s):
            return b""
        if self._faults.active("garbage", self.t_s):
            return bytes((request[0] | 0x80, Refusal.DEVICE_FAILURE))
        if self._faults.active("cut", self.t_s):
            return bytes((request[0] | 0x80, Refusal.DEVICE_BUSY))
        return answer(self, request)

    async def _plug(self) -> None:
        self.tables = Tables()
        self.reset()
        self.tick()
        self._path.parent.mkdir(parents=True, exist_ok=True)
        address = self._serve_line() if self._baud else await self._serve_tcp()
        new = self._path.with_name(f".{self._path.name}.new")
        new.write_text(address)
        new.replace(self._path)

    async def _serve_tcp(self) -> str:
        self._server = await asyncio.start_server(self._joined, "127.0.0.1", 0)
        return f"tcp:127.0.0.1:{self._server.sockets[0].getsockname()[1]}"

    async def _joined(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._clients.add(writer)
        framing, goes_on = TcpFraming(self._id, self._answer), True
        try:
            while goes_on and (data := await reader.read(_READ_MOST)):
                out, goes_on = framing.feed(data)
                writer.write(out)
                await writer.drain()
        except ConnectionError:
            pass
        finally:
            self._clients.discard(writer)
            with contextlib.suppress(ConnectionError):
                writer.close()

    def _serve_line(self) -> str:
        framing, last_ns = SerialFraming(self._id, self._answer), 0

        def received(data: bytes) -> None:
            nonlocal last_ns
            now_ns = self._clock.now_ns()
            if now_ns - last_ns > _GAP_NS:
                framing.silence()
            last_ns = now_ns
            if out := framing.feed(data):
                port.answer(out)

        port = PtyPort(self._path.with_name(f"{self._path.name}.line"), self._clock, received, self._baud)
        port.plug()
        self._port = port
        return f"rtu:{port.path}"

    async def _unplug(self) -> None:
        if self._server is None and self._port is None:
            return
        self._path.unlink(missing_ok=True)
        if self._server is not None:
            self._server.close()
            for client in list(self._clients):
                client.close()
        if self._port is not None:
            self._port.unplug()
        self._server = self._port = None
