"""Commands that cannot be done: for things that are gone, by people who left, with absurd numbers. One line each, no harm."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vistel.figure.posture.posture import standing
from vistel.space.actions import Action, Delete, Move, Scale
from vistel.space.arguments import Which
from vistel.space.inputs import CommandInput, MotionInput, ParticipantBody, StepInputs
from vistel.space.room import meeting_room
from vistel.space.view import Outcome
from vistel.space.world import World


class _Room:
    def __init__(self) -> None:
        self.world = World(meeting_room(2))
        people = (ParticipantBody("ann"), ParticipantBody("ben"))
        motions = tuple(MotionInput(p.participant, standing(), 1, 1) for p in people)
        self.world.step(StepInputs(1, 1, people, motions))

    def ask(self, action: Action, who: str = "ann", left: tuple[str, ...] = ()) -> Outcome:
        n = self.world.step_number + 1
        view = self.world.step(StepInputs(n, n, left=left, commands=(CommandInput(f"c{n}", who, action),)))
        return view.outcomes[0]


def test_a_thing_that_is_gone_cannot_be_moved_and_the_reason_names_it() -> None:
    room = _Room()
    assert room.ask(Delete(Which("ball"))).done
    answer = room.ask(Move(Which("ball"), np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])))
    assert not answer.done and "ball" in answer.reason and "\n" not in answer.reason


def test_who_has_left_asks_in_vain() -> None:
    room = _Room()
    answer = room.ask(Delete(Which("ball")), who="ben", left=("ben",))
    assert not answer.done and answer.reason == "ben is not in the room"
    assert not room.ask(Delete(Which("ball")), who="nobody-ever").done
    assert room.ask(Delete(Which("ball"))).done, "the ball is gone, though who asked had left"


@pytest.mark.parametrize("number", [1e9, -1e9, math.nan, math.inf, 0.0])
def test_absurd_numbers_are_refused_and_change_nothing(number: float) -> None:
    room = _Room()
    before = room.world.snapshot()
    assert not room.ask(Scale(Which("ball"), number)).done
    place = np.array([number if number else math.nan, 0.8, 0.0])
    assert not room.ask(Move(Which("ball"), place, np.array([0.0, 0.0, 0.0, 1.0]))).done
    shapes = room.world.snapshot()
    cut = b'"position":'
    assert shapes[shapes.index(cut) : shapes.index(b'"velocity"')] == before[before.index(cut) : before.index(b'"velocity"')]
