"""One hand, or two, at one thing: the postures that the world is given, when they truly take hold, and what the world says."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.figures import grasp_trials as of_recordings
from vistel.figure.posture.posture import Posture
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.room import Extra, meeting_room
from vistel.space.things.things import Thing
from vistel.space.world import APPEARING_STEPS, World

RATE_HZ, STEP_NS = of_recordings.RATE_HZ, of_recordings.STEP_NS
LATE = round(0.25 * RATE_HZ)
"""Frames after the truth within which a grasp or a release counts as found."""
CARRIED = 0.06
"""A thing that is held goes up by so much with the hand [m]; hands rise further."""
WHO = "p"
"""The only person in the room."""


@dataclass(frozen=True)
class Trial:
    """postures: of each frame at RATE_HZ; begins, closes, eases, opens: frames from which on a grasp may be seen, and in which
    the hand truly takes hold, begins to open, and is off the thing (None: never). height: of the person as the system knows it
    [m]; things: what is on the table instead of the things of the room; extras: beside those."""

    name: str
    kind: str
    thing: str
    postures: tuple[Posture, ...]
    height: float
    begins: int | None = None
    closes: int | None = None
    eases: int | None = None
    opens: int | None = None
    things: tuple[Thing, ...] = ()
    extras: tuple[Extra, ...] = ()


@dataclass(frozen=True)
class Ran:
    """What a rule made of a trial: the frame in which it saw the thing taken (None: never), and let go after that; whether the
    thing went up with the hand."""

    trial: Trial
    took: int | None
    left: int | None
    lifted: bool

    @property
    def found(self) -> bool:
        """The true grasp was found in time, and carried the thing."""
        begins, closes = self.trial.begins, self.trial.closes
        return None not in (begins, closes, self.took) and begins <= self.took <= closes + LATE and self.lifted

    @property
    def released(self) -> bool:
        """The hand let go in time, and not before it began to open."""
        t = self.trial
        return t.eases is not None and t.opens is not None and self.left is not None and t.eases <= self.left <= t.opens + LATE


def world_of(trial: Trial) -> World:
    """The room with the thing, in which the person has been for a while, far from it."""
    room = meeting_room(3, list(trial.extras))
    if trial.things:  # and no others within reach
        room = replace(room, things=(*(t for t in room.things if t.fixed), *trial.things))
    world = World(room)
    away = trial.postures[0]
    away = replace(away, stance=replace(away.stance, position=away.stance.position + np.array([0.0, 0.4, 0.0])))
    for k in range(1, APPEARING_STEPS + 2):
        people = (ParticipantBody(WHO, trial.height),) if k == 1 else ()
        world.step(StepInputs(k, k * STEP_NS, people, (MotionInput(WHO, away, k, k * STEP_NS),)))
    return world


def play(trial: Trial) -> Ran:
    """What the world makes of a trial."""
    world = world_of(trial)
    k = world.step_number
    took = left = None
    start = 0.0
    lifted = False
    for frame, posture in enumerate(trial.postures):
        k += 1
        view = world.step(StepInputs(k, k * STEP_NS, (), (MotionInput(WHO, posture, k, k * STEP_NS),)))
        high = next(float(s.position[1]) for s in view.states if s.id == trial.thing)
        has = any(g.thing == trial.thing for g in view.grasps)
        if has and took is None:
            took, start = frame, high
        if took is not None and not has and left is None:
            left = frame
        lifted = lifted or (has and high - start > CARRIED)
    return Ran(trial, took, left, lifted)


def of_recorded(trial: of_recordings.Trial) -> Trial:
    """A recorded hand that comes from above, does what was recorded, and goes up once it has been closed for long enough."""
    lead = 12
    held_on = of_recordings.HELD_ON if trial.opens is None and trial.closes is not None else 0
    rise, postures = 0.0, []
    for frame in range(-lead, len(trial.fingers) + held_on):
        if trial.closes is not None and trial.closes + LATE < frame and (trial.opens is None or frame <= trial.opens):
            rise = min(0.2, rise + 0.006)
        n = min(max(0, frame), len(trial.fingers) - 1)
        at = trial.palm + np.array([0.0, 0.12 * max(0.0, -frame / lead) + rise, 0.0]) + (trial.way[n] if len(trial.way) else 0.0)
        postures.append(of_recordings.hand_at(at, trial.heading, trial.fingers[n], trial.face, trial.height))
    extras = [Extra(n, n, shape, r, 0.02, 1.0, 0, -0.2, 0.2) for n, shape, r in of_recordings.SMALL if n == trial.thing]
    begins = None if trial.closes is None else lead  # the strength begins to rise there, and says no more until it is high
    closes, opens = (None if f is None else f + lead for f in (trial.closes, trial.opens))
    return Trial(
        trial.name, "recorded", trial.thing, tuple(postures), trial.height, begins, closes, closes, opens, trial.own, tuple(extras)
    )
