"""What drives wrinkles: angles of joints, action units, curves."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.figure.posture.posture import ELBOW, SHOULDER, Posture, pose_joints, rest_pose, standing
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.geometry.rotation import matrix_from_rotvec
from vistel.wrinkle.drive import Drive, DriveCurve, rotation_angle
from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.worn import Memory
from vistel.wrinkle.wrinkle_sets import load_sets, wrinkle_sets

SKELETON = standard_skeleton(1.75)


def _bent(degrees: float, side: str = "left") -> Posture:
    dofs = standing().dofs.copy()
    dofs[ELBOW[side]] = math.radians(degrees)
    return Posture(dofs)


@given(st.floats(-50.0, 250.0))
def test_a_straight_curve_is_the_clamped_share_of_the_way_between_two_angles(angle: float) -> None:
    curve = DriveCurve(knots=[(20.0, 0.0), (120.0, 1.0)], form="linear")
    assert curve(angle) == pytest.approx(min(1.0, max(0.0, (angle - 20.0) / 100.0)))


def test_a_smooth_curve_passes_its_knots_level_and_never_beyond_them() -> None:
    curve = DriveCurve(knots=[(0.0, 0.0), (40.0, 1.0), (100.0, 0.3)])
    assert [curve(x) for x in (-5.0, 0.0, 40.0, 100.0, 200.0, math.nan)] == [0.0, 0.0, 1.0, 0.3, 0.3, 0.0]
    assert abs(curve(40.5) - 1.0) < 1e-3
    assert all(0.0 <= curve(x) <= 1.0 for x in np.linspace(-10, 120, 200))


@given(st.floats(0.0, 150.0))
def test_an_elbow_drives_by_how_far_it_is_bent(degrees: float) -> None:
    joints = pose_joints(SKELETON, _bent(degrees))
    drive = Drive(joint="lower_arm", curve=DriveCurve(knots=[(0.0, 0.0), (180.0, 1.0)], form="linear"))
    assert drive.value(joints, {}, "left_") == pytest.approx(degrees, abs=1e-5)
    assert drive.value(joints, {}, "right_") == pytest.approx(0.0, abs=1e-5)


def test_about_an_axis_an_angle_has_a_sign_and_is_mirrored_on_the_right() -> None:
    dofs = np.zeros(25)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[SHOULDER[side]] = (0.0, 0.0, sign * math.radians(30.0))
    joints = pose_joints(SKELETON, Posture(dofs))
    drive = Drive(joint="upper_arm", axis=(0.0, 0.0, 1.0), curve=DriveCurve(knots=[(-90.0, 0.0), (90.0, 1.0)]))
    assert drive.value(joints, {}, "left_") == pytest.approx(30.0)
    assert drive.value(joints, {}, "right_") == pytest.approx(30.0)
    hanging = pose_joints(SKELETON, standing())
    assert drive.value(hanging, {}, "left_") == pytest.approx(-80.0)


def test_the_angle_of_a_joint_is_twice_the_arc_cosine_of_its_quaternions_real_part() -> None:
    rotation = np.tile(np.eye(3), (len(JOINT_INDEX), 1, 1))
    joint = JOINT_INDEX["left_lower_arm"]
    rotation[joint] = matrix_from_rotvec(np.array((0.3, -0.5, 0.2)))
    joints = rest_pose(SKELETON).__class__(rotation, SKELETON.rest)
    assert rotation_angle(joints, joint) == pytest.approx(math.sqrt(0.38))


def test_an_action_unit_drives_its_side_or_both_and_is_nothing_where_unknown() -> None:
    drive = Drive(action="AU6", curve=DriveCurve(knots=[(0.0, 0.0), (1.0, 1.0)]))
    joints = rest_pose(SKELETON)
    assert drive.weight(joints, {"AU6": 1.0}, "left_") == 1.0
    assert drive.weight(joints, {"right_AU6": 1.0}, "left_") == 0.0
    assert drive.weight(joints, {}) == 0.0


SET = """
[[sets]]
name = "mine"
region = "sleeve"
drive = { joint = "lower_arm", curve = { knots = [[20, 0], [90, 1]] } }
[[sets.wrinkles]]
shape = "twist"
at = [0.3, 0.5]
size = 0.05
thickness = 0.01
intensity = 0.004
"""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SET.replace("sleeve", "sleeves"), "sets[0].region: is 'sleeves', expected one of sleeve, trouser_leg, trunk, neck, face"),
        (SET.replace("[[20, 0], [90, 1]]", "[[90, 0], [20, 1]]"), "knots' values are 90, 20; expected each above the one before"),
        (SET.replace("lower_arm", "elbow"), "there is no joint 'elbow'"),
        (SET.replace('joint = "lower_arm", ', ""), "give a joint or an action, one of the two"),
        (SET.replace("[20, 0]", "[20, 2]"), "sets[0].drive.curve.knots[0][1]: is 2, expected at most 1"),
        (SET.replace("at = [0.3, 0.5]", "at = [0.3, 1.5]"), "wrinkles[0]: leaves the texture at 0.300, 1.500"),
        (SET + "width = 3", "sets[0].wrinkles[0].width: unknown key; expected one of shape, at,"),
        (SET.split("[[sets.wrinkles]]", maxsplit=1)[0], "sets[0]: has neither wrinkles nor pull"),
    ],
)
def test_a_file_of_sets_that_cannot_be_used_is_reported_in_one_line(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(WrinkleError) as fault:
        load_sets(path)
    assert said in str(fault.value)
    assert len(str(fault.value).splitlines()) == 1


def test_wrinkles_of_an_unknown_name_are_an_error() -> None:
    with pytest.raises(WrinkleError, match="no wrinkles called 'kilt'; there are face, hands, shirt, trousers"):
        wrinkle_sets(["kilt"])


def test_built_in_sets_cover_several_sets_in_one_region_and_joints_and_action_units() -> None:
    sets = wrinkle_sets()
    assert sum(s.region.name == "sleeve" for s in sets) >= 2
    assert any(s.entry.drive.action for s in sets)
    assert any(s.entry.pull for s in sets)


def test_cloth_remembers_a_share_of_what_it_was_bent_to_and_forgets_it() -> None:
    memory, share = Memory(rise=1.0, fall=20.0), np.array([0.3])
    kept, shown = np.zeros(1), np.zeros(1)
    for _ in range(100):
        kept, shown = memory.step(kept, np.array([1.0]), share, 0.1)
    assert shown[0] == 1.0
    kept, shown = memory.step(kept, np.array([0.0]), share, 0.1)
    assert 0.25 < shown[0] <= 0.3
    for _ in range(100):
        kept, shown = memory.step(kept, np.array([0.0]), share, 0.1)
    assert 0.15 < shown[0] < 0.2
    for _ in range(2000):
        kept, shown = memory.step(kept, np.array([0.0]), share, 0.1)
    assert shown[0] < 1e-3


@given(st.floats(0.01, 2.0), st.integers(1, 20))
def test_memory_does_not_depend_on_how_time_is_cut(seconds: float, steps: int) -> None:
    memory, weights, share = Memory(), np.array([0.7]), np.array([0.5])
    once, _ = memory.step(np.array([0.2]), weights, share, seconds)
    kept = np.array([0.2])
    for _ in range(steps):
        kept, _ = memory.step(kept, weights, share, seconds / steps)
    assert kept == pytest.approx(once)
