"""What hands feel: agrees with the exact patches, equal and opposite between people, smooth, the same twice."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.conference.model import Conference
from vistel.figure.posture.posture import Posture
from vistel.implicit.contacts.contact import find_contacts
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.contact.forces import STIFFEST, contact_patches
from vistel.space.contact.touch_kernels import FELT, feel
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.people import DIGITS, PALM
from vistel.space.room import TABLE_HEIGHT, meeting_room
from vistel.space.view import HandForce, WorldView
from vistel.space.world import World
from vistel_sim.motion.meeting import Meeting
from vistel_sim.motion.source import simulated_people

F64 = np.ndarray
STEP_NS = 16_666_667
R = 0.5411961001461970  # surface radius of a unit influence
HAND_OVER = (2.0, 12.0)
"""Seconds of the made-up meeting in which the baton goes from hand to hand."""
PALMS = (15.0, 16.4)


def felt(a: PrimitiveSet, b: PrimitiveSet, c_a: float = 1.0, c_b: float = 1.0) -> F64:
    found = find_contacts(a, b)
    rows = np.zeros((len(found), FELT))
    of_a, of_b = ((s.kind, s.start, s.params, s.rotation, s.position) for s in (a, b))
    feel(
        np.array([0, len(found)]),
        np.stack([found.a, found.b], axis=1).astype(np.int64),
        found.point.copy(),
        found.normal.copy(),
        found.field_depth.copy(),
        np.array([[max(c_a, STIFFEST), max(c_b, STIFFEST)]]),
        of_a,
        of_b,
        1.0,
        0.0,
        0.05,
        np.zeros((len(found), 3)),
        np.zeros((len(found), 9)),
        rows,
    )
    return rows


def cones(*rows: Sequence[float]) -> PrimitiveSet:
    """Cone-spheres: ends a and b, then both radii."""
    r = np.array(rows, np.float64)
    return PrimitiveSet.of_cone_spheres(r[:, :3].copy(), r[:, 3:6].copy(), r[:, 6].copy(), r[:, 7].copy())


def ball(x: float, y: float, z: float, r: float = R) -> PrimitiveSet:
    return cones([x, y, z, x, y, z, r, r])


@cache
def meeting() -> tuple[Meeting, tuple[str, ...]]:
    people = ("aiko", "bruno", "chidi")
    conference = Conference.model_validate({"sites": [{"name": p, "participants": [{"name": p}]} for p in people]})
    return Meeting(list(simulated_people(conference).values()), 3, 1), people


@cache
def played(begin: float, end: float) -> tuple[WorldView, ...]:
    source, people = meeting()
    world, out = World(meeting_room(3)), []
    for n, k in enumerate(range(round(begin * 60), round(end * 60)), 1):
        motions = tuple(MotionInput(p, source.posture(p, k / 60), n, n * STEP_NS) for p in people)
        out.append(world.step(StepInputs(n, n * STEP_NS, tuple(map(ParticipantBody, people)) if n == 1 else (), motions)))
    return tuple(out)


def of(view: WorldView, who: str, right: bool) -> HandForce | None:
    return next((h for h in view.hands if (h.participant, h.right) == (who, right)), None)


def test_two_balls_feel_the_golden_force_and_area() -> None:
    row = felt(ball(0, 0, 0), ball(0.9, 0, 0))[0]
    assert row[13] == pytest.approx(0.0189247, rel=1e-4)
    assert row[12] == pytest.approx(0.2839787, rel=5e-3)
    assert row[0:3] == pytest.approx([-row[13], 0.0, 0.0], abs=1e-9)
    assert row[9:12] == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(*[st.floats(-1, 1)] * 3),
    st.tuples(*[st.floats(-1, 1)] * 3),
    st.floats(0.05, 0.55),
    st.sampled_from([(1.0, 1.0), (1.0, 0.35), (1.0, 0.0)]),
)
def test_forces_agree_with_the_exact_patches(
    lie: tuple[float, ...], side: tuple[float, ...], depth: float, soft: tuple[float, float]
) -> None:
    """Two finger bones across each other, pressed together by a share of the lesser radius."""
    along = np.add(lie, (1e-3, 0, 0))
    along /= np.linalg.norm(along)
    away = np.cross(np.add(side, (0, 2e-3, 1e-3)), along)
    if np.linalg.norm(away) < 0.2:
        return
    away /= np.linalg.norm(away)
    across = np.cross(along, away)
    a = cones([*(-0.012 * along), *(0.012 * along), 0.009, 0.008])
    at = (0.0085 + 0.010 - depth * 0.0085) * away
    b = cones([*(at - 0.03 * across), *(at + 0.03 * across), 0.010, 0.010])
    exact = contact_patches(a, b, *soft)
    assert len(exact) == 1
    row = felt(a, b, *soft)[0]
    assert row[13] == pytest.approx(exact[0].normal_force, rel=0.06)
    assert row[12] == pytest.approx(exact[0].area, rel=0.15)
    assert np.linalg.norm(row[0:3] - exact[0].force) < 0.08 * exact[0].normal_force
    assert np.linalg.norm(row[6:9] - exact[0].point) < 0.0006


def test_a_contact_that_passes_from_bone_to_bone_does_not_jump() -> None:
    """A ball rolls along a finger of two bones: the shares of the bones add up, also over the joint."""
    finger = cones([-0.03, 0, 0, 0, 0, 0, 0.009, 0.009], [0, 0, 0, 0.03, 0, 0, 0.009, 0.009])
    whole = cones([-0.03, 0, 0, 0.03, 0, 0, 0.009, 0.009])
    forces = [felt(finger, ball(x, 0.0155, 0, 0.01))[:, 13].sum() for x in np.linspace(-0.01, 0.01, 81)]
    one = felt(whole, ball(0, 0.0155, 0, 0.01))[0, 13]
    assert max(forces) < 1.06 * one
    assert min(forces) > 0.94 * one
    assert np.abs(np.diff(forces)).max() < 0.02 * one


def test_limbs_that_go_through_each_other_push_less_and_less_and_never_jump() -> None:
    forces = []
    for gap in np.linspace(0.018, -0.018, 361):
        rows = felt(cones([-0.02, 0, 0, 0.02, 0, 0, 0.008, 0.008]), cones([0, gap, -0.02, 0, gap, 0.02, 0.009, 0.009]))
        assert np.isfinite(rows).all()
        forces.append(rows[:, 0:3].sum(axis=0) if len(rows) else np.zeros(3))
    size = np.linalg.norm(forces, axis=1)
    assert np.linalg.norm(np.diff(forces, axis=0), axis=1).max() < 0.06 * size.max()
    assert size[180] < 1e-9  # in the middle there is no side to push to


@pytest.mark.parametrize("height", [0.02, 0.015, 0.01])
def test_a_hand_laid_on_the_table_is_pushed_up(height: float) -> None:
    from test_world_steps import Play, reaching  # the same person

    from vistel.figure.posture.posture import pose_joints
    from vistel.space.people import HAND_JOINT, build_of

    play = Play("ann")
    posture = reaching(np.array([0.0, TABLE_HEIGHT + height, 0.25]), 0.0)
    view = play.step({"ann": posture})
    right = of(view, "ann", True)
    assert right is not None
    table = [t for t in right.touches if t.body == "table"]
    assert table
    assert sum(t.normal_force for t in table) > 0.2
    for t in table:
        assert t.normal[1] < -0.8
        assert t.force[1] > 0
        assert t.peak_pressure >= t.mean_pressure > 0
        assert t.normal_force <= t.mean_pressure * t.area * 1.001
        assert 0 <= t.digit < DIGITS
    assert len({(t.digit, t.body) for t in right.touches}) == len(right.touches)
    wrist = pose_joints(build_of(1.75, 1.0).skeleton, posture).position[HAND_JOINT[1]]
    moments = sum((np.cross(t.point - wrist, t.force) for t in right.touches), np.zeros(3))
    assert right.torque == pytest.approx(moments, abs=0.15 * np.linalg.norm(right.force) * 0.02 + 1e-3)


def shaking() -> dict[str, Posture]:
    from test_world_steps import at, reaching

    return {"ann": reaching(at(0.0, 0.3, 0.0), 0.5), "bob": reaching(at(0.0, 0.285, 0.01), 0.5, np.pi)}


def test_in_a_handshake_both_hands_feel_the_same_the_other_way_round() -> None:
    from test_world_steps import Play

    view = Play("ann", "bob").step(shaking())
    ann, bob = of(view, "ann", True), of(view, "bob", True)
    assert ann is not None
    assert bob is not None
    mine = sum((t.force for t in ann.touches if t.body == "bob"), np.zeros(3))
    theirs = sum((t.force for t in bob.touches if t.body == "ann"), np.zeros(3))
    assert np.linalg.norm(mine) > 0.1
    assert mine == pytest.approx(-theirs, abs=1e-12 + 1e-12 * np.linalg.norm(mine))


def test_palm_to_palm_the_forces_of_two_people_are_equal_and_opposite() -> None:
    met = 0
    for view in played(*PALMS):
        bruno, chidi = of(view, "bruno", True), of(view, "chidi", False)
        if bruno is None or not any(t.body == "chidi" for t in bruno.touches):
            continue
        assert chidi is not None
        mine = sum((t.force for t in bruno.touches if t.body == "chidi"), np.zeros(3))
        theirs = sum((t.force for t in chidi.touches if t.body == "bruno"), np.zeros(3))
        assert mine == pytest.approx(-theirs, abs=1e-9)
        met += np.linalg.norm(mine) > 0.5
    assert met > 20


def test_through_the_hand_over_no_force_changes_more_than_the_skin_moves() -> None:
    """A digit's force grows by at most 6 N for each millimetre pressed in: two fingertips of 9 mm at 150 kPa per unit of
    field give 4 N/mm at their steepest, and two bones of a digit may press at once. What slides adds friction, half of
    the normal force at most."""
    stiffness, change = 6e3, 0.0
    views = played(*HAND_OVER)
    for before, after in pairwise(views[1:]):
        for hand in after.hands:
            old = of(before, hand.participant, hand.right)
            touches = {(t.digit, t.body): t for t in hand.touches}
            were = {(t.digit, t.body): t for t in old.touches} if old is not None else {}
            allowed = 0.05
            for key in touches.keys() | were.keys():
                t, w = touches.get(key), were.get(key)
                pressed = abs((t.depth if t else 0.0) - (w.depth if w else 0.0))
                slid = 0.5 * max(t.normal_force if t else 0.0, w.normal_force if w else 0.0)
                turned = float(np.linalg.norm(t.point - w.point)) if t and w else 0.0
                allowed += stiffness * (pressed + 0.5 * turned) + slid
            step = np.linalg.norm(hand.force - (old.force if old is not None else 0.0))
            change = max(change, float(step))
            assert step <= allowed, (after.step, hand.participant, hand.right, step, allowed)
    assert change > 0.5


def test_what_is_held_is_felt_by_fingers_on_both_sides() -> None:
    views = played(*HAND_OVER)
    begins = next(n for n, v in enumerate(views) if any(g.thing == "baton" for g in v.grasps))
    holding = views[begins + 30]
    grasp = holding.grasps[0]
    hand = of(holding, grasp.participant, grasp.right)
    assert hand is not None
    digits = {t.digit for t in hand.touches if t.body == "baton"}
    assert len(digits - {PALM}) >= 2


def test_a_hand_that_leaves_is_published_once_without_touches() -> None:
    from test_world_steps import Play, at, reaching

    play = Play("ann")
    low, high = reaching(np.array([0.0, TABLE_HEIGHT + 0.02, 0.25]), 0.0), reaching(at(0, 0.4, 0), 0.0)
    assert [h.touches == () for h in play.step({"ann": low}).hands if h.right] == [False]
    assert [h.touches == () for h in play.step({"ann": high}).hands if h.right] == [True]
    assert not [h for h in play.step({"ann": high}).hands if h.right]
    again = World.restore(play.world.snapshot())
    assert again.snapshot() == play.world.snapshot()


def test_the_same_inputs_give_the_same_forces() -> None:
    for one, two in zip(played(*PALMS), played.__wrapped__(*PALMS), strict=True):
        for a, b in zip(one.hands, two.hands, strict=True):
            assert a.force.tobytes() == b.force.tobytes()
            assert a.torque.tobytes() == b.torque.tobytes()


@settings(max_examples=80, deadline=None)
@given(st.lists(st.floats(-0.02, 0.02), min_size=16, max_size=16), st.sampled_from([0.0, 0.02, 1.0]))
def test_any_two_limbs_give_finite_forces(numbers: list[float], soft: float) -> None:
    """Bones of no length, one swallowed by the other, far too deep: nothing is not a number."""
    a = cones([*numbers[0:6], abs(numbers[6]) + 1e-4, abs(numbers[7]) + 1e-4])
    b = cones([*numbers[8:14], abs(numbers[14]) + 1e-4, abs(numbers[15]) + 1e-4])
    rows = felt(a, b, 1.0, soft)
    assert np.isfinite(rows).all()
    assert (rows[:, 12:] >= 0).all()
