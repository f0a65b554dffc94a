"""How far joints go, given the others, and arms that keep out of the own body."""

from __future__ import annotations

import math

import numpy as np
import pytest
from figure_fixture import tube_person
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.figure.arm_clearance import clear_of_body
from vistel.figure.body import pose_body
from vistel.figure.posture.hands import FIST
from vistel.figure.posture.limits import ankle_range, axial_range, within_limits
from vistel.figure.posture.posture import ANKLE, DOF_COUNT, ELBOW, KNEE, SHOULDER, WRIST, Posture, pose_joints, standing
from vistel.figure.posture.standard import standard_postures


def hands(**angles: float) -> Posture:
    """Index finger of the left hand: base, spread, middle, end [degrees]."""
    out = np.zeros((2, 20))
    for name, value in angles.items():
        out[0, 4 + ("base", "spread", "middle", "end").index(name)] = math.radians(value)
    return Posture(hands=out)


def index(posture: Posture) -> np.ndarray:
    return np.degrees(posture.hands[0, 4:8])


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6))
def test_what_is_brought_back_stays_where_it_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    posture = Posture(rng.normal(size=DOF_COUNT) * 1.3, rng.normal(size=(2, 20)))
    once = within_limits(posture)
    twice = within_limits(once)
    assert np.isfinite(once.dofs).all()
    np.testing.assert_allclose(twice.dofs, once.dofs, atol=1e-6)
    np.testing.assert_allclose(twice.hands, once.hands, atol=1e-9)


@pytest.mark.parametrize("name", ["t-pose", "standing", "sitting", "table", "elbow", "fists"])
def test_everyday_postures_are_within_limits(name: str) -> None:
    posture = standard_postures()[name]
    kept = within_limits(posture)
    np.testing.assert_allclose(kept.dofs, posture.dofs, atol=1e-9)
    np.testing.assert_allclose(kept.hands, posture.hands, atol=1e-9)


def test_a_straight_knee_leaves_the_ankle_less() -> None:
    dofs = np.zeros(DOF_COUNT)
    dofs[ANKLE] = math.radians(40)
    straight = within_limits(Posture(dofs)).dofs[ANKLE]
    dofs[KNEE] = math.radians(90)
    bent = within_limits(Posture(dofs)).dofs[ANKLE]
    assert straight == pytest.approx(ankle_range(0.0)[1])
    assert straight < math.radians(30) < bent == pytest.approx(math.radians(40))


def test_fingers_spread_while_they_are_straight_and_end_joints_follow_middle_ones() -> None:
    assert index(within_limits(hands(spread=25)))[1] == pytest.approx(25)
    assert index(within_limits(hands(spread=25, base=80)))[1] < 6
    assert index(within_limits(hands(end=70)))[3] < 30
    assert index(within_limits(hands(end=70, middle=90)))[3] == pytest.approx(70)


def test_a_thumb_that_bends_with_closed_fingers_goes_over_them() -> None:
    bent = FIST.copy()
    bent[:4] = np.radians((30, 25, 45, 40))
    over = np.degrees(within_limits(Posture(hands=np.stack([bent, bent]))).hands[0, :4])
    assert over == pytest.approx((75, 50, 45, 40))
    straight = FIST.copy()
    straight[:4] = np.radians((0, 20, 5, 5))
    assert within_limits(Posture(hands=np.stack([straight, straight]))).hands[0, :4] == pytest.approx(straight[:4])


def test_a_bent_wrist_deviates_less() -> None:
    def deviation(flexion: float) -> float:
        dofs = np.zeros(DOF_COUNT)
        dofs[WRIST["left"]] = (0.0, -math.radians(24), -math.radians(flexion))
        return -float(within_limits(Posture(dofs)).dofs[WRIST["left"]][1])

    assert deviation(0) == pytest.approx(math.radians(24))
    assert deviation(60) < math.radians(21)


def test_a_raised_arm_turns_less_inward() -> None:
    assert axial_range(math.radians(170))[1] < axial_range(math.radians(20))[1]


@pytest.fixture(scope="module")
def person():
    return tube_person()


def depth(person, posture: Posture) -> float:
    """How deep the left arm below the elbow is in the trunk and the thighs [m]."""
    posed, body = pose_body(person.body, pose_joints(person.skeleton, posture)), person.body
    worst, middle = -1.0, np.linspace(0, 1, 9)
    for i, name in enumerate(body.names):
        if not name.startswith("left_") or name.endswith(("collar", "upper_arm", "thigh", "shank", "foot")):
            continue
        p = posed.a[i] + middle[:, None] * (posed.b[i] - posed.a[i])
        mine = body.radius_a[i] + middle * (body.radius_b[i] - body.radius_a[i])
        for k in map(body.names.index, ("pelvis", "abdomen", "waist", "chest", "crotch", "left_thigh", "right_thigh")):
            d = posed.b[k] - posed.a[k]
            u = np.clip((p - posed.a[k]) @ d / max(float(d @ d), 1e-12), 0, 1)
            off = np.linalg.norm(p - posed.a[k] - u[:, None] * d, axis=1)
            worst = max(worst, float((mine + body.radius_a[k] + u * (body.radius_b[k] - body.radius_a[k]) - off).max()))
    return worst


def test_an_arm_inside_the_body_comes_out_and_no_further(person) -> None:
    dofs = standing().dofs.copy()
    dofs[SHOULDER["left"]] = (0.0, 0.0, -math.radians(97))
    dofs[ELBOW["left"]] = math.radians(15)
    posture = Posture(dofs)
    assert depth(person, posture) > 0.03
    clear = clear_of_body(person.skeleton, person.body, posture)
    assert -0.03 < depth(person, clear) < 0.002
    np.testing.assert_array_equal(clear.dofs[SHOULDER["right"]], dofs[SHOULDER["right"]])


def test_arms_that_are_clear_stay_exactly_where_they_are(person) -> None:
    posture = Posture()
    np.testing.assert_array_equal(clear_of_body(person.skeleton, person.body, posture).dofs, posture.dofs)
