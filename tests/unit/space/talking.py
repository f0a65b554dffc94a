"""Somebody at the table who asks the world for things, and what it answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from test_world_steps import Play

from vistel.figure.posture.posture import Posture, Stance, standing
from vistel.space.actions import Action
from vistel.space.inputs import CommandInput
from vistel.space.room import meeting_room
from vistel.space.things.things import Thing
from vistel.space.view import Outcome

ROOM = meeting_room(3)


def stands(x: float, z: float, heading: float) -> Posture:
    return replace(standing(), stance=Stance(np.array([x, standing().stance.position[1], z]), heading))


class Talk:
    """Ann stands at the table's side and says things; at -Z she faces +Z, so that her right hand is towards -X."""

    def __init__(self, *people: str) -> None:
        self.play = Play(*(people or ("ann",)))
        self.k = 0
        self.play.step({"ann": stands(0.0, -0.9, 0.0)})

    def say(self, action: Action | None, who: str = "ann") -> Outcome:
        self.k += 1
        return self.play.step({}, CommandInput(f"c{self.k}", who, action)).outcomes[-1]

    def wait(self, steps: int) -> None:
        for _ in range(steps):
            self.play.step({})

    def thing(self, name: str) -> Thing:
        return next(t for t in self.play.views[-1].things if t.id == name)

    def place(self, name: str) -> np.ndarray:
        return self.play.thing(name).position


def done(outcome: Outcome) -> tuple[str, ...]:
    assert outcome.done, outcome.reason
    return outcome.things


def refused(outcome: Outcome) -> str:
    assert not outcome.done
    return outcome.reason
