"""Held things in a picture: with the shown hand at once, back to the world's word without a jump."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vistel.figure.posture.posture import Posture, Stance, pose_joints, standing
from vistel.figure.skeleton import standard_skeleton
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.render.stage.held import AGREES, BLEND_NS, HeldThings, ShownPerson
from vistel.render.stage.world_view import PlayoutWorld
from vistel.space.people import HAND_JOINT
from vistel.v1 import geometry_pb2
from vistel.v1.geometry_pb2 import Quaternion, Vec3
from vistel.v1.world_pb2 import Grasp

FRAME = 16_666_667
SKELETON = standard_skeleton()
HOLD = np.array([-0.088, -0.03, 0.0])
GRASP = Grasp(
    participant="ann",
    right=True,
    thing="baton",
    hold=geometry_pb2.Pose(position=Vec3(x=-0.088, y=-0.03), rotation=Quaternion(w=1.0)),
    fingers=[500] * 20,
)
BEHIND = 4
"""Frames the world's word comes after the motion it follows from."""


def walking(k: int) -> Posture:
    """Somebody whose hand goes to and fro at up to 1.4 m/s."""
    p = standing()
    return Posture(p.dofs, p.hands, Stance(np.array([0.3 * math.sin(4.7 * k / 60), 0.0, 0.0]), 0.0))


def shown(k: int) -> ShownPerson:
    return ShownPerson(walking(k), pose_joints(SKELETON, walking(k)))


def in_hand(k: int, right: bool = True) -> np.ndarray:
    pose, j = pose_joints(SKELETON, walking(k)), HAND_JOINT[int(right)]
    return pose.position[j] + pose.rotation[j] @ HOLD


TURN = quaternion_from_matrix(pose_joints(SKELETON, walking(0)).rotation[HAND_JOINT[1]])


def world(at: np.ndarray, *grasps: Grasp) -> PlayoutWorld:
    return PlayoutWorld(1, {"baton": Pose(at, TURN)}, grasps=grasps)


def play(held: HeldThings, views: list[PlayoutWorld], first: int = 0) -> np.ndarray:
    """(n, 3) where the baton is drawn, frame by frame."""
    out = []
    for i, view in enumerate(views):
        k = first + i
        out.append(held.poses(k * FRAME, view, {"ann": shown(k)}).poses["baton"][0])
    return np.array(out)


def test_a_held_thing_goes_with_the_hand_that_is_shown_not_behind_it() -> None:
    n = 90
    views = [world(in_hand(k - BEHIND), GRASP) for k in range(n)]
    drawn = play(HeldThings(), views)
    hand = np.array([in_hand(k) for k in range(n)])
    said = np.array([v.poses["baton"][0] for v in views])
    assert np.linalg.norm(said - hand, axis=1).max() > 0.08  # so far behind the world's word is
    assert np.linalg.norm(drawn - hand, axis=1)[2 * BEHIND :].max() < 1e-6


def test_taking_and_letting_go_change_over_without_a_jump() -> None:
    rest, n = in_hand(-BEHIND) + np.array([0.0, -0.03, 0.02]), 60
    views = [world(rest) for _ in range(10)]
    views += [world(in_hand(k - BEHIND), GRASP) for k in range(10, n)]
    # Let go, it falls from where the world has it.
    start, speed = in_hand(n - 1 - BEHIND), (in_hand(n - 1 - BEHIND) - in_hand(n - 2 - BEHIND)) * 60.0
    falls = [(k + 1) / 60 for k in range(40)]
    views += [world(start + speed * t - np.array([0.0, 4.905 * t * t, 0.0])) for t in falls]
    drawn = play(HeldThings(), views)
    step = np.linalg.norm(np.diff(drawn, axis=0), axis=1)
    said = np.linalg.norm(np.diff([v.poses["baton"][0] for v in views], axis=0), axis=1)
    hand = np.linalg.norm(np.diff([in_hand(k) for k in range(len(views))], axis=0), axis=1)
    # A frame moves it as the hand or the world does, and by its share of the offset: the blend lasts 12 frames.
    offset = float(np.linalg.norm(in_hand(10) - rest))
    assert (step - np.maximum(said, hand)).max() < 1.5 * offset * FRAME / BLEND_NS + 1e-3
    assert np.linalg.norm(drawn[-1] - views[-1].poses["baton"][0]) < 1e-9


def test_what_the_world_keeps_from_following_the_hand_is_drawn_where_the_world_has_it() -> None:
    """The hand goes through the table top; the thing stays on it."""
    n = 90
    stuck = in_hand(0)
    views = [world(in_hand(k - BEHIND) if k < 30 else stuck + np.array([0.0, 0.2, 0.0]), GRASP) for k in range(n)]
    drawn = play(HeldThings(), views)
    assert np.linalg.norm(drawn[-1] - views[-1].poses["baton"][0]) < AGREES
    assert np.linalg.norm(np.diff(drawn, axis=0), axis=1).max() < 0.08


def test_a_thing_in_two_hands_is_where_the_world_balances_it() -> None:
    other = Grasp(participant="bob", thing="baton")
    views = [world(in_hand(k - BEHIND), GRASP, other) for k in range(60)]
    drawn = play(HeldThings(), views)
    assert np.abs(drawn - np.array([v.poses["baton"][0] for v in views])).max() < 1e-9


def test_a_rejected_hold_goes_back_to_who_has_it_within_the_blend() -> None:
    """The world gives the thing to somebody else, far away."""
    there = in_hand(0) + np.array([0.4, 0.0, 0.3])
    other = Grasp(participant="bob", thing="baton")
    views = [world(in_hand(k - BEHIND), GRASP) for k in range(40)] + [world(there, other) for _ in range(30)]
    drawn = play(HeldThings(), views)
    step = np.linalg.norm(np.diff(drawn, axis=0), axis=1)
    assert step.max() < 1.5 * 0.85 * FRAME / BLEND_NS + 0.005
    assert np.linalg.norm(drawn[-1] - there) < 1e-9


def test_fingers_come_onto_what_is_held_and_off_it_again_without_a_jump() -> None:
    held, angles = HeldThings(), []
    for k in range(90):
        view = world(in_hand(k), GRASP) if 20 <= k < 50 else world(in_hand(k))
        out = held.fingers((k + 100) * FRAME, view, {"ann": walking(k)})
        angles.append(out["ann"].hands[1, 4])
        assert out["ann"].hands[0] == pytest.approx(walking(k).hands[0])
    assert angles[10] == angles[-1] == walking(0).hands[1, 4]
    assert angles[45] == pytest.approx(0.5, abs=1e-3)
    assert np.abs(np.diff(angles)).max() < 0.1


def test_rotation_is_predicted_too() -> None:
    view = HeldThings().poses(0, world(in_hand(0), GRASP), {"ann": shown(0)})
    r = matrix_from_quaternion(view.poses["baton"][1])
    assert r == pytest.approx(matrix_from_quaternion(TURN), abs=1e-9)


def test_a_hand_is_drawn_where_what_it_cannot_move_lies_in_it() -> None:
    held, j = HeldThings(), HAND_JOINT[1]
    prop = Grasp()
    prop.CopyFrom(GRASP)
    prop.seen.CopyFrom(GRASP.hold)
    prop.seen.position.y = -0.045  # out of the palm by 15 mm
    hands = []
    for k in range(30):
        view = held.poses(k * FRAME, world(in_hand(0), prop), {"ann": shown(0)})
        drawn = held.fingers(k * FRAME, view, {"ann": walking(0)})["ann"]
        hands.append(pose_joints(SKELETON, drawn).position[j])
    last = pose_joints(SKELETON, drawn)
    lies = last.rotation[j].T @ (view.poses["baton"][0] - last.position[j])
    assert lies == pytest.approx([-0.088, -0.045, 0.0], abs=4e-4)  # the arm hangs straight and reaches no further
    # It comes there within a moment, and goes back when the hand lets go.
    for k in range(30, 60):
        view = held.poses(k * FRAME, world(in_hand(0)), {"ann": shown(0)})
        hands.append(pose_joints(SKELETON, held.fingers(k * FRAME, view, {"ann": walking(0)})["ann"]).position[j])
    assert np.linalg.norm(np.diff(hands, axis=0), axis=1).max() < 0.005
    assert hands[-1] == pytest.approx(pose_joints(SKELETON, walking(0)).position[j])


def test_a_hand_that_leads_what_it_holds_is_drawn_where_it_is() -> None:
    held, j = HeldThings(), HAND_JOINT[1]
    for k in range(60):
        view = held.poses(k * FRAME, world(in_hand(k - BEHIND), GRASP), {"ann": shown(k)})
        drawn = held.fingers(k * FRAME, view, {"ann": walking(k)})["ann"]
        if k > 20:
            at = pose_joints(SKELETON, drawn).position[j]
            assert at == pytest.approx(pose_joints(SKELETON, walking(k)).position[j], abs=1e-3)
