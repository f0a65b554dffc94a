"""Things on joints: they stay on them, within their limits, and gain no energy, whatever strikes them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix, rotation_z
from vistel.space.dynamics.dynamics import ASLEEP, FIXED, FREE, HELD, Motions, Pushes, advance
from vistel.space.dynamics.solids import Solids, solids
from vistel.space.joints.joint import Detent, Drive, Joint, JointFrame, JointKind, check_joints
from vistel.space.things.things import Thing, ThingPrimitive

DT = 1.0 / 60.0
GRAVITY = 9.81
UP = quaternion_from_matrix(rotation_z(0.5 * math.pi))
"""Turns X upwards."""


def board(name: str, at: tuple[float, float, float], mass: float) -> Thing:
    corners = (-0.19, 0.0, -0.14, 0.19, 0.0, -0.14, 0.19, 0.0, 0.14, -0.19, 0.0, 0.14)
    return Thing(name, name, "tile", (ThingPrimitive("rounded_polygon", (0.01, *corners)),), mass, 0.0, 0xFF, np.array(at))


BASE = board("base", (0.0, 1.0, 0.0), 0.0)
LID = board("lid", (0.0, 1.02, 0.0), 0.5)
FRAMES = JointFrame(np.array([0.0, 0.01, -0.15])), JointFrame(np.array([0.0, -0.01, -0.15]))


def hinge(lower: float = -math.inf, upper: float = math.inf, **more: object) -> Joint:
    """About X at the back: the front rises with negative angles."""
    return Joint("hinge", JointKind.HINGE, "lid", "base", *FRAMES, lower, upper, **more)  # pyright: ignore[reportArgumentType]


def slider(lower: float, upper: float, rotation: np.ndarray, **more: object) -> Joint:
    frames = JointFrame(np.array([0.0, 0.02, 0.0]), rotation), JointFrame(np.zeros(3), rotation)
    return Joint("slider", JointKind.SLIDER, "lid", "base", *frames, lower, upper, **more)  # pyright: ignore[reportArgumentType]


def begin(*joints: Joint, things: tuple[Thing, ...] = (BASE, LID), at: float = 0.0) -> tuple[Solids, Motions]:
    """The things awake, that of the first joint at the coordinate `at`."""
    n = len(things)
    s = solids(things, None, joints)
    m = Motions(
        np.array([t.position for t in things]),
        np.array([t.rotation for t in things]),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        np.array([FIXED if t.fixed else FREE for t in things], np.int64),
        np.zeros(n, np.int64),
    )
    if joints:
        row = int(s.joined.ends[0, 1])
        m.position[row], m.rotation[row] = s.joined.posed(0, at, m.position, m.rotation)
    return s, m


def off_joint(s: Solids, m: Motions, k: int = 0) -> tuple[float, float]:
    """How far a joint's points are apart across its free direction [m], and how far its axes are [rad]."""
    j, (b, n) = s.joined.joints[k], s.joined.ends[k].tolist()
    rb = matrix_from_quaternion(m.rotation[b]) @ j.on_base.matrix
    rc = matrix_from_quaternion(m.rotation[n]) @ j.on_thing.matrix
    gap = m.position[n] + matrix_from_quaternion(m.rotation[n]) @ j.on_thing.point
    gap = gap - m.position[b] - matrix_from_quaternion(m.rotation[b]) @ j.on_base.point
    if j.kind is JointKind.SLIDER:
        gap = gap - (gap @ rb[:, 0]) * rb[:, 0]
    return float(np.linalg.norm(gap)), float(np.linalg.norm(np.cross(rb[:, 0], rc[:, 0])))


def energy(s: Solids, m: Motions) -> float:
    """Of motion and height [J]."""
    total = 0.0
    for n, t in enumerate(s.things):
        if t.fixed:
            continue
        r = matrix_from_quaternion(m.rotation[n])
        inertia = r @ np.linalg.inv(s.inverse_inertia[n]) @ r.T
        total += 0.5 * t.mass * m.velocity[n] @ m.velocity[n] + 0.5 * m.spin[n] @ inertia @ m.spin[n]
        total += t.mass * GRAVITY * m.position[n, 1]
    return float(total)


def coordinate(s: Solids, m: Motions, k: int = 0) -> float:
    return s.joined.coordinate(k, m.position, m.rotation)


def test_a_lid_swings_on_its_hinge_for_ten_seconds_and_only_loses_energy() -> None:
    s, m = begin(hinge(), at=-0.5)
    least = energy(s, m)
    for _ in range(600):
        m, _ = advance(s, m, Pushes.none(), DT)
        now = energy(s, m)
        assert now <= least + 2e-3 * 0.5 * GRAVITY * 0.3  # a pendulum's step rounds; it does not add up
        least = min(least, now)
        gap, tilt = off_joint(s, m)
        assert gap < 1e-9
        assert tilt < 1e-9


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-60.0, 60.0), min_size=6, max_size=6), st.floats(-1.8, 0.0), st.sampled_from(["hinge", "slider"]))
def test_struck_however_hard_it_stays_on_its_joint_and_within_its_limits(speeds: list[float], at: float, kind: str) -> None:
    joint = hinge(-1.8, 0.0) if kind == "hinge" else slider(-1.8, 0.0, UP)
    s, m = begin(joint, at=at)
    m.velocity[1], m.spin[1] = speeds[:3], speeds[3:]
    for _ in range(60):
        m, _ = advance(s, m, Pushes.none(), DT)
        assert max(off_joint(s, m)) < 1e-9
        assert -1.8 - 1e-9 <= coordinate(s, m) <= 1e-9


def test_a_lid_lies_on_its_limit_without_a_tremble_and_falls_asleep() -> None:
    s, m = begin(hinge(-1.8, 0.0), at=-0.6)
    for _ in range(240):
        m, _ = advance(s, m, Pushes.none(), DT)
    assert m.mode[1] == ASLEEP
    assert coordinate(s, m) == pytest.approx(0.0, abs=1e-12)
    after, _ = advance(s, m, Pushes.none(), DT)
    np.testing.assert_array_equal(after.position, m.position)
    np.testing.assert_array_equal(after.rotation, m.rotation)


def test_a_weight_on_a_spring_comes_to_rest_where_spring_and_weight_balance() -> None:
    s, m = begin(slider(-0.5, 0.5, UP, drive=Drive(stiffness=200.0, damping=4.0)))
    for _ in range(600):
        m, _ = advance(s, m, Pushes.none(), DT)
    assert coordinate(s, m) == pytest.approx(-0.5 * GRAVITY / 200.0, abs=1e-4)


def test_a_very_stiff_spring_on_a_very_light_thing_stays_calm() -> None:
    light = replace(LID, mass=0.005)
    s, m = begin(slider(-0.5, 0.5, UP, drive=Drive(stiffness=1e6, damping=0.0)), things=(BASE, light), at=0.05)
    for _ in range(300):
        m, _ = advance(s, m, Pushes.none(), DT)
        assert abs(coordinate(s, m)) <= 0.05 + 1e-6


def test_a_brake_holds_up_to_its_force_and_slips_beyond_it() -> None:
    weight = 0.5 * GRAVITY
    for most, holds in ((1.2 * weight, True), (0.8 * weight, False)):
        s, m = begin(slider(-0.5, 0.5, UP, drive=Drive(damping=1e4, most=most)))
        for _ in range(60):
            m, _ = advance(s, m, Pushes.none(), DT)
        assert (abs(coordinate(s, m)) < 0.002) is holds


def test_a_detent_draws_a_drawer_shut_from_within_its_reach_and_not_from_outside_it() -> None:
    flat = np.array([0.0, 0.0, 0.0, 1.0])
    for start, ends in ((0.010, 0.0), (0.030, 0.030)):
        s, m = begin(slider(0.0, 0.3, flat, drive=Drive(damping=50.0, most=0.5), detents=(Detent(0.0, 0.015, 5.0),)), at=start)
        for _ in range(240):
            m, _ = advance(s, m, Pushes.none(), DT)
        assert coordinate(s, m) == pytest.approx(ends, abs=0.002)


@settings(max_examples=15, deadline=None)
@given(st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6))
def test_a_loose_box_and_its_lid_keep_their_momentum_and_their_hinge_in_the_air(speeds: list[float]) -> None:
    box, lid = board("base", (0.0, 5.0, 0.0), 0.8), board("lid", (0.0, 5.02, 0.0), 0.3)
    s, m = begin(hinge(-2.0, 0.0), things=(box, lid), at=-0.7)
    m.velocity[0], m.spin[1] = speeds[:3], speeds[3:]
    mass, was = np.array([0.8, 0.3]), energy(s, m)
    alone = board("base", (0.0, 5.0, 0.0), 1.1)
    s_alone, whole = begin(things=(alone,))
    whole.velocity[0] = mass @ m.velocity / 1.1
    for _ in range(30):
        m, _ = advance(s, m, Pushes.none(), DT)
        whole, _ = advance(s_alone, whole, Pushes.none(), DT)
        gap, tilt = off_joint(s, m)
        assert gap < 1e-9
        assert tilt < 1e-9
        assert energy(s, m) <= was + 0.01 * abs(was)
    np.testing.assert_allclose(mass @ m.velocity, 1.1 * whole.velocity[0], atol=1e-4)  # drag, by substeps


def test_a_lid_follows_the_box_that_a_hand_carries() -> None:
    box = board("base", (0.0, 1.0, 0.0), 0.8)
    s, m = begin(hinge(-2.0, 0.0), things=(box, LID))
    m.mode[0] = HELD
    for k in range(90):
        turn = matrix_from_rotvec(np.array([0.0, 0.5 * DT, 0.0])) @ matrix_from_quaternion(m.rotation[0])
        m.position[0] += np.array([0.3, 0.2 * math.cos(0.1 * k), 0.0]) * DT
        m.rotation[0] = quaternion_from_matrix(np.ascontiguousarray(turn))
        m.velocity[0], m.spin[0] = (0.3, 0.2 * math.cos(0.1 * k), 0.0), (0.0, 0.5, 0.0)
        m, _ = advance(s, m, Pushes.none(), DT)
        assert max(off_joint(s, m)) < 1e-9


def test_equal_beginnings_give_equal_bytes() -> None:
    ends: list[bytes] = []
    for _ in range(2):
        s, m = begin(hinge(-1.8, 0.0), at=-1.2)
        m.spin[1] = (3.0, 1.0, -2.0)
        for _ in range(120):
            m, _ = advance(s, m, Pushes.none(), DT)
        ends.append(m.position.tobytes() + m.rotation.tobytes() + m.velocity.tobytes() + m.spin.tobytes())
    assert ends[0] == ends[1]


def test_joints_change_nothing_for_things_without_them() -> None:
    ball = Thing("ball", "ball", "ball", (ThingPrimitive("sphere", (0.05,)),), 0.2, 0.0, 0xFF, np.array([2.0, 0.6, 0.0]))
    runs: list[np.ndarray] = []
    for joints in ((), (hinge(-1.8, 0.0),)):
        s = solids((BASE, LID, ball), None, joints)
        m = begin(hinge(-1.8, 0.0), things=(BASE, LID, ball))[1]
        for _ in range(120):
            m, _ = advance(s, m, Pushes.none(), DT)
        runs.append(m.position[2])
    np.testing.assert_array_equal(*runs)


@pytest.mark.parametrize(
    ("joint", "line"),
    [
        (lambda: replace(hinge(), thing="base"), "joins base to itself"),
        (lambda: hinge(1.0, -1.0), "lower one below the upper one"),
        (lambda: hinge(math.nan, 1.0), "lower one below the upper one"),
        (lambda: hinge(-4.0, 1.0), "at most 180 degrees"),
        (lambda: replace(hinge(), on_thing=JointFrame(np.array([0.0, np.nan, 0.0]))), "finite places"),
        (lambda: hinge(drive=Drive(stiffness=-1.0)), "stiffness and damping"),
        (lambda: hinge(drive=Drive(most=math.nan)), "greatest force"),
        (lambda: hinge(detents=(Detent(0.0, 0.0, 1.0),)), "reach above 0"),
    ],
)
def test_what_can_be_no_joint_is_told_in_one_line(joint: object, line: str) -> None:
    with pytest.raises(ValueError, match=line) as told:
        joint()  # pyright: ignore[reportCallIssue]
    assert "\n" not in str(told.value)


def test_joints_must_fit_the_things_of_the_room() -> None:
    other = board("other", (0.0, 2.0, 0.0), 0.4)
    things = (BASE, LID, other)
    check_joints((hinge(),), things)
    for joints, line in (
        ((replace(hinge(), base="nothing"),), "there is no thing 'nothing'"),
        ((replace(hinge(), thing="base", base="lid"),), "base is fixed to the room"),
        ((hinge(), replace(hinge(), id="second", base="other")), "hangs on another joint already"),
        ((hinge(), hinge()), "two joints have this id"),
        ((replace(hinge(), base="other"), replace(hinge(), id="b", thing="other", base="lid")), "hangs on itself"),
    ):
        with pytest.raises(ValueError, match=line):
            check_joints(joints, things)
