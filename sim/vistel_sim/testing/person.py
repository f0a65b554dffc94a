"""One simulated person, and the units on them, each run beside a test."""

import socket
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from vistel.arrays import F64
from vistel.conference import device_names
from vistel.conference.devices import FaceConfig, TrackerConfig
from vistel.conference.model import Conference, Participant, Site
from vistel.conference.paths import RunPaths
from vistel.figure.posture.posture import Posture
from vistel.protocol.live_link_face import CHANNELS
from vistel.protocol.vrpn import SIMULATED
from vistel.wire.clock import SystemClock
from vistel_sim.device import SimulatedDevice
from vistel_sim.motion import open_motion
from vistel_sim.phone import SimulatedSender, talking
from vistel_sim.process import simulators
from vistel_sim.testing.units import PhoneUnit, Pose, SerialUnit, VrpnUnit
from vistel_sim.vrpn_server import SimulatedVrpn

_NAME = "person"
S = TypeVar("S")


@dataclass(frozen=True)
class Gloves:
    """Both gloves of a person; the truth of each: t [s] -> 20 angles of the hand [rad], order of `Posture.hands`."""

    left: SerialUnit[F64]
    right: SerialUnit[F64]


@dataclass
class Person:
    """Somebody in a meeting who wears simulated devices. folder: for their ports."""

    folder: Path
    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    face: FaceConfig | None = None

    def __post_init__(self) -> None:
        participant = Participant(name=_NAME, tracker=self.tracker, face=self.face)
        conference = Conference(name="test", sites=[Site(name="here", participants=[participant])])
        self._motion = open_motion(conference)
        self._clock = SystemClock()
        self._start_ns = self._clock.now_ns()
        self._paths = RunPaths(self.folder, self.folder)
        devices = simulators(conference, self._motion, self._paths, self._clock, self._start_ns)
        self._devices = {device.name: device for device in devices}

    def posture(self, t_s: float) -> Posture:
        """The true posture `t_s` after the start, in the room's frame."""
        return self._motion.posture(_NAME, t_s)

    def fastrak(self) -> SerialUnit[dict[int, Pose]]:
        """Start their FASTRAK. Its truth: t [s] -> pose of each receiver, by station."""
        return self._serial(device_names.tracker_name(_NAME), self._receivers)

    def gloves(self) -> Gloves:
        """Start their CyberGloves."""
        left, right = (device_names.glove_name(_NAME, side) for side in ("left", "right"))
        return Gloves(
            self._serial(left, lambda t_s: self._motion.hand_angles(_NAME, t_s)[0]),
            self._serial(right, lambda t_s: self._motion.hand_angles(_NAME, t_s)[1]),
        )

    def vrpn(self) -> VrpnUnit[dict[int, Pose]]:
        """Start the VRPN server of their tracker. Its truth: t [s] -> pose of each receiver, by station (sensor 0 is station 1)."""
        name = device_names.tracker_name(_NAME)
        device = self._device(name, SimulatedVrpn)
        return VrpnUnit(device, self._clock, self._start_ns, self._receivers, self._paths.device(name), SIMULATED)

    def phone(self) -> PhoneUnit[dict[str, float]]:
        """Start the phone that sees their face. Its truth: t [s] -> value of each channel, by name."""
        name = device_names.face_name(_NAME)
        device = self._device(name, SimulatedSender)

        def truth(t_s: float) -> dict[str, float]:
            return dict(zip(CHANNELS, talking(t_s), strict=True))

        return PhoneUnit(device, self._clock, self._start_ns, truth, self._paths.device(name), _free_udp_port())

    def _serial(self, name: str, truth: Callable[[float], S]) -> SerialUnit[S]:
        return SerialUnit(self._device(name, SimulatedDevice), self._clock, self._start_ns, truth)

    def _device(self, name: str, kind: type[S]) -> S:
        device = self._devices[name]
        assert isinstance(device, kind)
        return device

    def _receivers(self, t_s: float) -> dict[int, Pose]:
        poses = self._motion.receivers(_NAME, t_s)
        return {station: poses[role] for role, station in self.tracker.stations.items()}


def _free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]
