"""A hand put somewhere: the arm that holds it there."""

from dataclasses import replace

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.arm import arm_dofs, bones_of
from vistel.figure.posture.posture import ELBOW, SHOULDER, WRIST, Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, Skeleton


def reach(skeleton: Skeleton, posture: Posture, side: str, wrist: F64, hand: F64, elbow: F64) -> Posture:
    """The posture with one arm's wrist at a place, as near as the arm comes.

    side: "left" or "right"; wrist: (3,) of the hand's joint, hand: (3, 3) its rotation (`hands.hand_rotation` makes one),
    elbow: (3,) roughly which way from the line between shoulder and wrist the elbow points; all in the room [m].
    """
    joints = pose_joints(skeleton, posture)
    collar = JOINT_INDEX[f"{side}_shoulder"]
    chest = joints.rotation[collar]
    found, _, _ = arm_dofs(
        chest.T @ (wrist - joints.position[collar]),
        np.ascontiguousarray(chest.T @ hand),
        bones_of(skeleton, side),
        chest.T @ elbow,
        0.0,
        1.0,
    )
    dofs = posture.dofs.copy()
    dofs[SHOULDER[side]], dofs[ELBOW[side]], dofs[WRIST[side]] = found[:3], found[3], found[4:]
    return replace(posture, dofs=dofs)
