"""Somebody with an avatar of their own is touched where that avatar is, not where an average person would be."""

from __future__ import annotations

import numpy as np
import pytest
from avatar_fixture import THICKER, long_armed

from vistel.figure.avatar.proportions import Proportions
from vistel.figure.body import pose_body
from vistel.figure.posture.posture import Posture, Stance, pose_joints
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.people import DIGITS, PALM, build_like, build_of
from vistel.space.room import TABLE_HEIGHT, meeting_room
from vistel.space.view import WorldView
from vistel.space.world import World

STEP_NS = 16_666_667
LIMBS = Proportions.of(long_armed().skeleton, long_armed().body)
OWN = build_like(LIMBS)
TABLE_RADIUS = next(t for t in meeting_room(3).things if t.id == "table").primitives[0].params[0]


def over_the_table(depth: float) -> Posture:
    """In the T-pose beside the table, her left forearm, the lowest of her arm, `depth` metres in its top."""
    posed = pose_body(OWN.body, pose_joints(OWN.skeleton, Posture(np.zeros(25))))
    forearm = OWN.body.names.index("left_forearm")
    elbow, lowest = posed.a[forearm], posed.a[forearm, 1] - posed.radius_a[forearm]
    edge = np.array([-TABLE_RADIUS + 0.02 - elbow[0], TABLE_HEIGHT - depth - lowest, -elbow[2]])
    return Posture(np.zeros(25), stance=Stance(edge, 0.0))


def touching(person: ParticipantBody, posture: Posture) -> tuple[World, WorldView]:
    world = World(meeting_room(3))
    view = world.step(StepInputs(1, STEP_NS, (person,), (MotionInput("ann", posture, 1, STEP_NS),)))
    return world, view


def pressed(view: WorldView) -> list[float]:
    of_forearm = OWN.body.names.index("left_forearm")
    return [c.depth for c in view.contacts if c.body_b == "table" and c.primitive_a == of_forearm]


def test_a_thick_forearm_presses_on_the_table_where_an_average_one_does_not_reach() -> None:
    assert THICKER > 1.0
    posture = over_the_table(0.003)
    _, own = touching(ParticipantBody("ann", proportions=LIMBS), posture)
    _, average = touching(ParticipantBody("ann", 1.75), posture)
    assert max(pressed(own)) == pytest.approx(0.003, abs=1e-5)
    assert not pressed(average)


def test_a_snapshot_keeps_them() -> None:
    world, _ = touching(ParticipantBody("ann", proportions=LIMBS), over_the_table(0.003))
    again = World.restore(world.snapshot())
    assert again.snapshot() == world.snapshot()
    motion = (MotionInput("ann", over_the_table(0.004), 2, 2 * STEP_NS),)
    views = [w.step(StepInputs(2, 2 * STEP_NS, (), motion)) for w in (world, again)]
    assert pressed(views[0]) == pressed(views[1]) != []


def test_digits_and_palm_are_found_by_their_joints() -> None:
    assert np.array_equal(OWN.digit, build_of(1.75, 1.0).digit)
    assert OWN.digit[OWN.body.names.index("right_palm")] == DIGITS + PALM


def test_the_palm_lies_at_the_surface_of_the_own_hand() -> None:
    standard = build_like(Proportions.of(build_of(1.75, 1.0).skeleton, build_of(1.75, 1.0).body))
    assert np.allclose(standard.palm, build_of(1.75, 1.0).palm, atol=0.002)
    assert OWN.palm[0, 1] < standard.palm[0, 1] - 0.001
    assert np.allclose(OWN.palm[0] * (-1, 1, 1), OWN.palm[1], atol=0.002)
