"""Head and hands of a HoloLens become a log: a guest with a headset, whose fingers and wrists are where they were."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import vistel.log
from vistel.arrays import F64
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.log.headsets.head_and_hands import records
from vistel.log.headsets.hololens import HANDS, HEAD, read_recording
from vistel.log.sensors import SensorError
from vistel.protocol.pages.headset import headset_of
from vistel_cli.main import app
from vistel_sim.pages.headset import joints_of_hand

MEETING = Path(__file__).parents[1] / "replay" / "meeting.mcap"
HEIGHT_M = 1.82
SECONDS = 2.0
WORLD = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""From a figure's axes to x forward, y left, z up."""
Rows = dict[Path, list[list[float]]]


def pose(place: F64, turn: F64) -> list[float]:
    """Four rows of four."""
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = WORLD @ turn @ WORLD.T, WORLD @ place
    return whole.ravel().tolist()


def rows(seconds: float = SECONDS) -> Rows:
    """What a HoloLens on ben's head would have recorded, counted from where it was switched on."""
    skeleton = standard_skeleton(HEIGHT_M)
    found: Rows = {HEAD: [], **{file: [] for file in HANDS.values()}}
    on = None
    for n, (t, posture) in enumerate(vistel.log.open(MEETING).postures("ben", 0.0, seconds)):
        if n % 2:
            continue
        joints = pose_joints(skeleton, posture)
        eyes = 0.5 * (joints.position[JOINT_INDEX["left_eye"]] + joints.position[JOINT_INDEX["right_eye"]])
        on = eyes if on is None else on
        found[HEAD].append([t, 6.38e17 + 1e7 * t, *pose(eyes - on, joints.rotation[JOINT_INDEX["head"]])])
        for side, file in HANDS.items():
            hand = joints_of_hand(side, skeleton, joints) - on
            places = [hand[[0, 11]].mean(axis=0), *hand]
            poses = [number for place in places for number in pose(place, np.eye(3))]
            found[file].append([t, 6.38e17 + 1e7 * t, 1.0, *poses, *[1.0] * 52])
    return found


@pytest.fixture(scope="module")
def recorded() -> Rows:
    return rows()


def write(folder: Path, found: Rows) -> Path:
    for file, lines in found.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text("".join("\t".join(f"{x:.17g}" for x in line) + "\n" for line in lines))
    return folder


def copy(found: Rows) -> Rows:
    return {file: [list(line) for line in lines] for file, lines in found.items()}


def seen_from_the_head(log: vistel.log.Log, who: str, joints: tuple[str, ...]) -> tuple[F64, F64]:
    """Times (N,) [s] and places (N, J, 3) in the head's frame [m], of a figure of HEIGHT_M."""
    skeleton, times, places = standard_skeleton(HEIGHT_M), [], []
    for t, posture in log.postures(who):
        if t < SECONDS:
            made = pose_joints(skeleton, posture)
            head = JOINT_INDEX["head"]
            times.append(t)
            places.append((made.position[[JOINT_INDEX[j] for j in joints]] - made.position[head]) @ made.rotation[head])
    return np.array(times), np.array(places)


@pytest.mark.slow
def test_wrists_and_finger_tips_of_the_log_are_where_they_were(tmp_path: Path, recorded: Rows) -> None:
    folder = write(tmp_path / "R007" / "Export_py", recorded)
    done = CliRunner().invoke(app, ["log", "import", str(folder), "--height", str(HEIGHT_M), "-o", str(tmp_path / "log.mcap")])
    assert done.exit_code == 0, done.output
    log = vistel.log.open(tmp_path / "log.mcap")
    assert log.participants == ["r007"]
    joints = ("left_hand", "right_hand", "left_index_distal", "right_index_distal")
    t, here = seen_from_the_head(log, "r007", joints)
    was_t, was = seen_from_the_head(vistel.log.open(MEETING), "ben", joints)
    assert len(t) > 60
    late = t > t[0] + 0.7  # until then hands come from where they rested
    then = t[late] - log_begin(log) + was_t[0]
    there = np.array([[np.interp(then, was_t, was[:, j, k]) for k in range(3)] for j in range(len(joints))]).transpose(2, 0, 1)
    assert float(np.median(np.linalg.norm(there - here[late], axis=2))) < 0.05


def log_begin(log: vistel.log.Log) -> float:
    """When the first bytes of the headset were read [s]."""
    return min(m.t for m in log.messages("device_raw"))


def test_places_are_moved_to_a_seat_and_said_as_a_headset_would(tmp_path: Path, recorded: Rows) -> None:
    found = read_recording(write(tmp_path, recorded), HEIGHT_M)
    assert np.median(found.place, axis=0)[[0, 2]] == pytest.approx([0.0, 0.0], abs=0.15)
    assert np.median(found.turn[:, :, 2], axis=0)[2] > 0.9, "they face +z"
    said = list(records(found, 10**18))
    assert len(said) == len(found.t)
    frame = headset_of(said[5][1], 10**18 + round((said[5][0] - said[0][0]) * 1e9))
    assert frame is not None
    assert len(frame.left.joints) == len(frame.right.joints) == 75


def test_a_hand_that_is_not_seen_is_left_out(tmp_path: Path, recorded: Rows) -> None:
    found = copy(recorded)
    for line in found[HANDS["left"]][:10]:
        line[2] = 0.0
    for line in found[HANDS["right"]][:5]:
        line[-27 - 10] = 0.0  # one joint is not valid
    read = read_recording(write(tmp_path, found), HEIGHT_M)
    assert [int(np.isnan(read.hands[s]).any(axis=(1, 2)).sum()) for s in HANDS] == [10, 5]


def test_one_hand_is_enough(tmp_path: Path, recorded: Rows) -> None:
    found = {file: lines for file, lines in recorded.items() if file != HANDS["right"]}
    assert set(read_recording(write(tmp_path, found), HEIGHT_M).hands) == {"left"}


def test_rows_whose_time_goes_back_are_put_in_order_and_counted(tmp_path: Path, recorded: Rows) -> None:
    found = copy(recorded)
    found[HEAD] = found[HEAD][20:] + found[HEAD][:20]
    mixed = read_recording(write(tmp_path / "mixed", found), HEIGHT_M)
    was = read_recording(write(tmp_path / "was", recorded), HEIGHT_M)
    assert (mixed.back, was.back) == (1, 0)
    assert np.array_equal(mixed.place, was.place)


def _in_millimetres(found: Rows) -> None:
    for file, lines in found.items():
        first = 2 if file == HEAD else 3
        for line in lines:
            for begin in range(first, len(line) - 15 if file == HEAD else first + 26 * 16, 16):
                for k in (3, 7, 11):
                    line[begin + k] *= 1000.0


def _cut(found: Rows) -> None:
    found[HANDS["left"]][-1] = found[HANDS["left"]][-1][:200]


def _no_rotation(found: Rows) -> None:
    found[HEAD][3][2] = 7.0


def _not_finite(found: Rows) -> None:
    found[HEAD][3][5] = float("nan")


def _no_hands(found: Rows) -> None:
    for file in HANDS.values():
        for line in found[file]:
            line[2] = 0.0


def _no_head(found: Rows) -> None:
    del found[HEAD]


def _in_ticks(found: Rows) -> None:
    for line in found[HEAD]:
        line[0] = 1e7 * line[0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (_in_millimetres, r" m from wrist to knuckle; these look like mm: --unit mm$"),
        (_cut, r"Left_sync\.txt: line \d+: expected 471 numbers, got 200; is the file cut off\?$"),
        (_no_rotation, r"Head_sync\.txt: row 4: its matrix is no rotation$"),
        (_not_finite, r"Head_sync\.txt: line 4: expected finite numbers$"),
        (_no_hands, r"no hand is seen in it; expected .*Left_sync\.txt or .*Right_sync\.txt$"),
        (_no_head, r"Head_sync\.txt: cannot be read: No such file"),
        (_in_ticks, r"Head_sync\.txt: times are .* s apart, .* expected 1 Hz to 2000 Hz"),
    ],
)
def test_a_recording_that_cannot_be_used_gets_one_line(
    tmp_path: Path, recorded: Rows, change: Callable[[Rows], None], said: str
) -> None:
    found = copy(recorded)
    change(found)
    with pytest.raises(SensorError) as told:
        read_recording(write(tmp_path, found), HEIGHT_M)
    assert re.search(said, str(told.value)), str(told.value)
    assert "\n" not in str(told.value)


def test_text_that_is_no_table_of_numbers_gets_one_line(tmp_path: Path) -> None:
    (tmp_path / HEAD).parent.mkdir()
    (tmp_path / HEAD).write_text("hello, headset\n")
    with pytest.raises(SensorError, match=r"line 1: expected numbers, got 'hello, headset'"):
        read_recording(tmp_path, HEIGHT_M)
