"""Arms turned out of the body they belong to: postures made for another body may put an arm inside the trunk, head or a leg."""

import math
from dataclasses import replace

import numpy as np

from vistel.arrays import F64, I32
from vistel.figure.body import Body, PosedBody, pose_body
from vistel.figure.posture.posture import SHOULDER, Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS, Skeleton
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix, rotvec_from_quaternion

TOUCH = 0.0
"""How deep the primitives of an arm may press into those of the own body [m]."""
_BEYOND = 0.0005
"""Additional distance that a turn aims for [m], so that few turns are enough."""
_STEPS = 40
"""Turns of an arm, at most."""
_MOST_TURN = math.radians(5.0)
"""Of one turn [rad]."""
_SAMPLES: F64 = np.linspace(0.0, 1.0, 7)
"""Places along a primitive's axis at which its depth is measured, as shares of the axis."""


def clear_of_body(skeleton: Skeleton, body: Body, posture: Posture, touch: float = TOUCH) -> Posture:
    """The posture with arms that reach into the own trunk, head or legs turned out of them, about the shoulder.

    touch: how deep they may press [m]. For postures made for another body: a recording of somebody slim, an angle from a
    table. Arms that cannot get out within some 40 small turns end as far out as that.
    """
    dofs = posture.dofs.copy()
    for side in ("left", "right"):
        arm, rest = _arm_and_rest(body, side)
        shoulder = JOINT_INDEX[f"{side}_upper_arm"]
        for _ in range(_STEPS):
            joints = pose_joints(skeleton, replace(posture, dofs=dofs))
            depth, at, away = _deepest(pose_body(body, joints), body, arm, rest)
            if depth <= touch:
                break
            lever = at - joints.position[shoulder]
            axis = np.cross(lever, away)
            length = float(np.linalg.norm(axis))
            if length < 0.02:
                break
            turn = min(_MOST_TURN, (depth - touch + _BEYOND) / length)
            chest = joints.rotation[JOINT_INDEX[f"{side}_shoulder"]]
            local = matrix_from_rotvec(np.ascontiguousarray(chest.T @ axis / length * turn))
            now = matrix_from_rotvec(np.ascontiguousarray(dofs[SHOULDER[side]]))
            dofs[SHOULDER[side]] = rotvec_from_quaternion(quaternion_from_matrix(local @ now))
    return replace(posture, dofs=dofs)


def _arm_and_rest(body: Body, side: str) -> tuple[I32, I32]:
    """Primitives of one arm from the upper arm on, and of everything that it can collide with."""
    top = JOINT_INDEX[f"{side}_upper_arm"]
    arm: list[int] = []
    rest: list[int] = []
    for i, j in enumerate(int(j) for j in body.joint):
        if _hangs_on(j, top):
            arm.append(i)
        elif not JOINTS[j].startswith(("left_", "right_")) or JOINTS[j].endswith(("_leg", "foot", "toes")):
            rest.append(i)
    return np.array(arm, np.int32), np.array(rest, np.int32)


def _hangs_on(joint: int, ancestor: int) -> bool:
    while joint > ancestor:
        joint = int(PARENTS[joint])
    return joint == ancestor


def _deepest(posed: PosedBody, body: Body, arm: I32, rest: I32) -> tuple[float, F64, F64]:
    """The deepest overlap of an arm with the rest of the body [m], where on the arm's axis, and which way is out."""
    share = np.broadcast_to(_SAMPLES, (len(arm), len(_SAMPLES))).copy()
    # Next to the shoulder the upper arm grows out of the trunk.
    upper = np.array([JOINTS[int(j)].endswith("upper_arm") for j in body.joint[arm]])
    share[upper] = 0.6 + 0.4 * share[upper]
    start, along = posed.a[arm], posed.b[arm] - posed.a[arm]
    p = (start[:, None] + share[:, :, None] * along[:, None]).reshape(-1, 3)
    mine = (posed.radius_a[arm, None] + share * (posed.radius_b - posed.radius_a)[arm, None]).reshape(-1)
    a, d = posed.a[rest], posed.b[rest] - posed.a[rest]
    u = np.clip(np.einsum("nki,ki->nk", p[:, None] - a, d) / np.maximum((d * d).sum(axis=1), 1e-12), 0.0, 1.0)
    off = p[:, None] - a - u[:, :, None] * d
    distance = np.linalg.norm(off, axis=2)
    depth = mine[:, None] + posed.radius_a[rest] + u * (posed.radius_b - posed.radius_a)[rest] - distance
    n, k = np.unravel_index(int(np.argmax(depth)), depth.shape)
    return float(depth[n, k]), p[n], off[n, k] / max(float(distance[n, k]), 1e-9)
