"""The joint chain, and the receivers that sit on it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.figure.posture.posture import DOF_COUNT, Posture, Stance, interpolate, pose_joints, rest_pose, standing
from vistel.figure.posture.sensors import (
    RECEIVERS,
    into_frame,
    joint_of_receiver,
    out_of_frame,
    receiver_mounts,
    receiver_poses,
    transmitter_in_room,
)
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS, finger_joints, measured_skeleton, standard_skeleton
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, rotation_y

SKELETON = standard_skeleton()


@given(height=st.floats(0.5, 2.6))
def test_a_person_is_as_tall_as_asked_and_stands_on_the_floor(height: float) -> None:
    skeleton = standard_skeleton(height)
    assert skeleton.height == pytest.approx(height)
    assert skeleton.rest[:, 1].min() == pytest.approx(0.02 * height / 1.75)


@pytest.mark.parametrize("height", [0.4, 2.7, math.nan])
def test_no_person_is_that_tall(height: float) -> None:
    with pytest.raises(ValueError, match="height"):
        standard_skeleton(height)


def test_parents_come_before_children_and_sides_mirror() -> None:
    assert all(PARENTS[j] < j for j in range(len(JOINTS)))
    for name in JOINTS:
        if name.startswith("left_"):
            right = JOINT_INDEX[name.replace("left_", "right_")]
            assert SKELETON.rest[JOINT_INDEX[name]] * (-1, 1, 1) == pytest.approx(SKELETON.rest[right])
    assert len(finger_joints("left")) == 15


def test_no_angles_give_the_rest_pose() -> None:
    pose, rest = pose_joints(SKELETON, Posture()), rest_pose(SKELETON)
    assert pose.position == pytest.approx(rest.position, abs=1e-12)
    assert pose.rotation == pytest.approx(rest.rotation, abs=1e-12)


@given(seed=st.integers(0, 1000))
def test_bones_keep_their_length_in_every_posture(seed: int) -> None:
    rng = np.random.default_rng(seed)
    dofs = rng.normal(scale=0.4, size=DOF_COUNT)
    dofs[5:8] = 0.0
    pose = pose_joints(SKELETON, Posture(dofs, rng.normal(scale=0.3, size=(2, 20)), Stance(rng.normal(size=3), 1.0)))
    for j, name in enumerate(JOINTS):
        # The spine bends by chords, collars shorten with the raised arm (mathematics M8.2, M8.5).
        if j == 0 or name.startswith(("spine", "neck")) or name.endswith(("shoulder", "upper_arm")):
            continue
        length = np.linalg.norm(pose.position[j] - pose.position[PARENTS[j]])
        assert length == pytest.approx(np.linalg.norm(SKELETON.offsets[j]), abs=1e-9), name


def test_a_measured_person_has_the_bones_measured() -> None:
    arm = np.array([0.31, 0.0, 0.0])
    own = measured_skeleton(SKELETON, {"left_lower_arm": arm})
    assert own.upper_arm == pytest.approx(0.31)
    # What hangs on it moves along; the other side stays.
    assert own.lower_arm == pytest.approx(SKELETON.lower_arm)
    assert own.rest[JOINT_INDEX["right_hand"]] == pytest.approx(SKELETON.rest[JOINT_INDEX["right_hand"]])


def test_between_two_postures_lies_the_middle_one() -> None:
    a, b = standing(), Posture(stance=Stance(np.array([0.0, 0.0, 1.0]), math.radians(-170)))
    b = Posture(b.dofs, b.hands + 1.0, b.stance, b.gaze)
    middle = interpolate(a, b, 0.5)
    assert middle.stance.position[2] == pytest.approx(0.5)
    assert middle.stance.heading == pytest.approx(math.radians(-85))
    assert middle.hands == pytest.approx(np.full((2, 20), 0.5))
    assert interpolate(a, b, 1.0).dofs == pytest.approx(b.dofs, abs=1e-9)


def test_who_faces_the_transmitters_x_reads_the_identity() -> None:
    transmitter = transmitter_in_room(np.array([1.0, 0.0, 2.0]), 0.7, (0.0, 0.25, 0.0), 0.0)
    person = Posture(stance=Stance(np.array([1.0, 0.0, 2.0]), 0.7))
    for name, pose in receiver_poses(SKELETON, pose_joints(SKELETON, person)).items():
        p, q = into_frame(transmitter, *pose)
        assert np.abs(q) == pytest.approx((0, 0, 0, 1), abs=1e-9), name
        # Above the transmitter is -Z; the left hand is at -Y.
        assert p[2] < -0.5
    left = into_frame(transmitter, *receiver_poses(SKELETON, pose_joints(SKELETON, person))["left_hand"])[0]
    assert left[1] < -0.5


def test_axes_of_a_turned_transmitter() -> None:
    p, q = transmitter_in_room(np.zeros(3), 0.0, (0.0, 0.0, 0.5), math.pi)
    axes = matrix_from_quaternion(q)
    assert p == pytest.approx((0, 0, 0.5))
    # +X back at the person, +Y to its own right (the person's left), +Z down.
    assert axes[:, 0] == pytest.approx((0, 0, -1), abs=1e-12)
    assert axes[:, 1] == pytest.approx((1, 0, 0), abs=1e-12)
    assert axes[:, 2] == pytest.approx((0, -1, 0), abs=1e-12)


@given(x=st.floats(-2, 2), heading=st.floats(-3, 3), turn=st.floats(-3, 3))
def test_into_a_frame_and_out_again(x: float, heading: float, turn: float) -> None:
    frame = transmitter_in_room(np.array([x, 0.0, 1.0]), heading, (0.1, 0.2, 0.3), turn)
    p, q = np.array([0.3, x, -0.2]), quaternion_from_matrix(rotation_y(turn))
    back_p, back_q = out_of_frame(frame, *into_frame(frame, p, q))
    assert back_p == pytest.approx(p, abs=1e-12)
    assert abs(float(back_q @ q)) == pytest.approx(1.0, abs=1e-12)


def test_a_joint_is_found_again_from_its_receiver() -> None:
    pose = pose_joints(SKELETON, standing())
    mounts = receiver_mounts(SKELETON)
    assert set(mounts) == set(RECEIVERS)
    for name, placed in receiver_poses(SKELETON, pose).items():
        p, r = joint_of_receiver(mounts[name], *placed)
        j = JOINT_INDEX[mounts[name].joint]
        assert p == pytest.approx(pose.position[j], abs=1e-12)
        assert r == pytest.approx(pose.rotation[j], abs=1e-9)


def test_a_richer_source_turns_single_joints_and_what_hangs_on_them_goes_along() -> None:
    plain = pose_joints(SKELETON, standing())
    raised = Posture(standing().dofs, joints={"left_upper_leg": np.array((-math.radians(60), 0.0, 0.0))})
    pose = pose_joints(SKELETON, raised)
    knee, foot, other = JOINT_INDEX["left_lower_leg"], JOINT_INDEX["left_foot"], JOINT_INDEX["right_foot"]
    assert pose.position[knee, 2] > plain.position[knee, 2] + 0.3
    assert np.linalg.norm(pose.position[foot] - pose.position[knee]) == pytest.approx(SKELETON.lower_leg)
    assert pose.position[other] == pytest.approx(plain.position[other], abs=1e-12)
    half = interpolate(Posture(standing().dofs, joints={"left_upper_leg": np.zeros(3)}), raised, 0.5)
    assert half.joints["left_upper_leg"] == pytest.approx((-math.radians(30), 0, 0))


def test_joints_as_they_are_change_nothing() -> None:
    dofs = np.random.default_rng(3).normal(scale=0.4, size=DOF_COUNT)
    plain = pose_joints(SKELETON, Posture(dofs))
    again = pose_joints(SKELETON, Posture(dofs, joints={"jaw": np.zeros(3)}))
    assert again.position == pytest.approx(plain.position, abs=1e-9)
    assert again.rotation == pytest.approx(plain.rotation, abs=1e-9)


def test_a_joint_of_no_such_name_is_named() -> None:
    with pytest.raises(KeyError, match="third_leg"):
        pose_joints(SKELETON, Posture(joints={"third_leg": np.zeros(3)}))
