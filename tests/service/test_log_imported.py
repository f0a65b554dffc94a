"""`vistel log import`: motion, tables of sensors and captures of VRPN, solved, and in one room."""

from __future__ import annotations

import csv
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner, Result

import vistel.log
from vistel.arrays import F64
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.geometry.rotation import quaternion_from_matrix
from vistel.log.numbers import skeleton_of, tracks
from vistel.log.sensors import SENSORS, SensorError, at_a_seat, read_capture, read_table, table_bytes
from vistel.protocol import vrpn
from vistel.wire.log import LogReader
from vistel_cli.main import app

MEETING = Path(__file__).parents[1] / "replay" / "meeting.mcap"
HEADING = "t,sensor,x,y,z,qx,qy,qz,qw"
SECONDS = 3.0
_ENTRY = struct.Struct(">iiIIi4x")


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["log", *map(str, arguments)], env={"COLUMNS": "160"})


def sensors_of(log: vistel.log.Log, who: str) -> Iterator[tuple[float, str, F64, F64]]:
    """What perfect sensors on four joints measure: time [s], name, position (3,) [m], rotation (3, 3)."""
    skeleton = skeleton_of(log, who)
    for t, posture in log.postures(who, 0.0, SECONDS):
        pose = pose_joints(skeleton, posture)
        for sensor in SENSORS:
            if sensor == "chest":
                left, right = (JOINT_INDEX[f"{side}_shoulder"] for side in ("left", "right"))
                yield t, sensor, 0.5 * (pose.position[left] + pose.position[right]), pose.rotation[left]
            else:
                yield t, sensor, pose.position[JOINT_INDEX[sensor]], pose.rotation[JOINT_INDEX[sensor]]


def write_table(path: Path, scale: float = 1.0, turn: F64 | None = None, seconds: float = 1.0) -> Path:
    """ben's sensors. scale: units in a metre; turn: (3, 3) from the room's axes; seconds: units of time in one."""
    turned = np.eye(3) if turn is None else turn
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(HEADING.split(","))
        for t, sensor, p, r in sensors_of(vistel.log.open(MEETING), "ben"):
            q = quaternion_from_matrix(np.ascontiguousarray(turned @ r @ turned.T))
            numbers = [*(scale * turned @ p).tolist(), *q.tolist()]
            rows.writerow([f"{seconds * t:.6f}", sensor, *(f"{x:.9f}" for x in numbers)])
    return path


def write_capture(path: Path, table: Path) -> Path:
    """The same as a VRPN client logs it: entries, not padded, and the order of numbers of a file."""
    data = vrpn.COOKIE
    for _, wire in table_bytes(at_a_seat(read_table(table)), standard_skeleton(1.82)):
        at = vrpn.COOKIE_LENGTH if wire.startswith(b"vrpn") else 0
        while at < len(wire):
            length, seconds, micros, sender, kind = struct.unpack_from(">IIIii", wire, at)
            payload = wire[at + 24 : at + length]
            data += _ENTRY.pack(kind, sender, seconds + 1_000_000_000, micros, len(payload)) + payload
            at += -(-length // 8) * 8
    path.write_bytes(data)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """ben's sensors as a table, `ben.csv`, and what became of it, `ben.mcap`."""
    folder = tmp_path_factory.mktemp("imported")
    table = write_table(folder / "ben.csv")
    done = call("import", table, "--height", "1.82", "-o", folder / "ben.mcap")
    assert done.exit_code == 0, done.output
    return folder


def wrists(log: vistel.log.Log, who: str) -> tuple[F64, F64]:
    """Times (N,) [s], and both wrists seen from the head (N, 2, 3) in the chest's frame [m]."""
    skeleton, times, places = skeleton_of(log, who), [], []
    for t, posture in log.postures(who, 0.0, SECONDS):
        pose = pose_joints(skeleton, posture)
        hands = pose.position[[JOINT_INDEX["left_hand"], JOINT_INDEX["right_hand"]]]
        times.append(t)
        places.append((hands - pose.position[JOINT_INDEX["head"]]) @ pose.rotation[JOINT_INDEX["left_shoulder"]])
    return np.array(times), np.array(places)


def apart_m(there: tuple[F64, F64], here: tuple[F64, F64]) -> float:
    """How far wrists are from where they were, the median [m]."""
    t, _ = here
    was = np.array([[np.interp(t, there[0], there[1][:, hand, axis]) for axis in range(3)] for hand in range(2)])
    return float(np.median(np.linalg.norm(was.transpose(2, 0, 1) - here[1], axis=2)[30:]))


def test_sensors_of_a_table_are_solved_to_where_the_hands_were(folder: Path) -> None:
    there, here = (wrists(vistel.log.open(path), "ben") for path in (MEETING, folder / "ben.mcap"))
    assert len(here[0]) > 100
    assert apart_m(there, here) < 0.05


def test_an_imported_log_is_replayed_and_studied_as_any_other(folder: Path, tmp_path: Path) -> None:
    log = folder / "ben.mcap"
    assert LogReader(log).damage == []
    assert call("grep", log, "participant.ben.motion.left_wrist.y > 0.3").exit_code == 0
    again = CliRunner().invoke(
        app, ["replay", str(log), "--source", "devices", "--fast", "--out", str(tmp_path), "--against", str(log)]
    )
    assert again.exit_code == 0, again.output


@pytest.mark.parametrize(
    ("scale", "z_up", "seconds", "told", "options"),
    [
        (1000.0, False, 1.0, "--unit mm", ["--unit", "mm"]),
        (100.0, False, 1.0, "--unit cm", ["--unit", "cm"]),
        (1 / 0.0254, False, 1.0, "--unit inch", ["--unit", "inch"]),
        (1.0, True, 1.0, "--up z", ["--up", "z"]),
        (1000.0, True, 1.0, "--up z --unit mm", ["--up", "z", "--unit", "mm"]),
        (1.0, False, 1000.0, "--clock ms", ["--clock", "ms"]),
        (1.0, False, 1e9, "--clock ns", ["--clock", "ns"]),
    ],
)
def test_a_wrong_unit_is_told_with_a_guess_and_with_the_right_one_the_numbers_are_the_same(
    folder: Path, tmp_path: Path, scale: float, z_up: bool, seconds: float, told: str, options: list[str]
) -> None:
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]) if z_up else None
    table = write_table(tmp_path / "ben.csv", scale, turn, seconds)
    done = call("import", table, "-o", tmp_path / "ben.mcap")
    assert done.exit_code == 1 and told in done.stderr and done.stderr.count("\n") <= 2, done.output
    assert not (tmp_path / "ben.mcap").exists()
    read = read_table(table, **dict(zip([o[2:] for o in options[::2]], options[1::2], strict=True)))
    for sensor, track in read_table(folder / "ben.csv").tracks.items():
        assert np.allclose(read.tracks[sensor].t, track.t, atol=1e-5)
        assert np.allclose(read.tracks[sensor].position, track.position, atol=1e-5)
        assert np.allclose(read.tracks[sensor].rotation, track.rotation, atol=1e-6)


def test_a_capture_of_vrpn_is_read_as_the_same_bytes_on_a_wire(folder: Path, tmp_path: Path) -> None:
    capture = write_capture(tmp_path / "ben.vrpn", folder / "ben.csv")
    done = call("import", capture, "--height", "1.82", "-o", tmp_path / "ben.mcap")
    assert done.exit_code == 0 and "Imported0" in done.stderr, done.output
    there, here = (wrists(vistel.log.open(path), "ben") for path in (folder / "ben.mcap", tmp_path / "ben.mcap"))
    assert apart_m(there, here) < 0.005


def test_rows_whose_time_goes_back_are_put_in_order_and_that_is_told(folder: Path, tmp_path: Path) -> None:
    heading, *rows = (folder / "ben.csv").read_text().splitlines()
    mixed = tmp_path / "ben.csv"
    mixed.write_text("\n".join([heading, *rows[200:300], *rows[:200], *rows[300:]]))
    read, was = read_table(mixed), read_table(folder / "ben.csv")
    assert read.back == 4, "once for each sensor"
    assert all(np.array_equal(read.tracks[s].position, was.tracks[s].position) for s in SENSORS)
    assert "goes back 4 times" in call("import", mixed, "-o", tmp_path / "ben.mcap").stderr


def test_motion_and_sensors_of_two_people_meet_in_one_log_aligned_in_time(folder: Path, tmp_path: Path) -> None:
    bvh = tmp_path / "Ben Too.bvh"
    assert call("export", MEETING, "-o", bvh, "--bvh", "ben", "--to", str(SECONDS)).exit_code == 0
    done = call("import", bvh, folder / "ben.csv", "--delay", "1", "-o", tmp_path / "both.mcap")
    assert done.exit_code == 0, done.output
    log = vistel.log.open(tmp_path / "both.mcap")
    assert sorted(log.participants) == ["ben", "ben-too"]
    first = {who: next(iter(log.postures(who)))[0] for who in log.participants}
    assert 0.9 < first["ben-too"] - first["ben"] < 1.1
    assert any(set(room.people) == {"ben", "ben-too"} for _, room in log.rooms())
    when = np.arange(0.5, 2.0, 0.1)
    there = elbow(vistel.log.open(MEETING), "ben", when)
    here = elbow(log, "ben-too", when + first["ben-too"])
    assert np.abs(there - here).max() < 12.0


def elbow(log: vistel.log.Log, who: str, when: F64) -> F64:
    """How far the left one is bent at some times [degrees]."""
    name = f"participant.{who}.motion.left_elbow.angle"
    found = tracks(log, [name])[name]
    return np.interp(when, found.t, found.value)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("x.csv", "", "expected recorded motion (BVH), motion that a laboratory captured (C3D), a table (CSV)"),
        ("x.csv", "a,b,c\n1,2,3\n", "missing: t, sensor"),
        ("x.csv", f"{HEADING}\n0,head,1,2\n", "line 2: expected 9 columns with numbers"),
        ("x.csv", f"{HEADING}\n0,head,0,1.6,0,0,0,0,1\n0.01,nose,0,1.6,0,0,0,0,1\n", "line 3: no sensor is called 'nose'"),
        ("x.csv", f"{HEADING}\n0,head,nan,1.6,0,0,0,0,1\n", "line 2: expected finite numbers"),
        ("x.csv", f"{HEADING}\n0,head,0,1.6,0,90,0,0,0\n", "are these angles?"),
        ("x.csv", f"{HEADING}\n0,head,0,1.6,0,0,0,0,1\n", "at least two rows of each sensor; there is one of head"),
        ("x.csv", f"{HEADING}\n", "has no rows below its heading"),
        ("x.csv", "\x00\xff", "expected recorded motion (BVH), motion that a laboratory captured (C3D), a table (CSV)"),
        ("x.vrpn", "nothing", "expected recorded motion (BVH), motion that a laboratory captured (C3D), a table (CSV)"),
        ("x.vrpn", "vrpn: ver. 07.38  0\0\0\0\0\0", "no pose of a tracker"),
        ("x.bvh", "nothing", "expected recorded motion (BVH), motion that a laboratory captured (C3D), a table (CSV)"),
        ("x.mp3", "nothing", "expected recorded motion (BVH), motion that a laboratory captured (C3D), a table (CSV)"),
        ("x.txt", f"{HEADING}\n0,head,0,1.6,0,0,0,0,1\n", "expected .bvh"),
        ("no/such.csv", None, "no such file"),
        ("such.mp3", None, "no such file"),
        ("", None, "or with *_pose_saved.csv (a hand-over)"),
    ],
)
def test_what_cannot_be_imported_gets_one_line(tmp_path: Path, name: str, text: str | None, said: str) -> None:
    if text is not None:
        (tmp_path / name).write_text(text, "latin-1")
    done = call("import", tmp_path / name, "-o", tmp_path / "x.mcap")
    assert done.exit_code in (1, 2) and said in done.stderr, done.output
    assert "Traceback" not in done.output and not (tmp_path / "x.mcap").exists()


def short_table(folder: Path) -> Path:
    """Of a head alone, from which no posture can be computed."""
    table = folder / "short.csv"
    table.write_text(f"{HEADING}\n" + "".join(f"{t},head,0.1,1.6,0,0,0,0,1\n" for t in (0.0, 0.01)))
    return table


@pytest.mark.parametrize("before", [None, b"an earlier log"])
def test_a_table_from_which_no_posture_comes_is_refused_and_writes_nothing(tmp_path: Path, before: bytes | None) -> None:
    table, output = short_table(tmp_path), tmp_path / "x.mcap"
    if before is not None:
        output.write_bytes(before)
    done = call("import", table, "-o", output, "--force")
    assert done.exit_code == 1, done.output
    assert done.stdout == ""
    remark, *error = done.stderr.splitlines()
    assert remark.startswith("short.csv: moved by")  # it comes while the wait is told of there
    assert len(error) == 1 and "short.csv: no posture could be computed" in error[0] and "no log was written" in error[0]
    assert (output.read_bytes() if output.exists() else None) == before
    assert {f.name for f in tmp_path.iterdir()} <= {"short.csv", "x.mcap"}


def entry(kind: int, payload: bytes) -> bytes:
    return _ENTRY.pack(kind, 0, 10, 0, len(payload)) + payload


def named(kind: int, name: str) -> bytes:
    return entry(kind, (len(name) + 1).to_bytes(4, "big") + name.encode() + b"\0")


WHOLE = vrpn.COOKIE + named(vrpn.SENDER, "Tracker0") + named(vrpn.TYPE, vrpn.POSE)
WHOLE += entry(0, vrpn.pose_payload(0, (0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0)))


@settings(max_examples=60, deadline=None)
@given(data=st.binary(max_size=400), cut=st.integers(0, 400), at=st.integers(0, 10_000))
def test_no_capture_does_more_than_be_refused(tmp_path_factory: pytest.TempPathFactory, data: bytes, cut: int, at: int) -> None:
    path = tmp_path_factory.mktemp("capture") / "x.vrpn"
    path.write_bytes(WHOLE)
    assert read_capture(path).devices == ("Tracker0",)
    broken = bytearray(WHOLE[: max(0, len(WHOLE) - cut)] + data)
    if broken:
        broken[at % len(broken)] ^= 0x41
    path.write_bytes(broken)
    try:
        assert read_capture(path).devices
    except SensorError as e:
        assert "\n" not in str(e)


def test_who_already_faces_ahead_is_not_turned_by_minus_nothing(tmp_path: Path) -> None:
    ahead = tmp_path / "ahead.csv"
    ahead.write_text(f"{HEADING}\n" + "".join(f"{t},head,0.1,1.6,0,0,0,0,1\n" for t in (0.0, 0.01)))
    assert at_a_seat(read_table(ahead)).remark == "moved by 0.10 m and turned by 0° to the seat"
