"""What simulated serial devices have in common: a port, faults, a measuring period."""

import asyncio
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from vistel.wire.clock import Clock
from vistel_sim.faults import DeviceFaults, Fault
from vistel_sim.ports.port import SimulatedPort
from vistel_sim.ports.pty_port import PtyPort

_LATE_NS = 50_000_000
"""A machine that is later than this skips measurements instead of sending old ones as new [ns]."""
_WRONG_BAUD = 9600


@dataclass(frozen=True)
class Reply:
    """Bytes for the host, `delay_s` from now. baud: new speed of the line; 0: unchanged. measured: they are a measurement, which
    faults damage."""

    data: bytes
    delay_s: float = 0.0
    baud: int = 0
    measured: bool = False


class Instrument(Protocol):
    """The device behind the port: bytes in, bytes out; no port and no clock."""

    def receive(self, data: bytes, t_s: float) -> list[Reply]:
        """Take bytes from the host at `t_s`; returns the replies."""
        ...

    @property
    def period_s(self) -> float:
        """Time between two measurements [s]."""
        ...

    @property
    def latency_s(self) -> float:
        """Time from a measurement to its first byte [s]."""
        ...

    def next_length(self) -> int:
        """Bytes of the next measurement; 0 if none is due."""
        ...

    def disturb(self, drifting_s: float, saturated: bool) -> None:
        """Set drift (for `drifting_s` so far, 0: none) and saturation."""
        ...

    def measure(self, t_s: float) -> bytes:
        """The bytes of the measurement at `t_s`, if it is sent."""
        ...


class Simulator(Protocol):
    name: str

    async def run(self) -> None:
        """Until cancelled."""
        ...


class MakePort(Protocol):
    """Makes the port of a device; see `SimulatedPort`."""

    def __call__(
        self, path: Path, clock: Clock, received: Callable[[bytes], None], baud: int = 115200, *, strict: bool = False
    ) -> SimulatedPort: ...


class SimulatedDevice:
    """Runs an instrument at a port."""

    def __init__(
        self,
        name: str,
        instrument: Instrument,
        path: Path,
        clock: Clock,
        start_ns: int,
        faults: Iterable[Fault] = (),
        *,
        baud: int = 115200,
        seed: int = 0,
        strict_speed: bool = False,
        port: MakePort = PtyPort,
    ) -> None:
        """`start_ns`: the clock's time at which the motion and the script of faults begin.

        strict_speed: a client must have set `baud`; otherwise any speed is understood. port: makes its port.
        """
        self.name = name
        self.port = port(path, clock, self._received, baud, strict=strict_speed)
        self._line = baud, strict_speed
        self._wrong_speed = False
        self._instrument = instrument
        self._clock = clock
        self._start_ns = start_ns
        self._faults = DeviceFaults(faults, name, np.random.default_rng(seed))

    def set_faults(self, *faults: Fault) -> None:
        """Replace the faults; those of other devices are ignored."""
        self._faults.replace(faults)

    async def run(self) -> None:
        """Until cancelled; the port vanishes then."""
        clock, port, instrument = self._clock, self.port, self._instrument
        port.plug()
        tick_ns = clock.now_ns()
        try:
            while True:
                tick_ns += round(instrument.period_s * 1e9)
                if clock.now_ns() - tick_ns > _LATE_NS:
                    tick_ns = clock.now_ns()
                t_s = (tick_ns - self._start_ns) * 1e-9
                self._plug_or_unplug(t_s)
                self._set_speed(t_s)
                length = instrument.next_length()
                if not length or not port.plugged or self._faults.active("stall", t_s):
                    await clock.sleep_until_ns(tick_ns)
                    continue
                await clock.sleep_until_ns(port.reserve(length, tick_ns + round(instrument.latency_s * 1e9)))
                if instrument.next_length() == length:  # not stopped meanwhile
                    self._disturb(t_s)
                    if data := instrument.measure(t_s):
                        port.put(self._faults.damage(data, t_s))
        finally:
            port.unplug()

    def _disturb(self, t_s: float) -> None:
        self._instrument.disturb(self._faults.progress("drift", t_s), self._faults.active("saturation", t_s))

    def _plug_or_unplug(self, t_s: float) -> None:
        if self._faults.active("unplug", t_s):
            self.port.unplug()
        else:
            self.port.plug()

    def _set_speed(self, t_s: float) -> None:
        if self._faults.active("baud", t_s) == self._wrong_speed:
            return
        self._wrong_speed = not self._wrong_speed
        self.port.baud, self.port.strict = (_WRONG_BAUD, True) if self._wrong_speed else self._line

    def _received(self, data: bytes) -> None:
        t_s = (self._clock.now_ns() - self._start_ns) * 1e-9
        if self._faults.active("stall", t_s):
            return
        self._disturb(t_s)
        for reply in self._instrument.receive(data, t_s):
            if reply.data:
                self.port.answer(self._faults.damage(reply.data, t_s) if reply.measured else reply.data, reply.delay_s)
            if reply.baud:
                self.port.baud = reply.baud


async def run_devices(devices: Iterable[Simulator]) -> None:
    """Run all until cancelled."""
    devices = tuple(devices)
    for device in devices:
        if isinstance(device, SimulatedDevice):
            # A link that a killed process left may point to another device's terminal by now.
            device.port.path.unlink(missing_ok=True)
    async with asyncio.TaskGroup() as group:
        for device in devices:
            group.create_task(device.run(), name=device.name)
