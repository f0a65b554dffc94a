"""C3D: a person of a log, read back by ezc3d alone; files of others as sensors; and what is no such file."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import vistel.log
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.log.c3d import read_c3d, write_c3d
from vistel.log.numbers import skeleton_of
from vistel.log.sensors import SensorError
from vistel_cli.main import app

ezc3d = pytest.importorskip("ezc3d", reason="ezc3d is not installed (pip install 'vistel[c3d]')")

MEETING = Path(__file__).parents[1] / "replay" / "meeting.mcap"
FPS = 60.0


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["log", *map(str, arguments)], env={"COLUMNS": "160"})


@pytest.fixture(scope="module")
def ben(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three seconds of ben."""
    path = tmp_path_factory.mktemp("c3d") / "ben.c3d"
    done = call("export", MEETING, "-o", path, "--c3d", "ben", "--to", "3")
    assert done.exit_code == 0, done.output
    return path


def changed(ben: Path, path: Path, change: Callable[[Any], None]) -> Path:
    """`ben` as somebody else would have written him."""
    file = ezc3d.c3d(str(ben))
    del file["data"]["meta_points"]  # the library makes it anew from the points
    change(file)
    file.write(str(path))
    return path


def test_ezc3d_alone_reads_the_joints_in_millimetres_with_z_up(ben: Path) -> None:
    file = ezc3d.c3d(str(ben))
    points, places = file["parameters"]["POINT"], file["data"]["points"]
    assert (points["UNITS"]["value"], points["RATE"]["value"][0]) == (["mm"], FPS)
    log = vistel.log.open(MEETING)
    t, posture = next(log.postures("ben"))
    pose = pose_joints(skeleton_of(log, "ben"), posture)
    for joint in ("head", "left_hand", "right_foot"):
        x, y, z = places[:3, points["LABELS"]["value"].index(joint), 0] / 1000.0
        assert np.array([x, z, -y]) == pytest.approx(pose.position[JOINT_INDEX[joint]], abs=1e-4)
    assert places.shape[2] == pytest.approx(FPS * (3.0 - t), abs=3)


def test_what_was_written_is_read_as_sensors_and_becomes_a_log(ben: Path, tmp_path: Path) -> None:
    log, take = vistel.log.open(MEETING), read_c3d(ben)
    assert sorted(take.tracks) == ["chest", "head", "left_hand", "right_hand"]
    _, posture = next(log.postures("ben"))
    pose, track = pose_joints(skeleton_of(log, "ben"), posture), take.tracks["left_hand"]
    assert track.position[0] == pytest.approx(pose.position[JOINT_INDEX["left_hand"]], abs=1e-4)
    assert track.rotation[0] == pytest.approx(pose.rotation[JOINT_INDEX["left_hand"]], abs=1e-4)
    done = call("import", ben, "--height", "1.82", "-o", tmp_path / "ben.mcap")
    assert done.exit_code == 0, done.output
    assert len(list(vistel.log.open(tmp_path / "ben.mcap").postures("ben"))) > 100


def test_frames_in_which_a_mark_was_hidden_are_left_out(ben: Path, tmp_path: Path) -> None:
    def hide(file: Any) -> None:
        file["data"]["points"][:, file["parameters"]["POINT"]["LABELS"]["value"].index("head_x"), 5:9] = np.nan

    take = read_c3d(changed(ben, tmp_path / "hidden.c3d", hide))
    assert len(take.tracks["head"].t) == len(take.tracks["chest"].t) - 4
    assert np.diff(take.tracks["head"].t).max() == pytest.approx(5 / FPS)


def _unit(unit: str) -> Callable[[Any], None]:
    return lambda file: file["parameters"]["POINT"]["UNITS"].update(value=[unit])


def _y_up(file: Any) -> None:
    x, y, z = file["data"]["points"][:3].copy()
    file["data"]["points"][:3] = x, z, -y


def _in_one_line(file: Any) -> None:
    labels, points = file["parameters"]["POINT"]["LABELS"]["value"], file["data"]["points"]
    points[:, labels.index("head_y")] = points[:, labels.index("head_x")]


def _others(file: Any) -> None:
    labels = file["parameters"]["POINT"]["LABELS"]["value"]
    file["parameters"]["POINT"]["LABELS"]["value"] = [f"LASI{n}" for n in range(len(labels))]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (_unit("m"), r" m above the floor; these look like mm: --unit mm$"),
        (_unit("furlong"), r"POINT:UNITS is 'furlong'; say with --unit"),
        (_y_up, r"y looks like the height: --up y$"),
        (_in_one_line, r"head: its three points are in one line$"),
        (_others, r"its points are LASI0, LASI1, .*\.\.\.; expected three of each sensor: head_at, head_x, head_y"),
    ],
)
def test_a_file_of_others_that_cannot_be_used_gets_one_line(
    ben: Path, tmp_path: Path, change: Callable[[Any], None], said: str
) -> None:
    path = changed(ben, tmp_path / "other.c3d", change)
    with pytest.raises(SensorError) as told:
        read_c3d(path)
    assert re.search(said, str(told.value))
    assert str(told.value).startswith(str(path))
    assert "\n" not in str(told.value)


def test_units_and_axes_that_are_given_go_before_those_of_the_file(ben: Path, tmp_path: Path) -> None:
    path = changed(ben, tmp_path / "wrong.c3d", _unit("m"))
    assert read_c3d(path, unit="mm").tracks["head"].position == pytest.approx(read_c3d(ben).tracks["head"].position)


@pytest.mark.parametrize("left", [3, 600, 5_000])
def test_a_file_that_is_cut_off_gets_one_line(ben: Path, tmp_path: Path, left: int) -> None:
    path = tmp_path / "cut.c3d"
    path.write_bytes(ben.read_bytes()[:left])
    done = call("import", path, "-o", tmp_path / "cut.mcap")
    assert done.exit_code == 1
    assert "cut.c3d" in done.stderr
    assert done.stderr.strip().count("\n") == 0
    assert not (tmp_path / "cut.mcap").exists()


def test_text_that_is_called_c3d_is_told(tmp_path: Path) -> None:
    (tmp_path / "text.c3d").write_text("hello, this, is, no, file of motion\n")
    with pytest.raises(SensorError, match="does not begin as a C3D file"):
        read_c3d(tmp_path / "text.c3d")


def test_too_long_a_part_is_refused_before_it_is_written(tmp_path: Path) -> None:
    log = vistel.log.open(MEETING)
    with pytest.raises(ValueError, match="a C3D file holds 65535"):
        write_c3d(log, "ben", tmp_path / "long.c3d", fps=20_000.0)
    assert not (tmp_path / "long.c3d").exists()
