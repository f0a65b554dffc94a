"""Pictures for programs and notebooks: one line makes one, and what is wrong is said in one line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import moderngl
import numpy as np
import pytest
from figure_fixture import tube_person
from PIL import Image

import vistel.figure
import vistel.render
from vistel.figure.posed import PosedFigure
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX

SIZE = 320, 240
CAMERA = vistel.render.look_at((0.0, 1.0, 4.0), (0.0, 1.0, 0.0), 0.6)


def drawn(figure: PosedFigure) -> np.ndarray:
    return vistel.render.picture(figure, SIZE, CAMERA, light="fast").array.astype(int)


def pixel_of(figure: PosedFigure, joint: str) -> tuple[int, int]:
    """Row and column at which a joint is in the picture."""
    place = pose_joints(figure.avatar.skeleton, figure.posture).position[JOINT_INDEX[joint]]
    x, y, _ = CAMERA.project(place[None], *SIZE)[0]
    return round(float(y)), round(float(x))


@pytest.mark.gl
def test_a_bent_elbow_is_where_the_joints_say_and_nothing_is_where_the_forearm_was(surface: object) -> None:
    straight = PosedFigure(tube_person())
    bent = straight.pose(left_lower_arm=90)
    before, after = drawn(straight), drawn(bent)
    background = before[5, 5]
    was, now = pixel_of(straight, "left_hand"), pixel_of(bent, "left_lower_arm")
    assert np.abs(before[was] - background).max() > 25
    assert np.abs(after[was] - background).max() < 8
    assert np.abs(after[now] - background).max() > 25
    assert before.shape == (SIZE[1], SIZE[0], 3)


@pytest.mark.gl
def test_a_picture_is_saved_and_all_figures_are_in_it_wherever_they_stand(surface: object, tmp_path: Path) -> None:
    figure = PosedFigure(tube_person())
    picture = vistel.render.picture([figure.at(-1.0, 0.0), figure.at(1.0, 0.0, heading=30)], SIZE, light="fast")
    picture.save(tmp_path / "two.png")
    read = np.asarray(Image.open(tmp_path / "two.png"))
    assert (read == picture.array).all()
    other = (np.abs(read.astype(int) - read[5, 5]).max(axis=2) > 25).any(axis=0)
    assert other[: SIZE[0] // 2].any() and other[SIZE[0] // 2 :].any() and not other[0] and not other[-1]


def test_importing_loads_nothing_before_it_is_used() -> None:
    code = "import vistel.render, vistel.figure, sys; print('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "False"


@pytest.mark.parametrize(
    ("angles", "said"),
    [
        ({"left_lowerarm": 90}, "no joint 'left_lowerarm'; did you mean 'left_lower_arm'?"),
        ({"left_lower_arm": (1, 2)}, r"left_lower_arm: expected one angle in degrees, got \(1, 2\)"),
        ({"left_upper_arm": 90}, "left_upper_arm: expected 3 angles in degrees, got 90"),
        ({"right_index_proximal": 1}, "right_index_proximal: expected 2 angles in degrees, got 1"),
        ({"head": (0, float("nan"), 0)}, "head: expected finite angles"),
    ],
)
def test_what_is_no_joint_or_no_angle_of_it_is_reported_in_one_line(angles: dict, said: str) -> None:
    with pytest.raises(ValueError, match=said) as e:
        PosedFigure(tube_person()).pose(**angles)
    assert "\n" not in str(e.value)


def test_joints_turn_by_their_degrees_and_keep_them_when_others_turn() -> None:
    figure = PosedFigure(tube_person()).pose(left_lower_arm=30, right_index_proximal=(20, 5), left_lower_leg=45)
    turned = figure.pose(head=(0, 90, 0))
    rotation = pose_joints(turned.avatar.skeleton, turned.posture).rotation

    def angle(joint: str, parent: str) -> float:
        relative = rotation[JOINT_INDEX[parent]].T @ rotation[JOINT_INDEX[joint]]
        return float(np.degrees(np.arccos(np.clip((np.trace(relative) - 1.0) / 2.0, -1.0, 1.0))))

    assert angle("left_lower_arm", "left_upper_arm") == pytest.approx(30.0)
    assert angle("left_lower_leg", "left_upper_leg") == pytest.approx(45.0)
    assert angle("head", "spine_1") == pytest.approx(90.0, abs=1e-3)
    ankle = pose_joints(turned.avatar.skeleton, turned.posture).position[JOINT_INDEX["left_foot"]]
    assert ankle[2] < pose_joints(turned.avatar.skeleton, turned.posture).position[JOINT_INDEX["left_lower_leg"]][2]  # bends back


def test_who_is_not_built_in_is_reported_in_one_line() -> None:
    with pytest.raises(ValueError, match=r"no built-in person 'benn'; did you mean 'ben'\?"):
        vistel.figure.builtin("benn")
    with pytest.raises(ValueError, match=r"expected one of aiko, ben, carla, .*jonas, or a look such as"):
        vistel.figure.builtin("q")


def test_sizes_lights_and_machines_that_draw_nothing_are_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    figure = PosedFigure(tube_person())
    with pytest.raises(ValueError, match="size: expected width and height from 1 to 16384 pixels, got 0 x 480"):
        vistel.render.picture(figure, (0, 480))
    with pytest.raises(ValueError, match="light: expected 'fine' or 'fast', got 'best'"):
        vistel.render.picture(figure, light="best")

    def fails(**_: object) -> None:
        raise RuntimeError("libEGL.so not loaded")

    monkeypatch.setattr(moderngl, "create_context", fails)
    with pytest.raises(vistel.render.NoOpenGlError, match=r"no OpenGL 3\.3") as e:
        vistel.render.picture(figure)
    assert "\n" not in str(e.value)
