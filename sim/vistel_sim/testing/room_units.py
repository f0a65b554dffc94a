"""Simulated units that are no trackers and no gloves: cameras of a helmet, a microphone, an audio delay unit."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from vistel.arrays import F32, F64
from vistel.wire.clock import Clock
from vistel_sim.equipment.delay_unit import SimulatedDelayUnit
from vistel_sim.faults import Fault
from vistel_sim.microphone import SimulatedMicrophone, run_microphones
from vistel_sim.pictures.camera import SimulatedCamera
from vistel_sim.testing.units import Unit

T = TypeVar("T")


class CameraUnit(Unit[SimulatedCamera, T], Generic[T]):
    """A camera on the network that streams JPEG pictures over HTTP. After it was unplugged it may be at another port."""

    def __init__(self, device: SimulatedCamera, clock: Clock, start_ns: int, truth: Callable[[float], T], announce: Path) -> None:
        self._announce = announce
        super().__init__(device, clock, start_ns, truth)

    @property
    def plugged(self) -> bool:
        return self._announce.exists()

    @property
    def address(self) -> str:
        """http://127.0.0.1:PORT/video.mjpg. Raises FileNotFoundError while it is unplugged."""
        return self._announce.read_text()

    def frozen(self) -> AbstractContextManager[None]:
        """Within the block it sends the same picture again and again."""
        return self._struck("freeze")

    def dark(self) -> AbstractContextManager[None]:
        """Within the block its pictures are black."""
        return self._struck("black")

    def saturated(self) -> AbstractContextManager[None]:
        """Within the block its pictures are far too bright."""
        return self._struck("saturation")

    def drifting(self) -> AbstractContextManager[None]:
        """Within the block its mount slips and the light changes."""
        return self._struck("drift")


@dataclass(frozen=True)
class Helmet:
    """The cameras on a person's helmet. face: its truth, t [s] -> 13 marks (x, y) [m]; eye: t [s] -> gaze, yaw (left positive) and
    pitch (up positive) [rad]."""

    face: CameraUnit[F64]
    eye: CameraUnit[F64]


class _RunningMicrophone:
    """A microphone that runs by itself."""

    def __init__(self, microphone: SimulatedMicrophone, clock: Clock, start_ns: int) -> None:
        self.name = microphone.name
        self._microphone, self._clock, self._start_ns = microphone, clock, start_ns

    def set_faults(self, *faults: Fault) -> None:
        self._microphone.set_faults(*faults)

    async def run(self) -> None:
        await run_microphones((self._microphone,), self._clock, self._start_ns)


class MicrophoneUnit(Unit[_RunningMicrophone, F32]):
    """A microphone: a named pipe with 16-bit samples, mono, 48 kHz. Its truth: t [s] -> the 960 samples of that 20 ms, -1 to 1."""

    def __init__(
        self, microphone: SimulatedMicrophone, clock: Clock, start_ns: int, truth: Callable[[float], F32], path: Path
    ) -> None:
        self.path = path
        """The pipe: read it like a file."""
        super().__init__(_RunningMicrophone(microphone, clock, start_ns), clock, start_ns, truth)

    @property
    def plugged(self) -> bool:
        return self.path.exists()

    def cut(self) -> AbstractContextManager[None]:
        """Raises ValueError: sound has no records that could be cut."""
        raise ValueError(f"{self.name}: sound has no records that could be cut; `stalled` leaves samples out")

    def muted(self) -> AbstractContextManager[None]:
        """Within the block it sends silence."""
        return self._struck("black")

    def saturated(self) -> AbstractContextManager[None]:
        """Within the block it is over-driven."""
        return self._struck("saturation")


class DelayUnit(Unit[SimulatedDelayUnit, list[float]]):
    """An audio delay unit on Modbus, by TCP or on a serial line. After it was unplugged it is at its defaults, and maybe at another
    port."""

    def __init__(self, device: SimulatedDelayUnit, clock: Clock, start_ns: int, announce: Path) -> None:
        self._announce = announce
        super().__init__(device, clock, start_ns, lambda t_s: device.delays_s)

    @property
    def plugged(self) -> bool:
        return self._announce.exists()

    @property
    def address(self) -> str:
        """HOST:PORT, or the path of its serial port. Raises FileNotFoundError while it is unplugged."""
        return self._announce.read_text().partition(":")[2]

    def heard(self, channel: int, samples: F32) -> F32:
        """What comes out of a channel (from 1) for (n,) samples at 48 kHz."""
        return self._device.process(channel - 1, samples)
