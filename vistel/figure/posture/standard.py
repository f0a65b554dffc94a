"""Postures in which an avatar is looked at: limbs stretched, folded and twisted as far as people do."""

import math

import numpy as np

from vistel.figure.posture import posture as dof
from vistel.figure.posture.hands import FIST
from vistel.figure.posture.posture import Posture, standing
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix, rotvec_from_quaternion


def standard_postures() -> dict[str, Posture]:
    """A dozen, by name."""
    rest, stand = Posture(), standing()
    return {
        "t-pose": rest,
        "standing": stand,
        "sitting": _body(stand, ankle=4, knee=92, elbow=70, hang=78, forward=14),
        "table": _body(stand, ankle=4, knee=92, elbow=72, hang=72, forward=34, spine=(10, 0, 0), neck=(8, 0, 0)),
        "overhead": _body(stand, hang=-78),
        "elbow": _body(stand, elbow=148, hang=78),
        "twist": _twisted(rest, 90.0),
        "wave": _one_side(stand, elbow=95, hang=-10, roll=-95),
        "bow": _body(stand, spine=(52, 0, 0), neck=(18, 0, 0), hang=74),
        "turn": _body(stand, spine=(0, 38, 0), neck=(0, 48, 0), hang=74),
        "lean": _body(stand, spine=(0, 0, -26), neck=(0, 0, -14), hang=66),
        "squat": _body(stand, ankle=34, knee=122, elbow=12, hang=76, forward=84, spine=(22, 0, 0)),
        "fists": _fists(_body(stand, elbow=105, hang=74, forward=24)),
    }


def _body(
    base: Posture,
    *,
    ankle: float = 0,
    knee: float = 0,
    elbow: float = 8,
    hang: float = 80,
    forward: float = 0,
    spine: tuple[float, float, float] = (0, 0, 0),
    neck: tuple[float, float, float] = (0, 0, 0),
) -> Posture:
    """Degrees; hang: of the upper arms below the horizontal; forward: then swung to the front."""
    dofs = np.zeros(dof.DOF_COUNT)
    dofs[dof.ANKLE], dofs[dof.KNEE] = math.radians(ankle), math.radians(knee)
    dofs[dof.SPINE_ROTATION], dofs[dof.NECK] = np.radians(spine), np.radians(neck)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[dof.ELBOW[side]] = math.radians(elbow)
        down = matrix_from_rotvec(np.array((0.0, 0.0, -sign * math.radians(hang))))
        front = matrix_from_rotvec(np.array((-math.radians(forward), 0.0, 0.0)))
        dofs[dof.SHOULDER[side]] = rotvec_from_quaternion(quaternion_from_matrix(front @ down))
    return Posture(dofs, base.hands, base.stance, base.gaze)


def _one_side(base: Posture, *, elbow: float, hang: float, roll: float) -> Posture:
    """The right arm up with its palm to the front, the left one hanging."""
    dofs = base.dofs.copy()
    up = matrix_from_rotvec(np.array((0.0, 0.0, math.radians(hang))))
    about = matrix_from_rotvec(np.array((math.radians(roll), 0.0, 0.0)))
    dofs[dof.SHOULDER["right"]] = rotvec_from_quaternion(quaternion_from_matrix(up @ about))
    dofs[dof.ELBOW["right"]] = math.radians(elbow)
    return Posture(dofs, base.hands, base.stance, base.gaze)


def _twisted(base: Posture, degrees: float) -> Posture:
    dofs = base.dofs.copy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[dof.WRIST[side]] = (sign * math.radians(degrees), 0.0, 0.0)
    return Posture(dofs, base.hands, base.stance, base.gaze)


def _fists(base: Posture) -> Posture:
    return Posture(base.dofs, np.stack([FIST, FIST]), base.stance, base.gaze)
