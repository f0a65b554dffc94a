"""`vistel log import`: what was recorded elsewhere becomes a log, is solved, and meets in the room."""

import re
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from vistel.conference.device_names import tracker_name
from vistel.conference.files import text_of
from vistel.conference.model import Conference
from vistel.v1.device_pb2 import RawBytes, TrackerReceiver
from vistel.v1.motion_pb2 import Participant, Prop
from vistel.wire.log import LogReader, LogWriter
from vistel.wire.raw_bytes import RawGatherer
from vistel.wire.topics import BY_NAME, Topic
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import BVH, C3D, CSV, FOLDER, VRPN
from vistel_cli.overwriting import Force, out_file
from vistel_cli.terminal import USAGE, fail, out, print_warning
from vistel_cli.waiting import waiting

if TYPE_CHECKING:
    from vistel.log.sensors import Take

NAME = "imported"
"""Of the conference."""
SITE = "elsewhere"
"""Of everybody."""
BEGIN_NS = 1_577_836_800_000_000_000
"""Conference time at which an imported log begins, 1 January 2020: files of motion do not say when they were recorded [ns]."""
MOST_PEOPLE = 24
KINDS = (
    ".bvh (motion), .csv (6-DoF sensors), .c3d (clusters of marks), .vrpn (what a VRPN server logged),"
    " or a folder with *_pose_saved.csv (a hand-over)"
)

Writes = Callable[[Topic, str, Any, int], object]


@dataclass
class _Recorded:
    """A file: how long it is [s], its people as in a conference file, what it says of them, and whether that is to be solved."""

    seconds: float
    people: list[dict[str, Any]]
    messages: Callable[[Conference, int], Iterator[tuple[Topic, str, Any, int]]]
    solved: bool = False
    props: list[str] = field(default_factory=list[str])


def import_(
    files: Annotated[list[Path], Takes(BVH, C3D, CSV, VRPN, FOLDER), typer.Argument(help="Files or folders, one for each person.")],
    output: Annotated[Path, out_file("The log to write.")],
    delay: Annotated[
        list[float] | None,
        typer.Option("--delay", min=0.0, help="Seconds by which a file begins later than the log; one for each."),
    ] = None,
    height: Annotated[float, typer.Option(min=0.5, max=2.5, help="Of the people, in metres, where a file does not say it.")] = 1.75,
    unit: Annotated[
        Literal["m", "cm", "mm", "inch", "foot"] | None,
        typer.Option(help="CSV, C3D: unit of positions. Default: m; of C3D what the file says.", show_default=False),
    ] = None,
    up: Annotated[
        Literal["y", "z"] | None, typer.Option(help="CSV, C3D: which axis is up. Default: y; of C3D z.", show_default=False)
    ] = None,
    clock: Annotated[Literal["s", "ms", "us", "ns"], typer.Option(help="CSV: unit of the column t.")] = "s",
    force: Force = False,
) -> None:
    """Make a log of what was recorded elsewhere: motion, tables of sensors, captures of VRPN.

    Everybody gets a seat of one room. Sensors are solved as a tracker's; then everybody meets in the room, and what is touched and
    held is computed. The log is replayed, studied and exported as any other.

    [bold]Examples[/bold]

      vistel log import walk.bvh -o walk.mcap

      vistel log import sensors.csv --unit mm --up z -o sensors.mcap

      vistel log import marks.c3d -o marks.mcap

      vistel log import ann.bvh ben.vrpn --delay 0 --delay 1.5 -o both.mcap
    """
    delays = [*(delay or []), *[0.0] * len(files)][: len(files)]
    if len(delay or []) > len(files):
        fail(f"--delay: is given {len(delay or [])} times, for {len(files)} files", USAGE)
    found = [_read(path, height, unit, up, clock) for path in files]
    people = [p for f in found for p in f.people]
    if len(people) > MOST_PEOPLE:
        fail(f"{len(people)} people: expected at most {MOST_PEOPLE}")
    _name_apart(people)
    conference = _conference(people, [thing for f in found for thing in f.props])
    with tempfile.TemporaryDirectory(prefix="vistel-") as folder:
        raw = Path(folder) / "raw.mcap"
        text = text_of(conference)
        with LogWriter(raw, text) as writer:
            begun = ((f.messages(conference, BEGIN_NS + round(late * 1e9))) for f, late in zip(found, delays, strict=True))
            for topic, key, message, t_ns in sorted((m for of in begun for m in of), key=lambda m: m[3]):
                message.header.version = 1
                writer.write(topic, key, message, t_ns)
        _complete(raw, conference, output, "devices" if any(f.solved for f in found) else "motion")
    length = max(f.seconds + late for f, late in zip(found, delays, strict=True))
    out.print(f"{length:.1f} s of {', '.join(p['name'] for p in people)} written to {output}", soft_wrap=True)


def _complete(raw: Path, conference: Conference, output: Path, source: str) -> None:
    from vistel_cli.log.fast import replay_fast  # loads the mathematics
    from vistel_services import posture, world

    reader = LogReader(raw)
    with waiting("computing the room"):
        world.preload(conference)
        posture.preload(conference)
        try:
            # A log's end is the time of its last message, which counts.
            replay_fast(reader, conference, source, reader.begin_ns, reader.end_ns + 1, output, apart=False)
        except OSError as e:
            fail(f"--out {output}: cannot be written: {e.strerror}")


def _conference(people: list[dict[str, Any]], props: list[str]) -> Conference:
    data: dict[str, Any] = {"name": NAME, "room": {"seats": max(3, len(people))}}
    data["sites"] = [{"name": SITE, "participants": people, "props": [{"thing": thing} for thing in props]}]
    return Conference.model_validate(data)


def _name_apart(people: list[dict[str, Any]]) -> None:
    """Names that a conference file may have, each once."""
    used: set[str] = set()
    for person in people:
        plain = re.sub(r"[^a-z0-9]+", "-", person["name"].lower()).strip("-")[:28] or "person"
        numbers = (f"{plain}-{n}" if n > 1 else plain for n in range(1, MOST_PEOPLE + 2))
        person["name"] = next(name for name in numbers if name not in used)
        used.add(person["name"])


def _read(path: Path, height: float, unit: str | None, up: str | None, clock: str) -> _Recorded:
    from vistel.log.c3d import read_c3d
    from vistel.log.sensors import SensorError, read_table
    from vistel_sim.motion.source import MotionError

    kind = path.suffix.lower()
    try:
        if path.is_dir():
            return _hand_over(path)
        if kind == ".bvh":
            return _bvh(path)
        if kind == ".csv":
            return _sensors(path, height, read_table(path, unit or "m", up or "y", clock))
        if kind == ".c3d":
            return _sensors(path, height, read_c3d(path, unit, up or "z"))
        if kind == ".vrpn":
            return _capture(path, height)
    except (SensorError, MotionError) as e:
        fail(str(e))
    fail(f"{path}: expected {KINDS}")


# -- motion -----------------------------------------------------------------------------------------------------


def _bvh(path: Path) -> _Recorded:
    from vistel_sim.motion.bvh import load_bvh
    from vistel_sim.motion.played import play_alone
    from vistel_sim.motion.source import simulated_people

    take = load_bvh(path)
    person = _moved(path.stem, take.measured().height)

    def messages(conference: Conference, begin_ns: int) -> Iterator[tuple[Topic, str, Any, int]]:
        played = play_alone(simulated_people(conference)[person["name"]], take)
        yield from _motions(conference, person, played.postures, begin_ns)

    return _Recorded(take.duration_s, [person], messages)


def _hand_over(path: Path) -> _Recorded:
    from vistel.space.room import BATON
    from vistel_sim.motion.hand_over import play_hand_over
    from vistel_sim.motion.played import RATE_HZ
    from vistel_sim.motion.six_dof import ROLES, load_hand_over
    from vistel_sim.motion.source import simulated_people

    take = load_hand_over(path)
    people = [_moved(role, take.people[role].measured().height) for role in ROLES]
    seconds = take.people[ROLES[0]].duration_s

    def messages(conference: Conference, begin_ns: int) -> Iterator[tuple[Topic, str, Any, int]]:
        everyone = simulated_people(conference)
        played = play_hand_over({p["name"]: everyone[p["name"]] for p in people}, take, conference.room.seats)
        for person in people:
            yield from _motions(conference, person, played.takes[person["name"]].postures, begin_ns)
        topic = BY_NAME["prop"]
        key = topic.format(conference=NAME, site=SITE, thing=BATON)
        for n in range(int(seconds * RATE_HZ)):
            p, q = played.things(n / RATE_HZ)[BATON]
            message = Prop(thing=BATON)
            message.pose.position.x, message.pose.position.y, message.pose.position.z = p.tolist()
            r = message.pose.rotation
            r.x, r.y, r.z, r.w = q.tolist()
            message.health = TrackerReceiver.HEALTH_GOOD
            message.header.seq, message.header.t_ns = n + 1, begin_ns + round(n * 1e9 / RATE_HZ)
            yield topic, key, message, message.header.t_ns

    return _Recorded(seconds, people, messages, props=[BATON])


def _moved(name: str, height: float) -> dict[str, Any]:
    """Somebody whose postures are known: as a program that takes their part."""
    return {"name": name, "height": round(min(2.5, max(0.5, height)), 3), "program": True}


def _motions(conference: Conference, person: dict[str, Any], postures: Any, begin_ns: int) -> Iterator[tuple[Topic, str, Any, int]]:
    from vistel.messages.postures import sample_of
    from vistel.wire.motion import MotionEncoder
    from vistel_sim.motion.played import RATE_HZ

    who = person["name"]
    where = {"conference": NAME, "site": SITE, "participant": who}
    about = Participant(participant=who, site=SITE, avatar="builtin", height_m=person["height"])
    about.header.t_ns, about.header.seq = begin_ns, 1
    yield BY_NAME["participant"], BY_NAME["participant"].format(**where), about, begin_ns
    encoder, key = MotionEncoder(), BY_NAME["motion"].format(**where)
    for n, posture in enumerate(postures):
        t_ns = begin_ns + round(n * 1e9 / RATE_HZ)
        yield BY_NAME["motion"], key, encoder.encode(sample_of(posture, n + 1, t_ns, gaze=None, face=None, lids=None)), t_ns


# -- sensors ----------------------------------------------------------------------------------------------------


def _sensors(path: Path, height: float, recorded: "Take") -> _Recorded:
    from vistel.figure.skeleton import standard_skeleton
    from vistel.log.sensors import DEVICE, at_a_seat, table_bytes

    take = at_a_seat(recorded)
    _tell(path, take.back, take.remark)
    person = _tracked(path, height, f"{DEVICE}@imported")
    reads = list(table_bytes(take, standard_skeleton(height)))
    return _Recorded(take.seconds, [person], lambda _, begin_ns: _raw(person, reads, begin_ns), solved=True)


def _capture(path: Path, height: float) -> _Recorded:
    from vistel.log.sensors import read_capture

    found = read_capture(path)
    first, *others = found.devices
    _tell(path, found.back, f"the tracker {first}" + (f"; the poses of {', '.join(others)} are left out" if others else ""))
    person = _tracked(path, height, f"{first}@imported")
    seconds = found.reads[-1][0] - found.reads[0][0]
    return _Recorded(seconds, [person], lambda _, begin_ns: _raw(person, found.reads, begin_ns), solved=True)


def _tell(path: Path, back: int, remark: str) -> None:
    if back:
        print_warning(f"{path}: the time goes back {back} times; measurements are taken in the order of their times")
    out.print(f"{path.name}: {remark}", soft_wrap=True)


def _tracked(path: Path, height: float, port: str) -> dict[str, Any]:
    tracker = {"kind": "vrpn", "port": port, "transmitter_position": [0.0, 0.0, 0.0]}
    return {"name": path.stem, "height": height, "tracker": tracker}


def _raw(person: dict[str, Any], reads: Sequence[tuple[float, bytes]], begin_ns: int) -> Iterator[tuple[Topic, str, Any, int]]:
    topic, device = BY_NAME["device_raw"], tracker_name(person["name"])
    key = topic.format(conference=NAME, site=SITE, device=device)
    gathered: list[RawBytes] = []
    gatherer = RawGatherer(device, gathered.append)
    for t, data in reads:
        gatherer.add(data, begin_ns + round((t - reads[0][0]) * 1e9), RawBytes.DIRECTION_FROM_DEVICE)
    gatherer.flush()
    for n, message in enumerate(gathered):
        message.header.seq = n + 1
        after_ns = message.read_after_ns[-1] if message.read_after_ns else 0
        yield topic, key, message, message.header.t_ns + after_ns
