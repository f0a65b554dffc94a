"""One simulated person, and the units on them, each run beside a test."""

import socket
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from vistel.arrays import F32, F64
from vistel.conference import device_names
from vistel.conference.device_list import devices_of
from vistel.conference.devices import EyeConfig, FaceConfig, TrackerConfig
from vistel.conference.model import Conference, Participant, Site
from vistel.conference.paths import RunPaths
from vistel.devices import kind
from vistel.figure.posture.posture import Posture
from vistel.protocol.live_link_face import CHANNELS
from vistel.protocol.vrpn import SIMULATED
from vistel.wire.clock import SystemClock
from vistel_sim.device import SimulatedDevice
from vistel_sim.motion import open_motion
from vistel_sim.motion.source import MotionSource, simulated_people
from vistel_sim.phone import SimulatedSender, talking
from vistel_sim.simulation import Simulation
from vistel_sim.testing.units import PhoneUnit, Pose, SerialUnit, Unit, VrpnUnit
from vistel_sim.vrpn_server import SimulatedVrpn

if TYPE_CHECKING:
    from vistel_sim.testing.room_units import Helmet, MicrophoneUnit

_NAME = "person"
S = TypeVar("S")
U = TypeVar("U", bound=Unit[Any, Any])
Motion = Callable[[Conference], MotionSource]


@dataclass(frozen=True)
class Gloves:
    """Both gloves of a person; the truth of each: t [s] -> 20 angles of the hand [rad], order of `Posture.hands`."""

    left: SerialUnit[F64]
    right: SerialUnit[F64]


@dataclass
class Person:
    """Somebody who wears simulated devices. folder: for their ports. Units that were started end with `end`, at the latest.

    participant: who they are in `conference`; by default somebody in a meeting. motion: how they move; default: as the conference
    says.
    """

    folder: Path
    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    face: FaceConfig | None = None
    eye: EyeConfig | None = None
    conference: Conference | None = None
    participant: str = _NAME
    motion: Motion = open_motion

    def __post_init__(self) -> None:
        name, worn = self.participant, {"tracker": self.tracker, "face": self.face, "eye": self.eye}
        base = self.conference or Conference(name="test", sites=[Site(name="here", participants=[Participant(name=name)])])
        sites = [s.model_copy(update={"participants": [_wearing(p, name, worn) for p in s.participants]}) for s in base.sites]
        conference = base.model_copy(update={"sites": sites})
        self._motion = self.motion(conference)
        self._clock = SystemClock()
        self._start_ns = self._clock.now_ns()
        self._paths = RunPaths(self.folder, self.folder)
        self._simulation = Simulation(conference, self._motion, self._paths, self._clock, self._start_ns)
        self._devices = {d.name: d for d in devices_of(conference) if d.simulated}
        self._ends = ExitStack()
        self.units: list[Unit[Any, Any]] = []
        """Those that were started."""

    def posture(self, t_s: float) -> Posture:
        """The true posture `t_s` after the start, in the room's frame."""
        return self._motion.posture(self.participant, t_s)

    def end(self) -> None:
        """End all units that were started. Raises RuntimeError when one of them failed before."""
        self._ends.close()

    def fastrak(self) -> SerialUnit[dict[int, Pose]]:
        """Start their tracker, a FASTRAK unless another one on a serial port was chosen. Its truth: t [s] -> pose of each receiver,
        by station."""
        return self._serial(device_names.tracker_name(self.participant), self._receivers)

    def gloves(self) -> Gloves:
        """Start their CyberGloves."""
        left, right = (device_names.glove_name(self.participant, side) for side in ("left", "right"))
        return Gloves(
            self._serial(left, lambda t_s: self._motion.hand_angles(self.participant, t_s)[0]),
            self._serial(right, lambda t_s: self._motion.hand_angles(self.participant, t_s)[1]),
        )

    def vrpn(self) -> VrpnUnit[dict[int, Pose]]:
        """Start the VRPN server of their tracker. Its truth: t [s] -> pose of each receiver, by station (sensor 0 is station 1)."""
        name = device_names.tracker_name(self.participant)
        device, at = self._device(name, SimulatedVrpn), self._paths.device(name)
        return self._started(VrpnUnit(device, self._clock, self._start_ns, self._receivers, at, SIMULATED))

    def phone(self) -> PhoneUnit[dict[str, float]]:
        """Start the phone that sees their face. Its truth: t [s] -> value of each channel, by name."""
        name = device_names.face_name(self.participant)
        device, at = self._device(name, SimulatedSender), self._paths.device(name)

        def truth(t_s: float) -> dict[str, float]:
            return dict(zip(CHANNELS, talking(t_s), strict=True))

        return self._started(PhoneUnit(device, self._clock, self._start_ns, truth, at, _free_udp_port()))

    def helmet(self) -> "Helmet":
        """Start the cameras that see their face and one of their eyes."""
        from vistel_sim.pictures.camera import SimulatedCamera
        from vistel_sim.pictures.faces import FaceScene
        from vistel_sim.testing.room_units import CameraUnit, Helmet

        def camera(name: str, truth: Callable[[float], F64]) -> CameraUnit[F64]:
            device, at = self._device(name, SimulatedCamera), self._paths.device(name)
            return self._started(CameraUnit(device, self._clock, self._start_ns, truth, at))

        face, eye = device_names.face_name(self.participant), device_names.eye_name(self.participant)
        scene = FaceScene(talking, self._simulation.seed(face))
        return Helmet(camera(face, scene.marks), camera(eye, lambda t_s: self.posture(t_s).gaze))

    def microphone(self) -> "MicrophoneUnit":
        """Start the microphone that they speak into."""
        from vistel_sim.microphone import BLOCK, RATE, SimulatedMicrophone, SimulatedVoice
        from vistel_sim.testing.room_units import MicrophoneUnit

        name = device_names.microphone_name(self.participant)
        seed, at = self._simulation.seed(name), self._paths.device(name)
        voice = SimulatedVoice(partial(self._motion.speaking, self.participant), lambda start_s, end_s: (), seed)
        device = SimulatedMicrophone(name, voice, at, seed=seed)

        def truth(t_s: float) -> F32:
            return voice.block(int(t_s * RATE / BLOCK))

        return self._started(MicrophoneUnit(device, self._clock, self._start_ns, truth, at))

    def _serial(self, name: str, truth: Callable[[float], S]) -> SerialUnit[S]:
        return self._started(SerialUnit(self._device(name, SimulatedDevice), self._clock, self._start_ns, truth))

    def _device(self, name: str, of: type[S]) -> S:
        device = self._devices[name]
        made = kind.load(device.kind.simulator)(device, self._simulation)
        assert isinstance(made, of)
        return made

    def _started(self, unit: U) -> U:
        self._ends.callback(unit.end)
        self.units.append(unit)
        unit.wait_until_plugged()
        return unit

    def _receivers(self, t_s: float) -> dict[int, Pose]:
        poses = self._motion.receivers(self.participant, t_s)
        return {station: poses[role] for role, station in self.tracker.stations.items()}


def logged(path: Path, participant: str | None, folder: Path) -> Person:
    """Somebody who moves as in a log, by default its first participant. folder: for their ports. Raises MotionError, one line."""
    from vistel.log import Log, LogError
    from vistel_sim.motion.logged import LoggedMotion
    from vistel_sim.motion.source import MotionError

    try:
        log = Log(path)
        name = participant or next(iter(log.participants), "")
        log.check_participant(name)
    except (LogError, ValueError) as e:
        raise MotionError(str(e)) from e
    try:
        conference = Conference.model_validate(log.conference)
    except ValueError as e:
        raise MotionError(f"{path}: its conference file is none of this version: {str(e).splitlines()[0]}") from e

    def motion(played: Conference) -> MotionSource:
        return LoggedMotion(path, {name: simulated_people(played)[name]})

    return Person(folder, conference=conference, participant=name, motion=motion)


def _wearing(person: Participant, name: str, worn: dict[str, object]) -> Participant:
    """The participant `name` wears what is simulated; others are as they are."""
    plain = {"gloves": Participant(name=name).gloves, "guest": False, "program": False}
    return person.model_copy(update={**plain, **worn}) if person.name == name else person


def _free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]
