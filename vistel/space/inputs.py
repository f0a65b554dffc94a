"""Inputs of one step of the world. They and the state before determine everything the world does."""

import math
from dataclasses import dataclass, field

import numpy as np

from vistel.arrays import F64
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.posture.posture import DOF_COUNT, HAND_DOF_COUNT, Posture
from vistel.figure.skeleton import JOINT_INDEX
from vistel.space.actions import Action

FURTHEST = 50.0
"""Stances further than this from the room's centre are refused [m]."""


@dataclass(frozen=True)
class ParticipantBody:
    """A participant's body for contacts: standing height [m] and girth (1 = average). A participant with their own avatar has
    proportions instead; then only these count."""

    participant: str
    height: float = 1.75
    build: float = 1.0
    proportions: Proportions | None = None


@dataclass(frozen=True)
class MotionInput:
    """The newest posture of a participant. seq, t_ns: number and capture time of the message it came in."""

    participant: str
    posture: Posture
    seq: int
    t_ns: int


@dataclass(frozen=True)
class PropInput:
    """The pose of a tracked thing: position (3,) [m], rotation (4,) quaternion (x, y, z, w), room frame.

    t_ns: when it was measured, conference time; velocity (3,) [m/s], spin (3,) [rad/s] then. led_by: the participant who leads
    it with a mouse, empty if it has a receiver; let_go: this is the last input, and the thing is free afterwards.
    """

    thing: str
    position: F64
    rotation: F64
    t_ns: int
    velocity: F64 = field(default_factory=lambda: np.zeros(3))
    spin: F64 = field(default_factory=lambda: np.zeros(3))
    led_by: str = ""
    let_go: bool = False


@dataclass(frozen=True)
class CommandInput:
    """A participant's command. action: None for an unknown command, which the world refuses with a reason."""

    id: str
    participant: str
    action: Action | None


@dataclass(frozen=True)
class StepInputs:
    """One step: its number, its conference time [ns], and the inputs since the step before."""

    step: int
    t_ns: int
    people: tuple[ParticipantBody, ...] = ()
    motions: tuple[MotionInput, ...] = ()
    left: tuple[str, ...] = ()
    commands: tuple[CommandInput, ...] = ()
    props: tuple[PropInput, ...] = ()


def usable(posture: Posture) -> bool:
    """Whether every number of the posture is finite and its stance is within the world."""
    return (  # a NaN is not less than anything
        posture.dofs.shape == (DOF_COUNT,)
        and posture.hands.shape == (2, HAND_DOF_COUNT)
        and posture.stance.position.shape == (3,)
        and _within(posture.gaze, math.inf)
        and math.isfinite(posture.stance.heading)
        and _within(posture.stance.position, FURTHEST)
        and _within(posture.dofs, 20.0)
        and _within(posture.hands, 20.0)
        and all(_usable_joint(name, rotation) for name, rotation in posture.joints.items())
    )


def _usable_joint(name: str, rotation: F64) -> bool:
    return name in JOINT_INDEX and rotation.shape == (3,) and _within(rotation, 20.0)


def _within(values: F64, most: float) -> bool:
    numbers: list[float] = values.ravel().tolist()  # for so few in a third of NumPy's time
    return all(-most < x < most for x in numbers)
