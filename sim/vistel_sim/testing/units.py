"""Simulated units as a test sees them: where they are found, the truth behind their bytes, faults."""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from vistel.arrays import F64
from vistel.wire.clock import Clock
from vistel_sim import rotations
from vistel_sim.device import SimulatedDevice, Simulator
from vistel_sim.faults import Fault, Kind
from vistel_sim.phone import SimulatedSender
from vistel_sim.testing.device_thread import DeviceThread
from vistel_sim.testing.waiting import wait_until
from vistel_sim.vrpn_server import SimulatedVrpn

_KEPT = 20_000
"""Reads and writes of a port that are kept for the report of a test that fails."""
Pose = tuple[F64, F64]
"""Position [m] and quaternion (x, y, z, w), in the transmitter's frame."""


class FaultyDevice(Simulator, Protocol):
    """A simulator whose faults can be replaced while it runs."""

    def set_faults(self, *faults: Fault) -> None:
        """Replace the faults."""
        ...


D = TypeVar("D", bound=FaultyDevice)
T = TypeVar("T")


class Unit(ABC, Generic[D, T]):
    """A device that runs from the construction until `end`. truth: t [s] -> what is measured then, without noise."""

    def __init__(self, device: D, clock: Clock, start_ns: int, truth: Callable[[float], T]) -> None:
        self.name = device.name
        self.truth = truth
        self._device = device
        self._clock, self._start_ns = clock, start_ns
        self._faults: tuple[Fault, ...] = ()
        self._events: list[tuple[float, str]] = []
        # Compiles what measuring takes, so that the device answers as soon as it can be reached.
        truth(self.now_s())
        rotations.warm_up()
        self._thread = DeviceThread(device.name, device.run())

    @property
    @abstractmethod
    def plugged(self) -> bool:
        """Whether it can be reached."""

    def now_s(self) -> float:
        """Time since the device's start [s], as `truth` takes it."""
        return (self._clock.now_ns() - self._start_ns) * 1e-9

    def wait_until_plugged(self, *, within_s: float = 30.0) -> None:
        """Return when it can be reached. Fails the test after `within_s` [s]."""
        self._wait(lambda: self.plugged, f"{self.name} to be plugged in", within_s)

    def end(self) -> None:
        """Stop the device; its port vanishes. Raises RuntimeError when it failed before."""
        self._thread.end()

    def log(self) -> list[str]:
        """What happened to it, a line each, with the time since its start [s]; kept when a test fails."""
        return [f"{t_s:12.6f} {what}" for t_s, what in self._events]

    @contextmanager
    def unplugged(self, *, within_s: float = 30.0) -> Iterator[None]:
        """Within the block the device cannot be reached; after it, it can be again. within_s: the most that each may take [s]."""
        with self._struck("unplug"):
            self._wait(lambda: not self.plugged, f"{self.name} to be unplugged", within_s)
            yield
        self.wait_until_plugged(within_s=within_s)

    def stalled(self) -> AbstractContextManager[None]:
        """Within the block the device sends and answers nothing."""
        return self._struck("stall")

    def garbled(self) -> AbstractContextManager[None]:
        """Within the block random bytes come before every record."""
        return self._struck("garbage")

    def cut(self) -> AbstractContextManager[None]:
        """Within the block every record loses its beginning or its end."""
        return self._struck("cut")

    def _wait(self, condition: Callable[[], object], what: str, within_s: float) -> None:
        def holds() -> object:
            self._thread.check()
            return condition()

        wait_until(holds, what, within_s=within_s)

    @contextmanager
    def _struck(self, kind: Kind) -> Iterator[None]:
        fault = Fault(self.name, kind, self.now_s(), float("inf"))
        self._set((*self._faults, fault))
        self._events.append((self.now_s(), f"{kind} begins"))
        try:
            yield
        finally:
            self._events.append((self.now_s(), f"{kind} ends"))
            self._set(tuple(f for f in self._faults if f is not fault))

    def _set(self, faults: tuple[Fault, ...]) -> None:
        self._faults = faults
        self._device.set_faults(*faults)


class SerialUnit(Unit[SimulatedDevice, T]):
    """A device on a pseudo-terminal."""

    def __init__(self, device: SimulatedDevice, clock: Clock, start_ns: int, truth: Callable[[float], T]) -> None:
        self._traffic: deque[tuple[float, str, bytes]] = deque(maxlen=_KEPT)
        device.port.tap = lambda way, data: self._traffic.append((self.now_s(), way, data))
        super().__init__(device, clock, start_ns, truth)

    @property
    def path(self) -> Path:
        """The serial port: open it like /dev/ttyUSB0."""
        return self._device.port.path

    @property
    def plugged(self) -> bool:
        return self._device.port.plugged and self.path.exists()

    def log(self) -> list[str]:
        """See `Unit.log`: what crossed the port; "<" is what the program sent, ">" what the device did."""
        return [*super().log(), *(f"{t_s:12.6f} {way} {data.hex(' ')}  {_printable(data)}" for t_s, way, data in self._traffic)]

    def drifting(self) -> AbstractContextManager[None]:
        """Within the block measurements change slowly."""
        return self._struck("drift")

    def saturated(self) -> AbstractContextManager[None]:
        """Within the block receivers report error `j`, glove sensors their limit."""
        return self._struck("saturation")

    def wrong_baud(self) -> AbstractContextManager[None]:
        """Within the block the line runs at 9600 baud and is understood at no other speed."""
        return self._struck("baud")


class VrpnUnit(Unit[SimulatedVrpn, T]):
    """A VRPN server on 127.0.0.1. After it was unplugged its port may be another."""

    def __init__(
        self, device: SimulatedVrpn, clock: Clock, start_ns: int, truth: Callable[[float], T], announce: Path, called: str
    ) -> None:
        self._announce = announce
        self._called = called
        super().__init__(device, clock, start_ns, truth)

    @property
    def plugged(self) -> bool:
        return self._announce.exists()

    @property
    def address(self) -> str:
        """As VRPN writes it: DEVICE@127.0.0.1:PORT. Raises FileNotFoundError while it is unplugged."""
        return f"{self._called}@127.0.0.1:{self._announce.read_text()}"


class PhoneUnit(Unit[SimulatedSender, T]):
    """A phone that sends Live Link Face by UDP to whoever listens at `address`."""

    def __init__(
        self, device: SimulatedSender, clock: Clock, start_ns: int, truth: Callable[[float], T], announce: Path, port: int
    ) -> None:
        self._announce = announce
        self.send_to(port)
        super().__init__(device, clock, start_ns, truth)

    @property
    def plugged(self) -> bool:
        return not any(f.kind == "unplug" for f in self._faults)

    @property
    def address(self) -> tuple[str, int]:
        """Host and UDP port to which the phone sends: bind a socket there."""
        return "127.0.0.1", int(self._announce.read_text())

    def send_to(self, port: int) -> None:
        """From now on send to this port of 127.0.0.1."""
        self._announce.parent.mkdir(parents=True, exist_ok=True)
        new = self._announce.with_name(f".{self._announce.name}.new")
        new.write_text(str(port))
        new.replace(self._announce)


def _printable(data: bytes) -> str:
    return "".join(chr(c) if 32 <= c < 127 else "." for c in data)
