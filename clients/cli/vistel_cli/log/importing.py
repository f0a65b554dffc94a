"""`vistel log import`: what was recorded elsewhere becomes a log, is solved, and meets in the room."""

import re
import tempfile
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from vistel.conference.files import text_of
from vistel.conference.model import Conference
from vistel.wire.log import LogReader, LogWriter
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import BVH, C3D, CSV, FOLDER, LEAP, VRPN
from vistel_cli.log.imported.recorded import NAME, SITE, Assumed, Film, Recorded
from vistel_cli.overwriting import Force, keep_existing, out_file, written_whole
from vistel_cli.terminal import USAGE, fail, out, print_warning
from vistel_cli.waiting import waiting

BEGIN_NS = 1_577_836_800_000_000_000
"""Conference time at which an imported log begins, 1 January 2020: files of motion do not say when they were recorded [ns]."""
MOST_PEOPLE = 24
NO_POSTURE = "no posture could be computed; the file may be too short, or hold too few sensors at a time"
KINDS = (
    ".bvh (motion), .csv (6-DoF sensors), .c3d (clusters of marks), .vrpn (what a VRPN server logged),"
    " .json or .json.lz (hands over a Leap Motion), a folder with a bag of ROS 2, with Hands/Left_sync.txt (a HoloLens),"
    " or with *_pose_saved.csv (a hand-over)"
)


def import_(
    files: Annotated[
        list[Path], Takes(BVH, C3D, CSV, VRPN, LEAP, FOLDER), typer.Argument(help="Files or folders, one for each person.")
    ],
    output: Annotated[Path, out_file("The log to write.")],
    delay: Annotated[
        list[float] | None,
        typer.Option("--delay", min=0.0, help="Seconds by which a file begins later than the log; one for each."),
    ] = None,
    height: Annotated[float, typer.Option(min=0.5, max=2.5, help="Of the people, in metres, where a file does not say it.")] = 1.75,
    unit: Annotated[
        Literal["m", "cm", "mm", "inch", "foot"] | None,
        typer.Option(
            help="CSV, C3D, bags, hands: unit of positions. Default: m; of C3D what the file says; of Leap Motion mm.",
            show_default=False,
        ),
    ] = None,
    up: Annotated[
        Literal["y", "z"] | None,
        typer.Option(help="CSV, C3D, bags: which axis is up. Default: y; of C3D and bags z.", show_default=False),
    ] = None,
    clock: Annotated[Literal["s", "ms", "us", "ns"], typer.Option(help="CSV: unit of the column t.")] = "s",
    frame: Annotated[
        list[str] | None,
        typer.Option("--frame", metavar="SENSOR=FRAME", help="Bags: which frame chest, head, left_hand or right_hand is."),
    ] = None,
    force: Force = False,
) -> None:
    """Make a log of what was recorded elsewhere: motion, tables of sensors, captures of VRPN, bags of ROS 2, hands.

    Everybody gets a seat of one room. Sensors are solved as a tracker's; then everybody meets in the room, and what is touched and
    held is computed. The log is replayed, studied and exported as any other.

    [bold]Examples[/bold]

      vistel log import walk.bvh -o walk.mcap

      vistel log import sensors.csv --unit mm --up z -o sensors.mcap

      vistel log import marks.c3d -o marks.mcap

      vistel log import grab.json.lz -o hands.mcap

      vistel log import rosbag2_2026_05_01 --frame head=hmd -o bag.mcap

      vistel log import ann.bvh ben.vrpn --delay 0 --delay 1.5 -o both.mcap
    """
    delays = [*(delay or []), *[0.0] * len(files)][: len(files)]
    if len(delay or []) > len(files):
        fail(f"--delay: is given {len(delay or [])} times, for {len(files)} {'file' if len(files) == 1 else 'files'}", USAGE)
    assumed = Assumed(height, unit, up, clock, _frames(frame or []))
    with waiting(f"reading {', '.join(path.name for path in files)}"):
        found = [_read(path, assumed) for path in files]
    films = _films(found, delays, output)
    keep_existing(*(path for *_, path in films), force=force)
    people = [p for f in found for p in f.people]
    if len(people) > MOST_PEOPLE:
        fail(f"{len(people)} people: expected at most {MOST_PEOPLE}")
    _name_apart(people)
    conference = _conference(people, [thing for f in found for thing in f.props])
    with written_whole(output) as made, tempfile.TemporaryDirectory(prefix="vistel-") as folder, waiting("computing the room"):
        raw = Path(folder) / "raw.mcap"
        text = text_of(conference)
        with LogWriter(raw, text) as writer:
            begun = ((f.messages(conference, BEGIN_NS + round(late * 1e9))) for f, late in zip(found, delays, strict=True))
            for topic, key, message, t_ns in sorted((m for of in begun for m in of), key=lambda m: m[3]):
                message.header.version = 1
                writer.write(topic, key, message, t_ns)
        _complete(raw, conference, made, "devices" if any(f.solved for f in found) else "motion")
        moved = {record.names["participant"] for record in LogReader(made).records(("motion",))}
        if not moved:
            names = ", ".join(map(str, files))
            fail(f"{names}: {NO_POSTURE}; no log was written")
    length = max(f.seconds + late for f, late in zip(found, delays, strict=True))
    out.print(f"{length:.1f} s of {', '.join(p['name'] for p in people)} written to {output}", soft_wrap=True)
    for name in (p["name"] for p in people if p["name"] not in moved):
        print_warning(f"{name}: {NO_POSTURE}")
    begun_ns = LogReader(output).begin_ns
    for film, late, path in films:
        with waiting(f"writing {path}"):
            note = _written(film, path, (begun_ns - BEGIN_NS) * 1e-9 - late)
        out.print(note, soft_wrap=True)


def _films(found: list[Recorded], delays: list[float], output: Path) -> list[tuple[Film, float, Path]]:
    """Each with its file's delay [s], and where it is written: beside the log, each name once."""
    films = [(film, late) for f, late in zip(found, delays, strict=True) for film in f.films]
    names = [film.name for film, _ in films]
    numbers = [names[:n].count(name) for n, name in enumerate(names)]
    return [
        (film, late, output.with_name(f"{output.stem}.{film.name}{f'-{n + 1}' if n else ''}.mp4"))
        for (film, late), n in zip(films, numbers, strict=True)
    ]


def _written(film: Film, path: Path, after_s: float) -> str:
    """One line for a person. The log is there, so a film that fails is no failure of the command."""
    from vistel.log.sensors import SensorError

    try:
        return film.write(path, after_s)
    except SensorError as e:
        return f"{e}; there is no film of it"
    except OSError as e:
        return f"{path}: cannot be written: {e.strerror}; there is no film of it"


def _frames(given: list[str]) -> dict[str, str]:
    from vistel.log.sensors import SENSORS

    frames: dict[str, str] = {}
    for one in given:
        sensor, _, name = one.partition("=")
        if sensor not in SENSORS or not name:
            fail(f"--frame {one}: expected {', '.join(SENSORS)}, an equals sign and a frame of the bag, such as head=hmd", USAGE)
        frames[sensor] = name
    return frames


def _read(path: Path, assumed: Assumed) -> Recorded:
    from vistel.log.c3d import read_c3d
    from vistel.log.headsets.hololens import is_recording
    from vistel.log.headsets.leap import COMPRESSED
    from vistel.log.ros.bag import is_bag
    from vistel.log.sensors import SensorError, read_table
    from vistel_cli.log.imported import bag, hands, motion, sensors
    from vistel_sim.motion.six_dof import is_hand_over
    from vistel_sim.motion.source import MotionError

    kind = path.suffix.lower()
    try:
        if is_bag(path):
            return bag.bag(path, assumed)
        if is_recording(path):
            return hands.hololens(path, assumed)
        if is_hand_over(path):
            return motion.hand_over(path)
        if kind == ".bvh":
            return motion.bvh(path)
        if kind == ".csv":
            return sensors.sensors(path, assumed.height, read_table(path, assumed.unit or "m", assumed.up or "y", assumed.clock))
        if kind == ".c3d":
            return sensors.sensors(path, assumed.height, read_c3d(path, assumed.unit, assumed.up or "z"))
        if kind == ".vrpn":
            return sensors.capture(path, assumed.height)
        if kind in (".json", ".jsonl", COMPRESSED):
            return hands.leap(path, assumed)
    except (SensorError, MotionError) as e:
        fail(str(e))
    fail(f"{path}: expected {KINDS}")


def _complete(raw: Path, conference: Conference, output: Path, source: str) -> None:
    from vistel_cli.log.fast import replay_fast  # loads the mathematics
    from vistel_services import posture, world

    reader = LogReader(raw)
    world.preload(conference)
    posture.preload(conference)
    # A log's end is the time of its last message, which counts.
    replay_fast(reader, conference, source, reader.begin_ns, reader.end_ns + 1, output, apart=False)


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
