"""All simulated devices of a conference, moved by one motion source.

python -m vistel_sim.process CONFERENCE.toml --run RUN [--site SITE] [--fault DEVICE:KIND:AT_S:FOR_S ...]
"""

from __future__ import annotations

import argparse
import asyncio
import logging
import signal
import sys
import zlib
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from vistel.arrays import F64
from vistel.conference.devices import GloveConfig, PropTracker, TrackerConfig
from vistel.conference.files import ConferenceError, load
from vistel.conference.model import Conference, Participant, Prop, Site
from vistel.conference.paths import RunPaths
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.figure.posture.sensors import Placement
from vistel.protocol.vrpn import SIMULATED, SIMULATED_GLOVE
from vistel.space.room import meeting_room
from vistel.wire import background, event_loop
from vistel.wire.clock import Clock, SystemClock
from vistel_sim import suite, vrpn_server
from vistel_sim.cyberglove import CyberGlove
from vistel_sim.device import Instrument, SimulatedDevice, run_devices
from vistel_sim.fastrak import Fastrak, PoseSource
from vistel_sim.faults import Fault, fault_from_text
from vistel_sim.fivedt import Glove5, Glove16, Ultra, UltraReports
from vistel_sim.liberty import Liberty
from vistel_sim.motion import MotionError, open_motion
from vistel_sim.motion.source import Clapper, Place, places, prop_transmitter, receiver_on_prop
from vistel_sim.phone import Packets, SimulatedSender, face_packets, run_senders, talking
from vistel_sim.pictures.camera import Scene, SimulatedCamera, run_cameras
from vistel_sim.pictures.faces import EyeScene, FaceScene
from vistel_sim.sayings import Sayings
from vistel_sim.talker import SimulatedMicrophone, Voice, run_microphones
from vistel_sim.vrpn_server import SimulatedVrpn

if TYPE_CHECKING:
    from vistel.conference.sound import Equipment
    from vistel_sim.modbus_unit import SimulatedUnit

log = logging.getLogger("vistel.sim")

_RESTART_S = 0.3
"""Simulated units restart faster than real ones (10 s and 1.75 s); the protocol is the same."""


class BodyMotion(Protocol):
    """What the devices need of a motion source (`vistel_sim.motion.MotionSource` has more)."""

    def posture(self, participant: str, t_s: float) -> Posture:
        """What the participant does."""
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
        """Where the motion has things of the room, by id: position [m], quaternion (x, y, z, w), room frame."""
        ...


def simulated_devices(
    conference: Conference,
    motion: BodyMotion,
    paths: RunPaths,
    clock: Clock,
    start_ns: int,
    *,
    site: str | None = None,
    faults: Iterable[Fault] = (),
) -> list[SimulatedDevice]:
    """The devices whose port is "sim"; of one site, or of all. Raises ValueError for a fault of no such device."""
    faults = tuple(faults)
    devices = [
        SimulatedDevice(name, instrument, paths.device(name), clock, start_ns, faults, baud=baud, seed=seed)
        for s in conference.sites
        if site in (None, s.name)
        for name, instrument, baud, seed in _site_instruments(conference, s, motion)
    ]
    names = {d.name for d in devices} | {f"{p.name}-face" for p in _phone_owners(conference, site)}
    names |= {name for name, _ in _camera_names(conference, site)}
    names |= {f"{p.name}-tracker" for p in _suite_owners(conference, site)}
    names |= {name for name, _, _ in _served(conference, site)}
    names |= {f"{p.name}-microphone" for p in _talkers(conference, site)}
    names |= {name for name, _ in _equipment(conference, site)}
    for fault in faults:
        if fault.device not in names:
            raise ValueError(f"fault: no simulated device {fault.device!r}; there are {', '.join(sorted(names))}")
    return devices


def _talkers(conference: Conference, site: str | None) -> list[Participant]:
    """Whose microphone is simulated."""
    sites = [(s, s.audio) for s in conference.sites if site in (None, s.name)]
    return [
        p
        for s, audio in sites
        if audio is not None
        for i, p in enumerate(s.participants)
        if audio.microphone_of(p.name, i == 0) == "sim"
    ]


def simulated_microphones(
    conference: Conference, motion: BodyMotion, paths: RunPaths, *, site: str | None = None, faults: Iterable[Fault] = ()
) -> list[SimulatedMicrophone]:
    """What simulated talkers speak and clap into."""
    faults = tuple(faults)
    out: list[SimulatedMicrophone] = []
    for person in _talkers(conference, site):
        name = f"{person.name}-microphone"
        seed = device_seed(conference.seed, name)
        sayings = Sayings(person.says) if person.says else None
        voice = Voice(partial(motion.speaking, person.name), partial(_claps_of, motion, person.name), seed, sayings)
        out.append(SimulatedMicrophone(name, voice, paths.device(name), faults, seed=seed))
    return out


def _claps_of(motion: BodyMotion, participant: str, start_s: float, end_s: float) -> Sequence[float]:
    return motion.claps(participant, start_s, end_s) if isinstance(motion, Clapper) else ()


def _equipment(conference: Conference, site: str | None) -> list[tuple[str, Equipment]]:
    """Simulated devices of rooms on Modbus."""
    sites = [(s.name, s.audio) for s in conference.sites if site in (None, s.name)]
    return [(f"{name}-{e.name}", e) for name, audio in sites if audio is not None for e in audio.equipment if e.simulated]


def simulated_equipment(
    conference: Conference, paths: RunPaths, clock: Clock, start_ns: int, *, site: str | None = None, faults: Iterable[Fault] = ()
) -> list[SimulatedUnit]:
    """The equipment whose address is "sim" or "sim:rtu"."""
    wanted, faults = _equipment(conference, site), tuple(faults)
    if not wanted:
        return []
    from vistel_sim.delay_unit import SimulatedDelayUnit  # noqa: PLC0415  few conferences load Modbus
    from vistel_sim.room_device import SimulatedRoomDevice  # noqa: PLC0415

    out: list[SimulatedUnit] = []
    for name, e in wanted:
        own, baud = device_seed(conference.seed, name), e.baud if e.address == "sim:rtu" else 0
        at = (name, paths.device(name), clock, start_ns, faults)
        if e.role == "delay":
            channels = max(2, e.channel)
            out.append(SimulatedDelayUnit(*at, channels=channels, baud=baud, device_id=e.device_id, seed=own))
        else:
            out.append(SimulatedRoomDevice(*at, registers=e.map(), baud=baud, device_id=e.device_id, seed=own))
    return out


def _phone_owners(conference: Conference, site: str | None) -> list[Participant]:
    people = [p for s in conference.sites if site in (None, s.name) for p in s.participants]
    return [p for p in people if p.face and p.face.kind == "live_link" and p.face.simulated]


def _camera_names(conference: Conference, site: str | None) -> list[tuple[str, Participant]]:
    """Simulated cameras, and whose face they see."""
    people = [p for s in conference.sites if site in (None, s.name) for p in s.participants]
    out = [(f"{p.name}-face", p) for p in people if p.face and p.face.kind == "camera" and p.face.simulated]
    return out + [(f"{p.name}-eye", p) for p in people if p.eye and p.eye.simulated]


def simulated_cameras(
    conference: Conference,
    motion: BodyMotion,
    paths: RunPaths,
    clock: Clock,
    start_ns: int,
    *,
    site: str | None = None,
    faults: Iterable[Fault] = (),
) -> list[SimulatedCamera]:
    """The face and eye cameras whose source is "sim"."""
    faults = tuple(faults)
    out: list[SimulatedCamera] = []
    for name, person in _camera_names(conference, site):
        seed = device_seed(conference.seed, name)
        if person.eye is not None and name.endswith("-eye"):
            scene: Scene = EyeScene(_gaze_of(motion, person.name), talking, seed, right=person.eye.eye == "right")
        else:
            scene = FaceScene(talking, seed)
        out.append(SimulatedCamera(name, scene, paths.device(name), clock, start_ns, faults, seed=seed))
    return out


def _gaze_of(motion: BodyMotion, participant: str) -> Callable[[float], F64]:
    return lambda t_s: motion.posture(participant, t_s).gaze


def _suite_owners(conference: Conference, site: str | None) -> list[Participant]:
    people = [p for s in conference.sites if site in (None, s.name) for p in s.participants]
    return [p for p in people if p.tracker is not None and p.tracker.kind == "vmc" and p.tracker.port == "sim"]


def simulated_servers(
    conference: Conference,
    motion: BodyMotion,
    paths: RunPaths,
    clock: Clock,
    start_ns: int,
    *,
    site: str | None = None,
    faults: Iterable[Fault] = (),
) -> list[SimulatedVrpn]:
    """The VRPN servers of trackers and gloves whose port is "sim"."""
    faults = tuple(faults)
    out: list[SimulatedVrpn] = []
    for name, called, person in _served(conference, site):
        own = device_seed(conference.seed, name)
        device = _served_tracker(person, motion, own) if called == SIMULATED else _served_glove(person, name, motion, own)
        out.append(SimulatedVrpn(name, called, device, paths.device(name), clock, start_ns, faults, seed=own))
    return out


def _served(conference: Conference, site: str | None) -> list[tuple[str, str, Participant]]:
    """Devices of simulated VRPN servers: name, what the server calls it, whose it is."""
    people = [p for s in conference.sites if site in (None, s.name) for p in s.participants]
    out = [
        (f"{p.name}-tracker", SIMULATED, p) for p in people if p.tracker and p.tracker.kind == "vrpn" and p.tracker.port == "sim"
    ]
    return out + [
        (f"{p.name}-glove-{side}", SIMULATED_GLOVE, p)
        for p in people
        for side, g in sorted(p.gloves.items())
        if g.kind in ("vrpn", "vrpn_pinch") and g.port == "sim"
    ]


def _served_tracker(person: Participant, motion: BodyMotion, seed: int) -> vrpn_server.Device:
    assert person.tracker is not None
    roles = {station: role for role, station in person.tracker.stations.items()}
    return vrpn_server.Tracker(lambda station, t_s: motion.receivers(person.name, t_s)[roles[station]], sorted(roles), seed=seed)


def _served_glove(person: Participant, name: str, motion: BodyMotion, seed: int) -> vrpn_server.Device:
    side = "right" if name.endswith("-right") else "left"
    angles = _hand(person, side, motion)
    if person.gloves[side].kind == "vrpn_pinch":
        return vrpn_server.PinchGlove(angles, right=side == "right")
    return vrpn_server.Glove(UltraReports(angles, sensors=person.gloves[side].sensors, right=side == "right", seed=seed))


def _hand(person: Participant, side: str, motion: BodyMotion) -> Callable[[float], Sequence[float]]:
    row = int(side == "right")
    return lambda t_s: motion.hand_angles(person.name, t_s)[row].tolist()


def simulated_senders(
    conference: Conference,
    motion: BodyMotion,
    paths: RunPaths,
    clock: Clock,
    start_ns: int,
    *,
    site: str | None = None,
    faults: Iterable[Fault] = (),
) -> list[SimulatedSender]:
    """The phones and tracking suites whose port is "sim"."""
    faults = tuple(faults)
    where = places(conference)
    senders = {f"{p.name}-face": face_packets(f"{p.name}-face", talking) for p in _phone_owners(conference, site)}
    senders |= {f"{p.name}-tracker": _suite(where[p.name], motion) for p in _suite_owners(conference, site)}
    return [
        SimulatedSender(name, packet, paths.device(name), clock, start_ns, faults, seed=device_seed(conference.seed, name))
        for name, packet in senders.items()
    ]


def _suite(place: Place, motion: BodyMotion) -> Packets:
    def packet(frame: int, t_s: float) -> bytes:
        return suite.packet(pose_joints(place.skeleton, motion.posture(place.name, t_s)), place.transmitter)

    return packet


def _site_instruments(conference: Conference, site: Site, motion: BodyMotion):
    for person in site.participants:
        yield from _instruments(person, conference.seed, motion)
    still = {t.id: (t.position, t.rotation) for t in meeting_room(conference.room.seats).things}
    for prop in site.props:
        if prop.tracker.port != "sim":
            continue
        transmitter = prop_transmitter(conference, site, prop.tracker)

        def pose(station: int, t_s: float, prop: Prop = prop, transmitter: Placement = transmitter) -> Placement:
            at = motion.things(t_s).get(prop.thing, still[prop.thing])
            return receiver_on_prop(transmitter, prop.tracker, at)

        own = device_seed(conference.seed, prop.device)
        unit = _tracker(prop.tracker, pose, [prop.tracker.station], own)
        yield prop.device, unit, prop.tracker.baud, own


def _instruments(person: Participant, seed: int, motion: BodyMotion):
    if person.tracker is not None and person.tracker.port == "sim" and person.tracker.kind not in ("vmc", "vrpn"):
        name = f"{person.name}-tracker"
        roles = {station: role for role, station in person.tracker.stations.items()}

        def pose(station: int, t_s: float) -> tuple[F64, F64]:
            return motion.receivers(person.name, t_s)[roles[station]]

        own = device_seed(seed, name)
        mine = [n for n in sorted(roles) if n <= 4 or not person.tracker.second_port]
        yield name, _tracker(person.tracker, pose, mine, own), person.tracker.baud, own
        if person.tracker.second_port == "sim":

            def others(station: int, t_s: float) -> tuple[F64, F64]:
                return pose(station + 4, t_s)

            own = device_seed(seed, f"{name}-2")
            unit = _tracker(person.tracker, others, [n - 4 for n in sorted(roles) if n > 4], own)
            yield f"{name}-2", unit, person.tracker.baud, own
    for side, glove in sorted(person.gloves.items()):
        if glove.port != "sim" or glove.kind in ("vrpn", "vrpn_pinch"):
            continue
        name = f"{person.name}-glove-{side}"
        own = device_seed(seed, name)
        yield name, _glove(glove, _hand(person, side, motion), side == "right", own), glove.baud, own


def _tracker(config: TrackerConfig | PropTracker, pose: PoseSource, receivers: Sequence[int], seed: int) -> Instrument:
    if config.kind in ("vmc", "vrpn"):
        raise ValueError(f"{config.kind}: is no serial device")
    if config.kind == "fastrak":
        return Fastrak(pose, receivers=receivers, seed=seed, restart_s=_RESTART_S)
    return Liberty(pose, model=config.kind, receivers=receivers, seed=seed, restart_s=_RESTART_S, baud=config.baud)


def _glove(config: GloveConfig, angles: Callable[[float], Sequence[float]], right: bool, seed: int) -> Instrument:
    if config.kind == "cyberglove":
        return CyberGlove(angles, sensors=config.sensors, right=right, seed=seed, restart_s=_RESTART_S)
    kind = {"5dt_ultra": Ultra, "5dt_16": Glove16, "5dt_5": Glove5}[config.kind]
    return kind(angles, sensors=config.sensors, right=right, seed=seed)


def device_seed(seed: int, name: str) -> int:
    """Of the noise of one device of a conference."""
    return zlib.crc32(f"{seed}/{name}".encode())


async def run_simulators(
    conference: Conference,
    paths: RunPaths,
    clock: Clock,
    faults: Iterable[Fault] = (),
    *,
    site: str | None = None,
    start_ns: int | None = None,
) -> None:
    """Run them until cancelled. The motion, and the times of `faults`, begin at `start_ns` of the clock; without it, now."""
    motion = open_motion(conference)
    faults, start_ns = tuple(faults), clock.now_ns() if start_ns is None else start_ns
    devices = simulated_devices(conference, motion, paths, clock, start_ns, site=site, faults=faults)
    senders = simulated_senders(conference, motion, paths, clock, start_ns, site=site, faults=faults)
    servers = simulated_servers(conference, motion, paths, clock, start_ns, site=site, faults=faults)
    cameras = simulated_cameras(conference, motion, paths, clock, start_ns, site=site, faults=faults)
    microphones = simulated_microphones(conference, motion, paths, site=site, faults=faults)
    units = simulated_equipment(conference, paths, clock, start_ns, site=site, faults=faults)
    everything = (*devices, *senders, *servers, *cameras, *microphones, *units)
    log.info("simulated devices=%s", ",".join(d.name for d in everything))
    async with asyncio.TaskGroup() as group:
        group.create_task(run_devices(devices))
        group.create_task(run_senders(senders))
        for server in servers:
            group.create_task(server.run(), name=server.name)
        group.create_task(run_cameras(cameras))
        group.create_task(run_microphones(microphones, clock, start_ns))
        for unit in units:
            group.create_task(unit.run(), name=unit.name)


async def _main(conference: Conference, paths: RunPaths, site: str | None, faults: list[Fault]) -> None:
    work = asyncio.current_task()
    assert work is not None
    for signum in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(signum, work.cancel)
    try:
        async with background.service("simulators"):
            await run_simulators(conference, paths, SystemClock(), faults, site=site)
    except asyncio.CancelledError:
        log.info("simulated devices stopped")


def main(arguments: Sequence[str] | None = None) -> int:
    """Simulate what `arguments` (default: the command line) say until told to stop. Returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("conference", type=Path)
    parser.add_argument("--run", type=Path, required=True, help="folder for the ports")
    parser.add_argument("--site", help="only this site's devices")
    parser.add_argument("--fault", action="append", default=[], help="DEVICE:KIND:AT_S:FOR_S, may be given often")
    args = parser.parse_args(arguments)
    logging.basicConfig(force=True, level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s %(message)s")
    try:
        faults = [fault_from_text(text) for text in args.fault]
        event_loop.run(_main(load(args.conference), RunPaths(args.run, args.run), args.site, faults))
    except (ConferenceError, MotionError, ValueError) as e:
        print(e, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
