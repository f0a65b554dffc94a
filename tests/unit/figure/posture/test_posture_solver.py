"""The posture solver: truth recovered, limits kept, nothing snaps."""

from __future__ import annotations

import functools
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from vistel.figure.posture.arm import arm_dofs, bones_of, elbow_at, elbow_circle, elbow_flexion
from vistel.figure.posture.limits import axial_excess, within_limits
from vistel.figure.posture.posture import (
    DOF_COUNT,
    ELBOW,
    NECK,
    SHOULDER,
    SPINE_ROTATION,
    SWING_INCREMENTS,
    WRIST,
    Posture,
    Stance,
    collar_scale,
    pose_joints,
    spine_chord,
    standing,
)
from vistel.figure.posture.sensors import receiver_poses
from vistel.figure.posture.solve import PostureSolver
from vistel.figure.posture.swivel import arm_within_limits
from vistel.figure.posture.trunk import leg_angles
from vistel.figure.skeleton import COLLAR_SHORTENING, JOINT_INDEX, standard_skeleton
from vistel.geometry.rotation import matrix_from_rotvec, rotation_y, rotation_z, rotvec_from_matrix, rotvec_from_quaternion
from vistel.geometry.smoothstep import ease

SKELETON = standard_skeleton()
GOLDEN = Path(__file__).parents[3] / "golden.json"
SIDES = (("left", 1.0), ("right", -1.0))


@functools.cache
def golden() -> dict[str, dict[str, Any]]:
    values = json.loads(GOLDEN.read_text("utf-8"))["values"]
    return {v["name"]: v for v in values if v["group"] == "skeleton"}


def arm_case(name: str) -> tuple[dict[str, Any], Any, float]:
    v = golden()[name]
    i = {k: np.array(x, np.float64) if isinstance(x, list) else x for k, x in v["inputs"].items()}
    return i, v["expected"], v["tolerance"]


def test_golden_elbow_circle() -> None:
    i, x, tolerance = arm_case("arm: circle centre offset x")
    _, along, radius = elbow_circle(i["S"], i["W"], i["upper"], i["fore"])
    assert along == pytest.approx(x, abs=tolerance)
    _, rho, tolerance = arm_case("arm: circle radius rho")
    assert radius == pytest.approx(rho, abs=tolerance)


@pytest.mark.parametrize("name", ["arm: elbow at psi=0", "arm: elbow at psi=1"])
def test_golden_elbow(name: str) -> None:
    i, elbow, tolerance = arm_case(name)
    _, got = elbow_at(i["S"], i["W"], i["upper"], i["fore"], i["ref"], float(i["psi"]))
    assert got == pytest.approx(elbow, abs=tolerance)


def test_golden_elbow_flexion() -> None:
    i, flexion, tolerance = arm_case("arm: elbow flexion (rad)")
    assert elbow_flexion(i["S"], i["W"], i["upper"], i["fore"]) == pytest.approx(flexion, abs=tolerance)


@pytest.mark.parametrize("name", ["leg IK crouch: [ankle,knee] rad", "leg IK sit: [ankle,knee] rad"])
def test_golden_legs(name: str) -> None:
    i, angles, tolerance = arm_case(name)
    assert leg_angles(i["hip"][0], i["hip"][1], i["shank"], i["thigh"]) == pytest.approx(angles, abs=tolerance)


def test_golden_degrees_of_freedom() -> None:
    assert golden()["DOF sum"]["expected"] == DOF_COUNT


def test_golden_quaternion_angle() -> None:
    (name,) = [n for n in golden() if n.startswith("quaternion angle")]
    w, x, y, z = golden()[name]["inputs"]["q"]
    q = np.array([x, y, z, w]) / np.linalg.norm([x, y, z, w])
    assert np.linalg.norm(rotvec_from_quaternion(q)) == pytest.approx(golden()[name]["expected"], abs=1e-9)


def test_golden_spine_chord() -> None:
    (name,) = [n for n in golden() if n.startswith("spine chord")]
    i, (up, forward), tolerance = arm_case(name)
    assert i["weights"] == pytest.approx(SWING_INCREMENTS)
    top = spine_chord(np.array([i["angle"], 0.0, 0.0]), i["length"] / 8.0)[8]
    assert (top[1], top[2]) == pytest.approx((up, forward), abs=tolerance)


def test_golden_collar_length() -> None:
    (name,) = [n for n in golden() if n.startswith("collar length")]
    i, length, tolerance = arm_case(name)
    # The figure's collar bone is measured in the T-pose, where the elevation is 90 degrees.
    t_pose, hanging = (collar_scale(r, 1.0, COLLAR_SHORTENING) for r in (np.eye(3), rotation_z(-math.pi / 2)))
    assert t_pose == pytest.approx(1.0, abs=1e-12)
    assert i["L0"] * t_pose / hanging == pytest.approx(length, abs=tolerance)


def angle(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.radians(low), math.radians(high))


ARM = st.tuples(angle(-60, 40), angle(-50, 50), angle(-75, 40), angle(3, 140), angle(-60, 60), angle(-15, 15), angle(-50, 50))


def arm_posture(arm: tuple[float, ...], name: str, sign: float) -> Posture:
    """Both shoulders at rest but for one arm; angles as of a left one."""
    dofs = np.zeros(DOF_COUNT)
    # Mirrored for the right arm: rotations about Y and Z change their sign.
    mirror = np.array([1.0, sign, sign])
    dofs[SHOULDER[name]] = np.array(arm[:3]) * mirror
    dofs[ELBOW[name]] = arm[3]
    dofs[WRIST[name]] = np.array(arm[4:]) * mirror
    return Posture(dofs)


@given(arm=ARM, side=st.sampled_from(SIDES))
@settings(max_examples=300, deadline=None)
def test_an_arm_is_found_again_from_its_wrist_and_elbow(arm: tuple[float, ...], side: tuple[str, float]) -> None:
    name, sign = side
    truth = pose_joints(SKELETON, arm_posture(arm, name, sign))
    c = JOINT_INDEX[f"{name}_shoulder"]
    wrist = truth.position[c + 3] - truth.position[c]
    axis = truth.position[c + 3] - truth.position[c + 1]
    elbow = truth.position[c + 2] - truth.position[c + 1]
    toward = elbow - (elbow @ axis) / (axis @ axis) * axis
    dofs = np.zeros(DOF_COUNT)
    got, _, _ = arm_dofs(wrist, truth.rotation[c + 3].copy(), bones_of(SKELETON, name), toward, 0.0, 1.0)
    dofs[SHOULDER[name]], dofs[ELBOW[name]], dofs[WRIST[name]] = got[:3], got[3], got[4:]
    again = pose_joints(SKELETON, Posture(dofs))
    assert np.abs(again.position[c + 3] - truth.position[c + 3]).max() < 5e-4
    assert np.abs(again.rotation[c + 3] - truth.rotation[c + 3]).max() < 1e-9


@given(arm=ARM, side=st.sampled_from(SIDES), toward=st.tuples(*3 * [st.floats(-1, 1)]))
@settings(max_examples=300, deadline=None)
def test_wherever_the_elbow_is_wanted_the_shoulder_keeps_its_limit_and_the_hand_its_place(
    arm: tuple[float, ...], side: tuple[str, float], toward: tuple[float, float, float]
) -> None:
    name, sign = side
    posture = arm_posture(arm, name, sign)
    assume(np.linalg.norm(toward) > 0.1)
    assume(axial_excess(matrix_from_rotvec(posture.dofs[SHOULDER[name]]), sign) == 0.0)
    truth = pose_joints(SKELETON, posture)
    c = JOINT_INDEX[f"{name}_shoulder"]
    wrist, hand = truth.position[c + 3] - truth.position[c], truth.rotation[c + 3].copy()
    dofs = np.zeros(DOF_COUNT)
    got, _, _ = arm_within_limits(wrist, hand, bones_of(SKELETON, name), np.array(toward), 0.0, 1.0)
    assert axial_excess(matrix_from_rotvec(got[:3].copy()), sign) == 0.0
    dofs[SHOULDER[name]], dofs[ELBOW[name]], dofs[WRIST[name]] = got[:3], got[3], got[4:]
    again = pose_joints(SKELETON, Posture(dofs))
    assert np.abs(again.position[c + 3] - truth.position[c + 3]).max() < 5e-4
    assert np.abs(again.rotation[c + 3] - truth.rotation[c + 3]).max() < 1e-9


@given(ankle=angle(-20, 30), knee=angle(5, 120))
@settings(max_examples=200, deadline=None)
def test_legs_are_found_again_from_the_hip(ankle: float, knee: float) -> None:
    shank, thigh = SKELETON.lower_leg, SKELETON.upper_leg
    forward = shank * math.sin(ankle) - thigh * math.sin(knee - ankle)
    up = shank * math.cos(ankle) + thigh * math.cos(knee - ankle)
    assert leg_angles(forward, up, shank, thigh) == pytest.approx((ankle, knee), abs=1e-7)


def seated(t: float = 0.0) -> Posture:
    """Sits at the origin facing +Z and moves everything a little with `t`."""
    dofs = np.zeros(DOF_COUNT)
    dofs[1] = math.radians(88.0)
    dofs[SPINE_ROTATION] = (0.15 + 0.10 * math.sin(1.1 * t), 0.15 * math.sin(0.7 * t), 0.05 * math.sin(0.9 * t))
    dofs[NECK] = (0.1 * math.sin(1.3 * t), 0.4 * math.sin(0.8 * t), 0.0)
    for name, sign in SIDES:
        dofs[SHOULDER[name]] = rotvec_from_matrix(
            rotation_y(-sign * (0.5 + 0.2 * math.sin(t + sign))) @ rotation_z(-sign * (1.0 + 0.2 * math.sin(1.2 * t)))
        )
        dofs[ELBOW[name]] = 1.2 + 0.3 * math.sin(0.9 * t + sign)
        dofs[WRIST[name]] = (-0.3, 0.0, sign * 0.1 * math.sin(t))
    hands = np.full((2, 20), 0.2 + 0.1 * math.sin(t))
    return Posture(dofs, hands, Stance(np.array([0.0, 0.0, 0.35]), 0.0))


def feel(posture: Posture) -> dict[str, Any]:
    return receiver_poses(SKELETON, pose_joints(SKELETON, posture))


def follow(solver: PostureSolver, times: np.ndarray, silent: Any = lambda t: ()) -> list[Posture]:
    out = []
    for t in times:
        truth = seated(float(t))
        gone = silent(float(t))
        heard = {name: p for name, p in feel(truth).items() if name not in gone}
        hands = tuple(None if f"{s}_glove" in gone else truth.hands[i] for i, s in enumerate(("left", "right")))
        out.append(solver.solve(float(t), heard, hands).posture)  # type: ignore[arg-type]
    return out


def steps(postures: list[Posture]) -> np.ndarray:
    """Metres every joint moves between neighbours, (n-1, J)."""
    p = np.array([pose_joints(SKELETON, q).position for q in postures])
    return np.linalg.norm(np.diff(p, axis=0), axis=2)


def test_everything_measured_is_met_while_a_person_moves() -> None:
    solver = PostureSolver(SKELETON, Stance())
    times = np.arange(0, 6, 1 / 60)
    for t, solved in zip(times, follow(solver, times), strict=True):
        want, got = pose_joints(SKELETON, seated(float(t))), pose_joints(SKELETON, solved)
        for joint in ("left_hand", "right_hand", "left_shoulder", "head"):
            j = JOINT_INDEX[joint]
            assert np.linalg.norm(got.position[j] - want.position[j]) < 1e-3, joint
            assert np.abs(got.rotation[j] - want.rotation[j]).max() < 1e-6, joint
        # The swivel of an elbow is a guess; a good one for somebody at a table.
        for joint in ("left_lower_arm", "right_lower_arm"):
            j = JOINT_INDEX[joint]
            assert np.linalg.norm(got.position[j] - want.position[j]) < 0.12
        assert solved.hands == pytest.approx(seated(float(t)).hands)


def test_elbows_do_not_tremble_nor_jump() -> None:
    solver = PostureSolver(SKELETON, Stance())
    times = np.arange(0, 10, 1 / 60)
    solved = follow(solver, times)
    truth = steps([seated(float(t)) for t in times])
    for side in ("left", "right"):
        j = JOINT_INDEX[f"{side}_lower_arm"]
        assert steps(solved[5:])[:, j].max() < truth[:, j].max() + 0.02


@pytest.mark.parametrize("gone", ["chest", "head", "left_hand", "right_hand", "left_glove"])
def test_a_silent_sensor_is_flagged_held_relaxed_and_taken_back_without_a_snap(gone: str) -> None:
    solver = PostureSolver(SKELETON, Stance())
    times = np.arange(0, 9, 1 / 60)
    away = [gone if 2.0 <= t < 6.0 else "" for t in times]
    solved = follow(solver, times, lambda t: (gone,) if 2.0 <= t < 6.0 else ())
    fastest = steps([seated(float(t)) for t in times]).max()
    # 3 cm in a sixtieth of a second on top of what the person does.
    assert steps(solved[1:]).max() < fastest + 0.03
    angles = np.abs(np.diff([p.hands for p in solved], axis=0)).max()
    assert angles < math.radians(5.0)
    held = [p for p, a in zip(solved, away, strict=True) if a][:20]
    if gone == "head":
        assert np.ptp([p.dofs[NECK] for p in held], axis=0).max() < 1e-3
    last = pose_joints(SKELETON, solved[-1])
    want = pose_joints(SKELETON, seated(float(times[-1])))
    assert np.linalg.norm(last.position[JOINT_INDEX["left_hand"]] - want.position[JOINT_INDEX["left_hand"]]) < 1e-3


def test_what_is_silent_is_named() -> None:
    solver = PostureSolver(SKELETON)
    heard = feel(seated())
    assert solver.solve(0.0, heard, (seated().hands[0], seated().hands[1])).stale == frozenset()
    del heard["head"]
    assert solver.solve(0.1, heard, (None, seated().hands[1])).stale == {"head", "left_glove"}


def test_with_nothing_heard_a_person_sits_on_their_seat() -> None:
    seat = Stance(np.array([1.0, 0.0, 2.0]), math.radians(30.0))
    solved = PostureSolver(SKELETON, seat).solve(0.0, {})
    pose = pose_joints(SKELETON, solved.posture)
    assert np.hypot(*(pose.position[0] - seat.position)[[0, 2]]) < 0.05
    assert 0.45 < pose.position[0, 1] < 0.6
    assert solved.posture.stance.heading == pytest.approx(seat.heading)
    # The hands lie low, in front of the body.
    for side in ("left", "right"):
        hand = pose.position[JOINT_INDEX[f"{side}_hand"]]
        assert hand[1] < 0.85
        assert np.array([math.sin(seat.heading), 0.0, math.cos(seat.heading)]) @ (hand - seat.position) > 0.1


@given(seed=st.integers(0, 10_000), far=st.floats(0.0, 2.0))
@settings(max_examples=150, deadline=None)
def test_limits_are_kept_whatever_the_receivers_say(seed: int, far: float) -> None:
    rng = np.random.default_rng(seed)
    solver = PostureSolver(SKELETON, Stance())
    for k in range(3):
        q = rng.normal(size=(4, 4))
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        p = np.array([0.0, 1.3, 0.0]) + far * rng.normal(size=(4, 3))
        names = ("chest", "head", "left_hand", "right_hand")
        hands = rng.normal(scale=2.0, size=(2, 20))
        posture = solver.solve(k / 60, {n: (p[i], q[i]) for i, n in enumerate(names)}, (hands[0], hands[1])).posture
        assert np.isfinite(posture.dofs).all() and np.isfinite(posture.hands).all()
        assert 0.0 <= posture.dofs[1] <= math.radians(146.0)
        kept = within_limits(posture)
        np.testing.assert_allclose(posture.dofs, kept.dofs, atol=1e-6)
        np.testing.assert_allclose(posture.hands, kept.hands, atol=1e-9)


def test_a_chest_turned_too_far_stops_at_the_spine_and_hands_and_head_stay_where_they_are() -> None:
    truth = seated()
    truth.dofs[SPINE_ROTATION] = (0.1, math.radians(60.0), 0.0)
    want = pose_joints(SKELETON, truth)
    solved = PostureSolver(SKELETON, Stance()).solve(0.0, feel(truth), (truth.hands[0], truth.hands[1])).posture
    got = pose_joints(SKELETON, solved)
    turned = math.degrees(solved.dofs[SPINE_ROTATION][1])
    assert turned < 45.0
    for joint in ("left_hand", "right_hand"):
        assert np.linalg.norm(got.position[JOINT_INDEX[joint]] - want.position[JOINT_INDEX[joint]]) < 1e-3
    for joint in ("left_hand", "right_hand", "head"):
        assert np.abs(got.rotation[JOINT_INDEX[joint]] - want.rotation[JOINT_INDEX[joint]]).max() < 1e-6


def test_standing_up_straightens_the_legs_over_feet_that_stay() -> None:
    solver = PostureSolver(SKELETON, Stance())
    first = last = None
    for k in range(180):
        u = min(1.0, k / 120)
        u = ease(u)
        dofs = standing().dofs.copy()
        thigh, shank = SKELETON.upper_leg, SKELETON.lower_leg
        # Hips rise and come forward over the feet.
        hip_up = shank + u * thigh * 0.999
        hip_forward = -thigh * math.cos(math.asin(min(1.0, u)))
        dofs[0], dofs[1] = leg_angles(hip_forward, hip_up, shank, thigh)
        truth = Posture(dofs, stance=Stance(np.array([0.0, 0.0, 0.4]), 0.0))
        last = solver.solve(k / 60, feel(truth)).posture
        first = first or last
    assert first is not None and last is not None
    assert first.dofs[1] > math.radians(80) and last.dofs[1] < math.radians(12)
    assert np.linalg.norm(last.stance.position - first.stance.position) < 0.05


def test_feet_follow_who_walks_away_and_never_jump() -> None:
    solver = PostureSolver(SKELETON, Stance())
    out = []
    for k in range(360):
        t = k / 60
        z = 1.2 * max(0.0, min(3.0, t - 1.0))
        truth = Posture(standing().dofs, stance=Stance(np.array([0.0, 0.0, z]), 0.0))
        out.append(solver.solve(t, feel(truth)).posture)
    assert np.linalg.norm(out[50].stance.position - out[0].stance.position) < 1e-6
    assert out[-1].stance.position[2] == pytest.approx(3.6, abs=0.06)
    z = np.array([p.stance.position[2] for p in out])
    # 1.2 m/s is 2 cm a frame; catching up may be quicker.
    assert np.abs(np.diff(z)).max() < 0.05
    knees = np.array([p.dofs[1] for p in out])
    assert knees.max() < math.radians(60)


def test_feet_turn_with_who_turns_round() -> None:
    solver = PostureSolver(SKELETON, Stance())
    out = []
    for k in range(300):
        heading = math.radians(150.0) * min(1.0, max(0.0, (k / 60 - 1.0) / 2.0))
        truth = Posture(standing().dofs, stance=Stance(np.zeros(3), heading))
        out.append(solver.solve(k / 60, feel(truth)).posture.stance.heading)
    assert out[-1] == pytest.approx(math.radians(150.0), abs=math.radians(10.0))
    assert np.abs(np.diff(out)).max() < math.radians(6.0)
