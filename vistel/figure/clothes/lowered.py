"""Cloth with the arms hanging: so it is mostly seen, and so its threads lie even. In the T-pose the skin of a shoulder is pressed
together."""

import math

import numpy as np

from vistel.arrays import F32, F64, I32
from vistel.figure.clothes.build import SIDES, Build
from vistel.figure.posture.posture import DOF_COUNT, SHOULDER, Posture, pose_joints
from vistel.figure.rigid.component import Influences, RigidSkin
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.normals import vertex_normals

_DOWN = math.radians(62.0)


def lowered(build: Build, points: F64, triangles: I32, weight: F32, limb: I32) -> tuple[F64, F64, F64]:
    """Points (V, 3) of cloth so posed; and the same with the left, and with the right arm laid back where it is in the T-pose, as
    one stiff piece. weight: (V, BONES)."""
    bone = np.argsort(-weight, axis=1, kind="stable")[:, :4].astype(np.int32)
    share = np.take_along_axis(weight, bone, axis=1)
    share = (share / share.sum(axis=1, keepdims=True)).astype(np.float32)
    n = vertex_normals(points, triangles).astype(np.float32)
    skin = RigidSkin(build.skeleton, points.astype(np.float32), n, triangles, build.body.joint[limb], Influences(bone, share))
    dofs = np.zeros(DOF_COUNT)
    dofs[SHOULDER["left"]], dofs[SHOULDER["right"]] = (0.0, 0.0, -_DOWN), (0.0, 0.0, _DOWN)
    joints = pose_joints(build.skeleton, Posture(dofs))
    out, out_n = np.empty((len(points), 3), np.float32), np.empty((len(points), 3), np.float32)
    skin.pose(joints, out, out_n)
    posed = out.astype(np.float64)

    def arm(side: str) -> F64:
        k = JOINT_INDEX[f"{side}_upper_arm"]
        return (posed - joints.position[k]) @ joints.rotation[k] + build.rest[k]

    left, right = (arm(side) for side in SIDES)
    return posed, left, right
