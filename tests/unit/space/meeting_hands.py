"""People whose hands meet."""

from __future__ import annotations

import numpy as np
from test_world_steps import SKELETON

from vistel.figure.posture.hands import RELAXED, hand_rotation
from vistel.figure.posture.posture import ELBOW, SHOULDER, WRIST, Posture, Stance, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_rotvec, rotation_y, rotvec_from_matrix
from vistel.space.people import HAND_JOINT, build_of

BUILD = build_of(1.75, 1.0)
CLEAR = np.array([2.0, 0.0, 0.0])
"""Beside the table and the chairs."""
SHAKE = CLEAR + np.array([0.0, 1.0, 0.0])
SIDEWAYS, AHEAD, UP = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])


def with_hand(palm: np.ndarray, fingers: np.ndarray, facing: np.ndarray, heading: float, angles: np.ndarray) -> Posture:
    """Somebody who looks along `heading`, elbow bent, the right palm at `palm`, fingers along `fingers`, palm to `facing`."""
    dofs = standing().dofs.copy()
    raised = matrix_from_rotvec(np.array([-0.5, 0.0, 0.0])) @ matrix_from_rotvec(dofs[SHOULDER["right"]])
    dofs[SHOULDER["right"]] = rotvec_from_matrix(np.ascontiguousarray(raised))
    dofs[ELBOW["right"]] = 1.0
    hands = np.stack([RELAXED, angles])
    pose = pose_joints(SKELETON, Posture(dofs, stance=Stance(np.zeros(3), heading)))
    forearm = pose.rotation[JOINT_INDEX["right_lower_arm"]]
    dofs[WRIST["right"]] = rotvec_from_matrix(np.ascontiguousarray(forearm.T @ hand_rotation(-1.0, fingers, facing)))
    pose = pose_joints(SKELETON, Posture(dofs, hands, Stance(np.zeros(3), heading)))
    j = HAND_JOINT[1]
    reached = pose.position[j] + pose.rotation[j] @ BUILD.palm[1]
    return Posture(dofs, hands, Stance(palm - reached, heading))


def mirrored(palm: np.ndarray, press: float, fingers: np.ndarray, facing: np.ndarray, angles: np.ndarray) -> dict[str, Posture]:
    """Two people who face each other and do the same with their right hands, each `press` metres beyond the middle."""
    half = rotation_y(np.pi)
    ann = with_hand(palm + press * facing, fingers, facing, 0.0, angles)
    bob = with_hand(palm + press * half @ facing, half @ fingers, half @ facing, np.pi, angles)
    return {"ann": ann, "bob": bob}
