"""What the simulators of a conference share: motion, clock, faults, paths of ports."""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from vistel.arrays import F64
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.posture.posture import Posture
from vistel.wire.clock import Clock
from vistel_sim.device import Instrument, MakePort, SimulatedDevice
from vistel_sim.faults import Fault
from vistel_sim.motion.source import AVERAGE
from vistel_sim.ports.pty_port import PtyPort

RESTART_S = 0.3
"""How long simulated units take to restart [s]. Real ones take longer (a FASTRAK 10 s, a CyberGlove 1.75 s); the protocol is the
same."""


class BodyMotion(Protocol):
    """What the devices need of a motion source (`vistel_sim.motion.MotionSource` has more)."""

    def posture(self, participant: str, t_s: float) -> Posture:
        """The participant's true posture."""
        ...

    def receivers(self, participant: str, t_s: float) -> dict[str, tuple[F64, F64]]:
        """By role: position [m] and quaternion (x, y, z, w) in the participant's transmitter frame."""
        ...

    def hand_angles(self, participant: str, t_s: float) -> F64:
        """(2, 20) radians, left hand first."""
        ...

    def speaking(self, participant: str, t_s: float) -> float:
        """Loudness of the participant's voice, 0 to 1."""
        ...

    def things(self, t_s: float) -> dict[str, tuple[F64, F64]]:
        """Poses of the things that the motion moves, by id: position [m], quaternion (x, y, z, w), room frame."""
        ...


@dataclass(frozen=True)
class Simulation:
    """start_ns: conference time at which the motion and the times of `faults` begin; limbs: of participants who are no average
    person of their height; port: makes the ports of serial devices."""

    conference: Conference
    motion: BodyMotion
    paths: RunPaths
    clock: Clock
    start_ns: int
    faults: tuple[Fault, ...] = ()
    limbs: Mapping[str, Proportions] = field(default_factory=lambda: AVERAGE)
    port: MakePort = PtyPort

    def seed(self, name: str) -> int:
        """Seed for the noise of a device."""
        return device_seed(self.conference.seed, name)

    def link(self, name: str) -> Path:
        """The file through which a simulated device is found."""
        return self.paths.device(name)

    def at_port(self, name: str, instrument: Instrument, baud: int) -> SimulatedDevice:
        """A device on a simulated serial port."""
        link, seed = self.link(name), self.seed(name)
        return SimulatedDevice(name, instrument, link, self.clock, self.start_ns, self.faults, baud=baud, seed=seed, port=self.port)


def device_seed(seed: int, name: str) -> int:
    """Seed for the noise of a device, from that of its conference."""
    return zlib.crc32(f"{seed}/{name}".encode())
