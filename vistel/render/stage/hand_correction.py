"""Draws a hand at the thing it holds where that is not at the real hand, and lets the arm follow.

A hand cannot move what others hold as well, what stands against furniture and what its own tracker leads. It is drawn with the
thing in it as the world laid it there, so that the two touch and do not go through each other.
"""

from dataclasses import dataclass, field

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import JointPose, Posture
from vistel.figure.posture.reach import reach
from vistel.figure.skeleton import JOINT_INDEX, Skeleton, standard_skeleton
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix, rotvec_from_matrix
from vistel.space.holding.displayed_hands import displayed_hand
from vistel.space.people import HAND_JOINT, SIDES

NO_OFFSET: tuple[F64, F64] = np.zeros(3), np.zeros(3)
"""No rotation, no shift."""
SPEED = 0.3
"""A thing whose place in a hand changes is drawn to move there no faster [m/s]."""
SPIN = 3.0
"""The same for its orientation in the hand [rad/s]."""
LEAST = 1e-4
"""A hand whose offset is smaller is drawn where it is [m, rad]."""


@dataclass(frozen=True)
class ShownPerson:
    """Somebody as shown: posture, its joints in the room, and the skeleton they are of."""

    posture: Posture
    joints: JointPose
    skeleton: Skeleton = field(default_factory=standard_skeleton)


def towards(now: Pose, wanted: Pose, seconds: float) -> Pose:
    """Where a thing lies in a hand after `seconds` on its way to where it is wanted."""
    step = wanted.position - now.position
    turn = wanted.matrix @ now.matrix.T
    way = rotvec_from_matrix(np.ascontiguousarray(turn))
    needed = max(float(np.linalg.norm(step)) / SPEED, float(np.linalg.norm(way)) / SPIN)
    if needed <= seconds:
        return wanted
    share = seconds / needed
    turned = matrix_from_rotvec(share * way) @ now.matrix
    return Pose(now.position + share * step, quaternion_from_matrix(np.ascontiguousarray(turned)))


def hand_offset(joints: JointPose, right: bool, thing: Pose, lies: Pose) -> tuple[F64, F64]:
    """By what a hand is drawn off its place: rotation vector (3,) and shift (3,) [m], room.

    thing: where it is drawn; lies: where it lies in the frame of the hand as that is drawn.
    """
    j = HAND_JOINT[int(right)]
    own = joints.rotation[j], joints.position[j]
    rotation, position = displayed_hand(own, thing, lies)
    return rotvec_from_matrix(np.ascontiguousarray(rotation @ own[0].T)), position - own[1]


def moved_hand(shown: ShownPerson, posture: Posture, right: bool, share: float, off: tuple[F64, F64]) -> Posture:
    """`posture`, one hand of which is moved by a share of `off`; the elbow swivels as little as it can.

    An arm that comes with joints of its own (`Posture.joints`) stays as it is: nobody knows what holds them together.
    """
    turn, shift = share * off[0], share * off[1]
    side = SIDES[int(right)]
    arm = [JOINT_INDEX[f"{side}_{part}"] for part in ("upper_arm", "lower_arm", "hand")]
    if max(float(np.abs(turn).max()), float(np.abs(shift).max())) < LEAST or any(name.startswith(side) for name in posture.joints):
        return posture
    joints = shown.joints
    position, rotation = joints.position[arm[2]] + shift, matrix_from_rotvec(turn) @ joints.rotation[arm[2]]
    # The hinge of the elbow says where it points even when the arm is straight.
    hinge = joints.rotation[arm[0]][:, 1] * (1.0 if right else -1.0)
    elbow = np.cross(joints.position[arm[2]] - joints.position[arm[0]], hinge)
    return reach(shown.skeleton, posture, side, position, np.ascontiguousarray(rotation), elbow)
