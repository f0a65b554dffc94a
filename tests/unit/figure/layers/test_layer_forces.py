"""What muscles pull with, and what joints feel of it."""

from __future__ import annotations

import json
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from figure_fixture import tube_person
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.figure.layers.forces import (
    ECCENTRIC,
    FASTEST,
    Load,
    effort,
    force_length,
    force_velocity,
    joint_torques,
    passive_force,
    point_forces,
    speeds,
    strongest,
    surface_force,
    surface_ratio,
    tension,
)
from vistel.figure.layers.muscles import Muscles
from vistel.figure.layers.places import Places
from vistel.figure.posture.posture import ELBOW, KNEE, SHOULDER, JointPose, Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS
from vistel.implicit.ghosts.actuation import muscle_force

GOLDEN = {r["name"]: r for r in json.loads((Path(__file__).parents[3] / "golden.json").read_text())["values"]}


@cache
def muscles() -> Muscles:
    return Muscles.of(Places(tube_person()))


def joints(posture: Posture) -> JointPose:
    return pose_joints(muscles().skeleton, posture)


def bent(elbow: float = 0.0, knee: float = 0.0, hang: float = 0.0) -> Posture:
    dofs = Posture().dofs.copy()
    dofs[KNEE] = knee
    for side, sign in (("left", -1.0), ("right", 1.0)):
        dofs[ELBOW[side]], dofs[SHOULDER[side]] = elbow, (0.0, 0.0, sign * hang)
    return Posture(dofs)


@pytest.mark.parametrize("ratio", [0.4, 0.65])
def test_the_force_of_a_blend_function_is_the_golden_one(ratio: float) -> None:
    row = next(r for n, r in GOLDEN.items() if n.startswith("muscle force") and r["inputs"]["xstar"] == ratio)
    assert muscle_force(ratio) == pytest.approx(row["expected"], abs=row["tolerance"])


def test_the_surface_of_an_active_muscle_pushes_out_the_more_the_more_active() -> None:
    course = [surface_force(a) for a in np.linspace(0.0, 1.0, 11)]
    assert course[0] == pytest.approx(0.0, abs=1e-12)
    assert np.all(np.diff(course) > 0)
    assert surface_ratio(5.0) == 0.85


def test_nothing_pulls_at_rest() -> None:
    assert np.abs(tension(muscles(), joints(Posture()))).max() < 1e-9
    assert np.abs(joint_torques(muscles(), joints(Posture()), tension(muscles(), joints(Posture())))).max() < 1e-9


def test_a_muscle_pulls_most_near_its_length_of_rest_and_least_when_fast() -> None:
    assert force_length(1.0) == 1.0
    assert np.all(np.diff(force_length(np.linspace(0.5, 1.0, 20))) > 0)
    assert np.all(np.diff(passive_force(np.linspace(1.0, 1.6, 20))) > 0)
    assert passive_force(1.6) == pytest.approx(1.0)
    v = np.linspace(-FASTEST, FASTEST, 401)
    f = force_velocity(v)
    assert np.all(np.diff(f) <= 1e-12)
    assert f[-1] == 0.0
    assert 1.0 < f[0] < ECCENTRIC
    slope = np.gradient(f, v)
    assert np.abs(np.diff(slope[195:206])).max() < 0.1  # no corner where it turns round


@settings(max_examples=20, deadline=None)
@given(st.floats(0.05, 2.4), st.floats(0.0, 1.2), st.floats(0.0, 1.3))
def test_inner_forces_cancel_and_torques_do_the_work_of_the_pulls(elbow: float, knee: float, hang: float) -> None:
    pull = np.linspace(10.0, 200.0, len(muscles()))
    pose = joints(bent(elbow, knee, hang))
    _, force = point_forces(muscles(), pose, pull)
    assert np.abs(force.sum(axis=0)).max() < 1e-9
    h = 1e-6
    torque = joint_torques(muscles(), pose, pull)
    for name, axis, turned in (
        ("left_lower_arm", (0.0, -1.0, 0.0), lambda d: bent(elbow + d, knee, hang)),
        ("right_lower_arm", (0.0, 1.0, 0.0), lambda d: bent(elbow + d, knee, hang)),
    ):
        side = [i for i, n in enumerate(muscles().names) if n.startswith(name[:4])]
        longer = (muscles().lengths(joints(turned(h))) - muscles().lengths(joints(turned(-h)))) / (2 * h)
        j = JOINT_INDEX[name]
        about = float(torque[j] @ (pose.rotation[PARENTS[j]] @ np.array(axis)))
        assert about == pytest.approx(-float(longer[side] @ pull[side]), rel=1e-4, abs=1e-4)


def test_biceps_bends_the_elbow_and_triceps_straightens_it() -> None:
    pose = joints(bent(1.2))
    for name, sign in (("left_biceps", -1.0), ("left_triceps", 1.0)):
        pull = np.where(np.array(muscles().names) == name, 100.0, 0.0)
        about = joint_torques(muscles(), pose, pull)[JOINT_INDEX["left_lower_arm"]]
        y = float(about @ pose.rotation[JOINT_INDEX["left_upper_arm"]] @ np.array((0.0, 1.0, 0.0)))
        assert sign * y > 0.5, name  # more than half a centimetre of lever


def test_a_weight_in_the_hand_is_held_by_the_muscles_that_bend_the_elbow() -> None:
    pose = joints(bent(math.pi / 2, hang=math.pi / 2))
    at = pose.position[JOINT_INDEX["left_middle_proximal"]]
    none = effort(muscles(), pose, [])
    held = {kg: effort(muscles(), pose, [Load("left_hand", at, np.array((0.0, -9.81 * kg, 0.0)))]) for kg in (2.0, 5.0)}
    names = muscles().names
    biceps, other = names.index("left_biceps"), names.index("right_biceps")
    assert held[5.0].active[biceps] > held[2.0].active[biceps] > none.active[biceps]
    assert held[5.0].active[other] == pytest.approx(none.active[other], abs=1e-6)
    assert np.abs(held[2.0].missing[JOINT_INDEX["left_lower_arm"]]).max() < 0.5
    assert held[5.0].active.max() <= 1.0
    assert held[5.0].missing.shape == (len(JOINTS), 3)
    assert np.all(held[5.0].pull <= strongest(muscles()) * 2.1)


def test_shortening_is_measured_in_lengths_a_second() -> None:
    fast = speeds(muscles(), joints(bent(0.5)), joints(bent(1.0)), 0.1)
    assert fast[muscles().names.index("left_biceps")] > 0.1
    assert fast[muscles().names.index("left_triceps")] < -0.1
    slow = tension(muscles(), joints(bent(1.0)), None, fast)
    still = tension(muscles(), joints(bent(1.0)))
    assert slow[muscles().names.index("left_biceps")] < still[muscles().names.index("left_biceps")]
