"""Whose motion counts at full rate in a crowd: who touches, or may soon move a thing."""

from __future__ import annotations

import numpy as np

from vistel.figure.posture.posture import Posture, Stance, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.reach import REACH
from vistel.space.room import BATON, meeting_room
from vistel.space.world import World

STEP_NS = 16_666_667
ROOM = meeting_room(3)
BATON_AT = ROOM.thing(BATON).position


def standing_with_the_right_hand(away: float) -> Posture:
    """Somebody whose right wrist is `away` metres above the baton."""
    still = standing()
    hand = pose_joints(standard_skeleton(), still).position[JOINT_INDEX["right_hand"]]
    return Posture(still.dofs, stance=Stance(BATON_AT + np.array([0.0, away, 0.0]) - hand, 0.0))


def reaching_after_a_step(room_world: World, postures: dict[str, Posture]) -> frozenset[str]:
    motions = tuple(MotionInput(who, p, 1, STEP_NS) for who, p in sorted(postures.items()))
    room_world.step(StepInputs(1, STEP_NS, tuple(ParticipantBody(who) for who in sorted(postures)), motions, (), ()))
    return room_world.reaching


def test_who_has_a_hand_near_a_loose_thing_is_reaching_and_who_stands_far_away_is_not() -> None:
    near, far = standing_with_the_right_hand(REACH - 0.05), standing_with_the_right_hand(REACH + 3.0)
    assert reaching_after_a_step(World(ROOM), {"ann": near, "ben": far}) == {"ann"}


def test_who_touches_somebody_far_from_all_things_is_reaching_and_so_is_who_is_touched() -> None:
    ann = standing_with_the_right_hand(6.0)
    hand = pose_joints(standard_skeleton(), ann).position[JOINT_INDEX["right_hand"]]
    chest = pose_joints(standard_skeleton(), standing()).position[JOINT_INDEX["spine_7"]]
    ben = Posture(standing().dofs, stance=Stance(hand - chest, 0.0))
    alone = Posture(standing().dofs, stance=Stance(np.array([9.0, 9.0, 9.0]), 0.0))
    assert reaching_after_a_step(World(ROOM), {"ann": ann, "ben": ben, "cas": alone}) == {"ann", "ben"}


def test_in_an_empty_room_nobody_is_reaching() -> None:
    assert World(ROOM).reaching == frozenset()
