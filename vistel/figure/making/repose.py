"""A mesh bent from the pose it was modelled in to the T-pose."""

import numpy as np

from vistel.arrays import F64
from vistel.figure.making.joints import Jointed
from vistel.figure.rigid.skinning_kernels import WITH_TWIST_OF
from vistel.figure.rigid.weights import TWIST_BONES
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import quaternion_from_matrix


def repose(points: F64, weight: F64, joints: Jointed) -> F64:
    """(V, 3) points in the T-pose; weight: (V, B) of joints and twist bones. Blended dual quaternions."""
    turn = np.concatenate([joints.turn, np.array([_twist_turn(joints, k) for k in range(len(TWIST_BONES))])])
    of = [JOINT_INDEX[b.joint] for b in TWIST_BONES]
    centre, goal = (np.concatenate([s.rest, s.rest[of]]) for s in (joints.found, joints.rest))
    real = np.array([quaternion_from_matrix(np.ascontiguousarray(r)) for r in turn])
    shift = goal - np.einsum("bij,bj->bi", turn, centre)
    dual = 0.5 * _product(np.column_stack([shift, np.zeros(len(shift))]), real)
    main = real[np.argmax(weight, axis=1)]
    # Signs that keep every bone on the same side as the vertex's main one.
    sign = np.where(main @ real.T < 0.0, -1.0, 1.0) * weight
    q, d = sign @ real, sign @ dual
    length = np.linalg.norm(q, axis=1, keepdims=True)
    q, d = q / length, d / length
    conjugate = q * (-1.0, -1.0, -1.0, 1.0)
    moved = 2.0 * _product(d, conjugate)[:, :3]
    v, w = q[:, :3], q[:, 3:]
    turned = points + 2.0 * np.cross(v, np.cross(v, points) + w * points)
    return turned + moved


def _twist_turn(joints: Jointed, k: int) -> F64:
    """The whole turn of a twist bone: see `vistel.figure.rigid.skinning_kernels`; about the bone as it lies in the file."""
    bone = TWIST_BONES[k]
    j, other = JOINT_INDEX[bone.joint], JOINT_INDEX[bone.other]
    axis = joints.found.tip[j] / np.linalg.norm(joints.found.tip[j])
    if bone.kind == WITH_TWIST_OF:
        return joints.turn[j] @ _twist(joints.turn[j].T @ joints.turn[other], axis)
    return joints.turn[j] @ _twist(joints.turn[other].T @ joints.turn[j], axis).T


def _twist(rotation: F64, axis: F64) -> F64:
    """The part of a rotation that turns about an axis: rotation = swing @ twist."""
    q = quaternion_from_matrix(np.ascontiguousarray(rotation))
    along = float(q[:3] @ axis)
    angle = 2.0 * float(np.arctan2(along, q[3]))
    k = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)


def _product(a: F64, b: F64) -> F64:
    """Hamilton products of rows (x, y, z, w)."""
    av, aw, bv, bw = a[:, :3], a[:, 3:], b[:, :3], b[:, 3:]
    return np.hstack([aw * bv + bw * av + np.cross(av, bv), aw * bw - np.sum(av * bv, axis=1, keepdims=True)])
