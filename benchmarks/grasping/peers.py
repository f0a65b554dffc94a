"""What games do, on the same trajectories: a thing is taken by a pinch or a fist that is near it, and let go when that opens."""

import numpy as np

from benchmarks.grasping.trials import Ran, Trial
from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.contacts.contact import find_contacts
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.dynamics.solids import solids
from vistel.space.hands.approach import tips
from vistel.space.inputs import ParticipantBody
from vistel.space.people import PALM, PersonState, pose_figure

NAME = "distance and pinch, as games have it"
PINCHED = 0.02
"""Tips of thumb and index finger so near to each other are a pinch [m]..."""
UNPINCHED = 0.04
"""... until they are so far apart [m]."""
FIST = 0.06
"""Fingertips on average so near to the palm are a fist [m]..."""
UNFIST = 0.085
"""... until they are so far from it [m]."""
NEAR = 0.03
"""The nearest thing within this distance of the pinch, or of the palm, is taken [m]."""


def play(trial: Trial) -> Ran:
    """What the rule makes of a trial with one thing of its own. The thing stays until it is taken, and goes with the hand from
    then."""
    thing = trial.things[0]
    part = solids((thing,)).part(0).moved(matrix_from_quaternion(thing.rotation), thing.position)
    took = left = None
    by = None
    was = {("pinch", right): True for right in (False, True)} | {("fist", right): True for right in (False, True)}
    for frame, posture in enumerate(trial.postures):
        figure = PersonState(ParticipantBody("p", trial.height), posture)
        posed = pose_figure(figure, 0)
        assert posed is not None
        for right in (False, True):
            at = tips(posed, right)
            shapes = {"pinch": (_apart(at[0], at[1]), PINCHED, UNPINCHED, 0.5 * (at[0] + at[1]))}
            shapes["fist"] = (float(np.mean([_apart(at[PALM], x) for x in at[1:PALM]])), FIST, UNFIST, at[PALM])
            for shape, (apart, closes, opens, where) in shapes.items():
                begins = apart < closes and not was[shape, right]
                was[shape, right] = apart < (opens if was[shape, right] else closes)
                if begins and took is None and _near(where, part):
                    took, by = frame, (shape, right)
                if by == (shape, right) and left is None and took is not None and not was[shape, right]:
                    left = frame
    return Ran(trial, took, left, took is not None)


def _apart(a: F64, b: F64) -> float:
    return float(np.sqrt((a - b) @ (a - b)))


def _near(at: F64, part: PrimitiveSet) -> bool:
    point = PrimitiveSet.of_cone_spheres(at[None], at[None], np.array([1e-3]), np.array([1e-3]))
    return len(find_contacts(point, part, margin=NEAR)) > 0
