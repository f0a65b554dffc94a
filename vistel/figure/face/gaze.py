"""Where eyes look: both at one point, nearer or farther."""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import JointPose, Posture
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import multiply, quaternion_from_matrix, rotation_x, rotation_y, rotvec_from_quaternion

NEAREST = 0.25
"""Distance of what is looked at, at least [m]."""
FARTHEST = 8.0
"""Distance of what is looked at, at most [m]."""
ASIDE = math.radians(7.0)
"""How far from where the eyes point something may be to be what they look at."""
_EYES = (JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"])


def distance_looked_at(joints: JointPose, others: Iterable[F64]) -> float:
    """How far away what a person looks at is [m]: of the places `others` (3,) in the room the one nearest to where both eyes
    point; FARTHEST where there is none."""
    middle = 0.5 * (joints.position[_EYES[0]] + joints.position[_EYES[1]])
    ahead = joints.rotation[_EYES[0]][:, 2] + joints.rotation[_EYES[1]][:, 2]
    ahead = ahead / np.linalg.norm(ahead)
    best, found = math.cos(ASIDE), FARTHEST
    for place in others:
        to = place - middle
        away = float(np.linalg.norm(to))
        if away > NEAREST and float(to @ ahead) / away > best:
            best, found = float(to @ ahead) / away, min(away, FARTHEST)
    return found


def converged(posture: Posture, eyes_apart: float, away: float) -> Posture:
    """The posture with both eyes turned to a point `away` [m] along its gaze. eyes_apart: between their centres [m]. Eyes that the
    posture turns itself stay."""
    if "left_eye" in posture.joints or "right_eye" in posture.joints:
        return posture
    inward = math.atan2(0.5 * eyes_apart, max(away, NEAREST))
    turned = {
        name: _rotvec(float(posture.gaze[0]) + sign * inward, float(posture.gaze[1]))
        for name, sign in (("left_eye", -1.0), ("right_eye", 1.0))
    }
    return replace(posture, joints={**posture.joints, **turned})


def _rotvec(yaw: float, pitch: float) -> F64:
    return rotvec_from_quaternion(quaternion_from_matrix(multiply(rotation_y(yaw), rotation_x(-pitch))))
