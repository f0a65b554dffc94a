"""A hand laid on a thing: which axis, palm at the surface, fingers that touch and do not go in."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from test_world_steps import FIST, Play, at, reaching, take_baton

from vistel.figure.posture.hands import OPEN
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix
from vistel.space.dynamics.solids import solids
from vistel.space.hands.axes import axes_of
from vistel.space.hands.fitting import PRESS, fit, hand_of
from vistel.space.hands.grasp import MOST_TURN, align
from vistel.space.people import PALM, THUMB, build_of
from vistel.space.room import BATON, meeting_room
from vistel.space.things.things import GraspAxis, Thing, ThingPrimitive

BUILD = build_of(1.75, 1.0)
ACROSS = np.array([0.0, 0.0, 1.0])
ROOM = meeting_room(3)
LOOSE = [t for t in ROOM.things if not t.fixed]


def thing(*primitives: ThingPrimitive, axes: tuple[GraspAxis, ...] = ()) -> Thing:
    return Thing("it", "it", "it", primitives, 0.1, 0.0, 0, np.zeros(3), axes=axes)


def test_given_axes_are_used_and_others_come_from_the_shape() -> None:
    box = thing(ThingPrimitive("superellipsoid", (0.06, 0.03, 0.02, 0.2, 0.2)))
    assert [tuple(np.abs(a.direction)) for a in axes_of(box, ACROSS)] == [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    assert [a.radius for a in axes_of(box, ACROSS)] == [0.02, 0.02, 0.03]
    given_axis = GraspAxis(np.zeros(3), np.array([0.0, 1.0, 0.0]), 0.01)
    assert axes_of(thing(*box.primitives, axes=(given_axis,)), ACROSS) == (given_axis,)
    ring = thing(ThingPrimitive("supertoroid", (0.01, 0.01, 0.01, 4.0, 1.0, 1.0)))
    for a in axes_of(ring, ACROSS):
        assert np.linalg.norm(a.point) == pytest.approx(0.04)
        assert a.direction @ a.point == pytest.approx(0.0, abs=1e-12)
    bar = ThingPrimitive("cone_sphere", (-0.1, 0.0, 0.0, 0.1, 0.0, 0.0, 0.01, 0.02))
    (along,) = axes_of(thing(bar), ACROSS)
    assert tuple(along.direction) == (1, 0, 0) and along.radius == pytest.approx(0.015)
    assert axes_of(thing(ThingPrimitive("superellipsoid", (0.3, 0.2, 0.2, 0.2, 0.2))), ACROSS) == ()  # too thick for a hand


def test_the_axis_that_needs_the_least_turn_comes_across_the_palm() -> None:
    box = next(t for t in LOOSE if t.id == "box")
    for first, second in ((np.array([1.0, 0, 0]), 0), (np.array([0, 1.0, 0]), 1)):
        # Turned so that one axis is 20 degrees off the hand's.
        off = matrix_from_rotvec(np.array([0.0, np.radians(20.0), 0.0]))
        start = off @ _turn(first, ACROSS)
        lie = Pose(BUILD.palm[1] - np.array([0.0, 0.035, 0.0]), quaternion_from_matrix(np.ascontiguousarray(start)))
        turned = align(box, lie, BUILD.palm[1]).matrix
        assert abs(turned[:, second] @ ACROSS) == pytest.approx(1.0, abs=1e-9)


def _turn(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    axis = np.cross(a, b)
    sine = float(np.linalg.norm(axis))
    return matrix_from_rotvec(axis / sine * np.arctan2(sine, float(a @ b))) if sine > 1e-9 else np.eye(3)


def test_a_ball_needs_no_turn_and_nothing_is_turned_too_far() -> None:
    ball = next(t for t in LOOSE if t.id == "ball")
    q = quaternion_from_matrix(matrix_from_rotvec(np.array([0.3, -1.0, 0.8])))
    assert align(ball, Pose(BUILD.palm[1], q), BUILD.palm[1]).rotation == pytest.approx(q)
    baton = next(t for t in LOOSE if t.id == BATON)
    far = quaternion_from_matrix(matrix_from_rotvec(np.array([0.0, 0.5 * np.pi - MOST_TURN - 0.05, 0.0])))
    assert align(baton, Pose(BUILD.palm[1], far), BUILD.palm[1]).rotation == pytest.approx(far)


@pytest.mark.parametrize("held", LOOSE, ids=lambda t: t.id)
def test_however_a_thing_is_held_the_fingers_go_in_by_less_than_a_millimetre(held: Thing) -> None:
    part, hand = solids((held,)).part(0), hand_of(BUILD, True)
    for closing, yaw, low, to_palm in product((0.5, 1.0), (-0.3, 0.3), (0.015, 0.05), (False, True)):
        turn = matrix_from_rotvec(np.array([0.0, yaw, 0.0]))
        lying = part.moved(turn, BUILD.palm[1] - np.array([0.0, low, 0.0]))
        found = fit(BUILD, True, OPEN + closing * (FIST - OPEN), (True,) * 4, lying, to_palm=to_palm)
        depth, _ = hand.depths(found.fingers, lying.moved(np.eye(3), found.shift))
        assert found.depth == depth.max() <= 0.001, (closing, yaw, low, to_palm)


def test_fingers_that_hold_are_drawn_on_until_they_touch() -> None:
    s = solids((next(t for t in LOOSE if t.id == "ball"),))
    lying = s.part(0).moved(np.eye(3), BUILD.palm[1] - np.array([0.0, 0.038, 0.0]))
    fingers = OPEN + 0.35 * (FIST - OPEN)  # not yet at it
    hand = hand_of(BUILD, True)
    assert hand.depths(fingers, lying)[0][hand.digit != PALM].max() < 0.02
    found = fit(BUILD, True, fingers, (True,) * 4, lying, to_palm=True)
    depth, _ = hand.depths(found.fingers, lying.moved(np.eye(3), found.shift))
    for digit in range(1, 5):
        assert 0.0 < depth[hand.digit == digit].max() <= 1.05 * PRESS
    assert depth[hand.digit == PALM].max() > -0.001
    assert depth[hand.digit == THUMB].max() <= PRESS * 1.05


def test_the_world_publishes_contacts_of_a_hand_as_it_is_seen_on_what_it_holds() -> None:
    play = Play("ann")
    take_baton(play)
    for _ in range(15):
        view = play.step({"ann": reaching(at(0.0, 0.1, 0.0), 1.0)})
    (grasp,) = view.grasps
    assert grasp.fingers.shape == (20,) and np.abs(grasp.fingers).max() > 0.3
    depths = [c.depth for c in view.contacts if c.body_b == BATON]
    assert len(depths) >= 2
    assert 0.0 < max(depths) <= 0.001


def test_recorded_hands_take_what_they_close_round_and_nothing_else(shared_data: Path) -> None:
    """A few of what `vistel bench grasp` plays by the hundred."""
    from benchmarks.figures import grasp_trials as trials

    assert (shared_data / "hand").is_dir()
    true = [t for t in trials.true_trials(1) if t.name.split(", ")[1].split()[0] in ("ball", "pill") and "grab 1" not in t.name]
    assert len(true) == 2
    assert all(trials.found(trials.run(t)) for t in true)
    false = [t for t in trials.false_trials(2) if t.name in ("HandSplay-110fps, on can 1", "grab 2, beside baton 1")]
    assert len(false) == 2
    assert not [t.name for t in false if trials.run(t).took is not None]
