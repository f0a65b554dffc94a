"""Frames of a Leap Motion become a log: a guest whose hands are over the table, with the fingers as the sensor saw them."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import vistel.log
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.log.headsets.head_and_hands import records
from vistel.log.headsets.leap import SENSOR_AT, frames_of, read_leap
from vistel.log.headsets.lz_string import LzStringError, decompressed
from vistel.log.sensors import SensorError
from vistel_cli.kind_of_file import LEAP, kind_of_file
from vistel_cli.main import app

HEIGHT_M = 1.75
Frame = dict[str, Any]


def frame(n: int, side: str = "right", bend: float = 0.0) -> Frame:
    """An open hand 200 mm over the sensor, whose finger tips go down by `bend` mm."""
    sign = 1.0 if side == "right" else -1.0
    hand = {"id": 7, "type": side, "direction": [0.0, 0.0, -1.0], "palmNormal": [0.0, -1.0, 0.0], "confidence": 1.0}
    fingers: list[Frame] = []
    for kind in range(5):
        x, along = sign * (-40.0 + 20.0 * kind), 30.0 if kind == 0 else 0.0
        places = {
            name: [x, 200.0 - k * k * bend / 9.0, along - reach]
            for k, (name, reach) in enumerate(
                zip(("mcpPosition", "pipPosition", "dipPosition", "tipPosition"), (0.0, 45.0, 71.0, 88.0), strict=True)
            )
        }
        fingers.append({"handId": 7, "type": kind, "tool": False, **places})
    return {"id": n, "timestamp": 1_000_000 + 9_000 * n, "hands": [hand], "pointables": fingers}


def frames(count: int = 40) -> list[Frame]:
    return [frame(n) for n in range(count)]


def written(path: Path, found: list[Frame]) -> Path:
    path.write_text(json.dumps({"metadata": {"formatVersion": 1}, "frames": found}))
    return path


def packed(found: list[Frame]) -> list[Any]:
    """As leapjs-playback packs: the first tells what stands where in the others."""
    hand = ["id", "type", "direction", "palmNormal", "confidence"]
    finger = ["handId", "type", "tool", "mcpPosition", "pipPosition", "dipPosition", "tipPosition"]
    form: list[Any] = ["id", "timestamp", {"hands": [hand]}, {"pointables": [finger]}]
    rows = [
        [f["id"], f["timestamp"], [[h[k] for k in hand] for h in f["hands"]], [[p[k] for k in finger] for p in f["pointables"]]]
        for f in found
    ]
    return [form, *rows]


def test_places_are_those_over_the_sensor_on_the_table(tmp_path: Path) -> None:
    found = read_leap(written(tmp_path / "open.json", frames()), HEIGHT_M)
    assert set(found.hands) == {"right"}
    wrist, thumb, knuckle, tip = (found.hands["right"][0, n] - SENSOR_AT for n in (0, 1, 11, 14))
    assert knuckle == pytest.approx([0.0, 0.2, 0.0])
    assert tip == pytest.approx([0.0, 0.2, 0.088]), "fingers point away from the person"
    assert thumb[0] == pytest.approx(0.04), "a right hand's thumb is to the person's left"
    assert wrist[2] == pytest.approx(-0.0874, abs=0.001)
    assert found.seconds == pytest.approx(39 * 0.009)
    assert len(list(records(found, 10**18))) == 40, "somebody who sits there can do it"


def test_a_wrist_that_the_sensor_tells_is_taken(tmp_path: Path) -> None:
    found = frames()
    for one in found:
        one["hands"][0]["wrist"] = [5.0, 190.0, 90.0]
    read = read_leap(written(tmp_path / "a.json", found), HEIGHT_M)
    assert read.hands["right"][0, 0] - SENSOR_AT == pytest.approx([-0.005, 0.19, -0.09])


def test_lines_of_frames_and_packed_frames_say_the_same_as_plain_ones(tmp_path: Path) -> None:
    plain = read_leap(written(tmp_path / "plain.json", frames()), HEIGHT_M)
    (tmp_path / "lines.json").write_text("".join(json.dumps(f) + "\n" for f in frames()))
    (tmp_path / "packed.json").write_text(json.dumps({"metadata": {}, "frames": packed(frames())}))
    for name in ("lines.json", "packed.json"):
        other = read_leap(tmp_path / name, HEIGHT_M)
        assert np.array_equal(other.hands["right"], plain.hands["right"])
        assert np.array_equal(other.t, plain.t)
        assert kind_of_file(tmp_path / name) is LEAP


def test_frames_without_a_hand_are_gaps_and_times_that_go_back_are_counted(tmp_path: Path) -> None:
    found = frames()
    found[3]["hands"], found[4]["hands"][0]["confidence"] = [], 0.1
    del found[5]["pointables"][2]
    found = found[20:] + found[:20]
    read = read_leap(written(tmp_path / "a.json", found), HEIGHT_M)
    assert read.back == 1
    assert np.flatnonzero(np.isnan(read.hands["right"]).any(axis=(1, 2))).tolist() == [3, 4, 5]


def _no_time(found: list[Frame]) -> None:
    del found[2]["timestamp"]


def _no_number(found: list[Frame]) -> None:
    found[2]["pointables"][1]["dipPosition"][1] = "far"


def _two_numbers(found: list[Frame]) -> None:
    found[2]["pointables"][1]["dipPosition"].pop()


def _in_metres(found: list[Frame]) -> None:
    for one in found:
        for finger in one["pointables"]:
            for name in ("mcpPosition", "pipPosition", "dipPosition", "tipPosition"):
                finger[name] = [0.001 * x for x in finger[name]]


def _nobody(found: list[Frame]) -> None:
    for one in found:
        one["hands"].clear()


def _once(found: list[Frame]) -> None:
    del found[1:]


def _in_seconds(found: list[Frame]) -> None:
    for one in found:
        one["timestamp"] *= 1e-6


def _hands_of_text(found: list[Frame]) -> None:
    found[2]["hands"] = "two"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (_no_time, r"a\.json: frame 3: timestamp: expected a finite number, got 'None'$"),
        (_no_number, r"a\.json: frame 3: dipPosition: expected a finite number, got 'far'$"),
        (_two_numbers, r"a\.json: frame 3: dipPosition: expected three numbers$"),
        (_in_metres, r" mm from wrist to knuckle; these look like m: --unit m$"),
        (_nobody, r"a\.json: no hand with all its fingers is seen in it$"),
        (_once, r"a\.json: has 1 frames, expected at least 2$"),
        (_in_seconds, r"a\.json: times are .* s apart"),
        (_hands_of_text, r"a\.json: frame 3: hands: expected a list of objects$"),
    ],
)
def test_frames_that_cannot_be_used_get_one_line(tmp_path: Path, change: Callable[[list[Frame]], None], said: str) -> None:
    found = copy.deepcopy(frames())
    change(found)
    with pytest.raises(SensorError) as told:
        read_leap(written(tmp_path / "a.json", found), HEIGHT_M)
    assert re.search(said, str(told.value)), str(told.value)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{}", r"expected frames of leapjs"),
        ("[" * 100_000, r"expected frames of leapjs"),
        ('{"frames": [[1], [2]]}', r"frame 1: the first frame does not tell"),
        ('{"frames": [["a", "b"], [2]]}', r"frame 1: does not have the values"),
        (
            '{"frames": [' + '[{"a": ' * 50 + "[]" + "}]" * 50 + ", " + "[" * 51 + "]" * 51 + "]}",
            r"frame 1: does not have the values",
        ),
        ('{"frames": [1, 2]}', r"frame 1: expected an object with `timestamp`"),
        ('{"timestamp": 1}\n{"timestamp": ', r"line 2: expected an object .* is the file cut off"),
        ('{"frames": [{"timestamp": NaN}]}', r"timestamp: expected a finite number"),
        ('{"frames": [{"timestamp": 1' + "0" * 400 + "}]}", r"timestamp: expected a finite number"),
    ],
)
def test_other_json_gets_one_line(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(SensorError, match=said):
        read_leap(tmp_path / "a.json", HEIGHT_M)


def test_what_lzstring_has_not_made_is_refused(tmp_path: Path) -> None:
    for text, said in (("a{b", "no letter of base64"), ("N4Ig", "cut off"), ("/" * 40, "a word that it has not|cut off")):
        with pytest.raises(LzStringError, match=said):
            decompressed(text, 1000)
        (tmp_path / "a.json.lz").write_text(text)
        with pytest.raises(SensorError, match="is not compressed by LZString"):
            read_leap(tmp_path / "a.json.lz", HEIGHT_M)


def test_recordings_of_leap_itself_are_read_and_a_text_that_grows_is_ended(shared_data: Path) -> None:
    path = shared_data / "hand/leap/grab.json.lz"
    assert kind_of_file(path) is LEAP
    assert len(list(frames_of(path))) == 374
    found = read_leap(path, HEIGHT_M)
    hand = found.hands["right"]
    tips = np.linalg.norm(hand[:, [9, 14, 19, 24]] - hand[:, [0]], axis=2).mean(axis=1)
    assert float(np.nanmax(tips)) > 0.15 and float(np.nanmin(tips)) < 0.11, "it opens and closes"
    with pytest.raises(LzStringError, match="longer than 1000 letters"):
        decompressed(path.read_text(), 1000)


@pytest.mark.slow
def test_a_hand_of_the_log_closes_when_the_recorded_one_does(shared_data: Path, tmp_path: Path) -> None:
    path = shared_data / "hand/leap/grab.json.lz"
    done = CliRunner().invoke(app, ["log", "import", str(path), "-o", str(tmp_path / "log.mcap")])
    assert done.exit_code == 0, done.output
    log = vistel.log.open(tmp_path / "log.mcap")
    assert log.participants == ["grab"]
    read = read_leap(path, HEIGHT_M)
    hand = read.hands["right"]
    was = np.linalg.norm(hand[:, 13] - hand[:, 0], axis=1)
    first = min(m.t for m in log.messages("device_raw"))
    skeleton, joints = standard_skeleton(HEIGHT_M), [JOINT_INDEX[f"right_{j}"] for j in ("middle_distal", "hand")]
    times, now = [], []
    for t, posture in log.postures("grab"):
        tip, wrist = pose_joints(skeleton, posture).position[joints]
        times.append(t - first)
        now.append(float(np.linalg.norm(tip - wrist)))
    late = np.array(times) > 0.7  # until then hands come from where they rested
    then = np.interp(np.array(times)[late], read.t - read.t[0], was)
    now = np.array(now)[late]
    assert float(np.corrcoef(then, now)[0, 1]) > 0.9
    assert float(np.ptp(now)) > 0.8 * float(np.ptp(then))
