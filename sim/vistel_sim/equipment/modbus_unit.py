"""What simulated equipment on Modbus has in common: a server on TCP or a serial line, and faults."""

import asyncio
import contextlib
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pymodbus import FramerType, ModbusDeviceIdentification
from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from vistel.wire.clock import Clock
from vistel_sim.faults import DeviceFaults, Fault
from vistel_sim.pty_port import PtyPort

COILS = 1
"""Function code that reads coils."""
DISCRETE = 2
"""Function code that reads discrete inputs."""
HOLDING = 3
"""Function code that reads holding registers."""
INPUT = 4
"""Function code that reads input registers."""
_TICK_S = 0.05
"""Time between two changes of what the unit measures [s]."""
_WRITES_BITS = (5, 15)
"""Function codes that write coils."""


@dataclass
class Tables:
    """The values of the unit's registers."""

    coils: list[bool] = field(default_factory=lambda: [False] * 16)
    discrete: list[bool] = field(default_factory=lambda: [False] * 16)
    holding: list[int] = field(default_factory=lambda: [0] * 64)
    inputs: list[int] = field(default_factory=lambda: [0] * 64)


class SimulatedUnit(ABC):
    """Serves until cancelled. `path` has its address while it is plugged in. baud: of its serial line; 0: on TCP.

    Faults: stall (it no longer answers), garbage (every request is refused with exception 4), cut (busy: exception 6),
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
        self._server: ModbusTcpServer | ModbusSerialServer | None = None
        self._line: tuple[PtyPort, PtyPort] | None = None

    def set_faults(self, *faults: Fault) -> None:
        """Replace the faults; none: no faults."""
        self._faults.replace(faults)

    async def run(self) -> None:
        """Runs until cancelled."""
        try:
            while True:
                if self._faults.active("unplug", self.t_s):
                    await self._unplug()
                elif self._server is None:
                    await self._plug()
                await self._tick()
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
    def refusal(self, table: int, address: int, values: Sequence[int | bool]) -> ExcCodes | None:
        """The exception for a write to coils or holding registers; None: accepted."""

    @abstractmethod
    def tick(self) -> None:
        """Update discrete inputs and input registers."""

    def written(self) -> None:  # noqa: B027  few units need it
        """Called after an accepted write."""

    async def _tick(self) -> None:
        self.tick()
        if self._server is not None:
            await self._server.async_setValues(self._id, INPUT, 0, list(self.tables.inputs))
            await self._server.async_setValues(self._id, DISCRETE, 0, list(self.tables.discrete))

    async def _plug(self) -> None:
        self.tables = Tables()
        self.reset()
        t = self.tables
        coils, discrete = ([SimData(0, values=list(v), datatype=DataType.BITS)] for v in (t.coils, t.discrete))
        holding, inputs = ([SimData(0, values=list(v), datatype=DataType.REGISTERS)] for v in (t.holding, t.inputs))
        device = SimDevice(id=self._id, simdata=(coils, discrete, holding, inputs), action=self._on_request)
        about = ModbusDeviceIdentification(
            info_name={"VendorName": "VISTEL", "ProductCode": self.product, "MajorMinorRevision": "1.0"}
        )
        self._path.parent.mkdir(parents=True, exist_ok=True)
        address = await (self._serve_line(device, about) if self._baud else self._serve_tcp(device, about))
        new = self._path.with_name(f".{self._path.name}.new")
        new.write_text(address)
        new.replace(self._path)

    async def _serve_tcp(self, device: SimDevice, about: ModbusDeviceIdentification) -> str:
        self._server = ModbusTcpServer(device, address=("127.0.0.1", 0), identity=about)
        await self._server.serve_forever(background=True)
        listening: Any = self._server.transport
        return f"tcp:127.0.0.1:{listening.sockets[0].getsockname()[1]}"

    async def _serve_line(self, device: SimDevice, about: ModbusDeviceIdentification) -> str:
        """Two pseudo-terminals, joined at the line's speed."""
        ends = [self._path.with_name(f"{self._path.name}.{end}") for end in ("line", "unit")]

        def to_unit(data: bytes) -> None:
            ours.answer(data)

        theirs = PtyPort(ends[0], self._clock, to_unit, self._baud)
        ours = PtyPort(ends[1], self._clock, theirs.answer, self._baud)
        self._line = theirs, ours
        for port in self._line:
            port.plug()
        self._server = ModbusSerialServer(
            device, framer=FramerType.RTU, port=str(ends[1]), baudrate=self._baud, identity=about, reconnect_delay=0
        )
        await self._server.serve_forever(background=True)
        return f"rtu:{ends[0]}"

    async def _unplug(self) -> None:
        if self._server is None:
            return
        self._path.unlink(missing_ok=True)
        server, self._server = self._server, None
        with contextlib.suppress(asyncio.CancelledError):
            await server.shutdown()
        for port in self._line or ():
            port.unplug()
        self._line = None

    async def _on_request(
        self, function: int, base: int, address: int, count: int, registers: list[int], values: list[int] | list[bool] | None
    ) -> ExcCodes | None:
        """Called before a request is answered; for a write with the values, and again without them. Also called for the
        unit's own updates."""
        if function in (DISCRETE, INPUT) and values is not None:
            return None
        while self._faults.active("stall", self.t_s):
            await asyncio.sleep(_TICK_S)
        if self._faults.active("garbage", self.t_s):
            return ExcCodes.DEVICE_FAILURE
        if self._faults.active("cut", self.t_s):
            return ExcCodes.DEVICE_BUSY
        if values is None:
            return None
        table = COILS if function in _WRITES_BITS else HOLDING
        refused = self.refusal(table, address, values)
        if refused is not None:
            return refused
        for i, value in enumerate(values):
            if table == COILS:
                self.tables.coils[address + i] = bool(value)
            else:
                self.tables.holding[address + i] = int(value)
        self.written()
        return None
