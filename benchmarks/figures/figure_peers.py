"""The usual ways to move a skin, for the same mesh, bones and weights as ours: linear blends and dual quaternions."""

import numba as nb
import numpy as np

from vistel.arrays import F64
from vistel.figure.figure import Figure
from vistel.figure.posture.posture import JointPose


@nb.njit(cache=True, fastmath=True)
def linear_blend(points, bone, weight, matrices, out):
    """Sum of four weighted bone matrices (B, 12) times the rest position; float32, positions only."""
    for v in range(len(points)):
        x, y, z = points[v, 0], points[v, 1], points[v, 2]
        p = q = r = np.float32(0.0)
        for j in range(4):
            m, w = matrices[bone[v, j]], weight[v, j]
            p += w * (m[0] * x + m[1] * y + m[2] * z + m[3])
            q += w * (m[4] * x + m[5] * y + m[6] * z + m[7])
            r += w * (m[8] * x + m[9] * y + m[10] * z + m[11])
        out[v, 0], out[v, 1], out[v, 2] = p, q, r


def by_linear_blend(figure: Figure, joints: JointPose) -> F64:
    """(V, 3) of the figure's mesh in double precision."""
    matrix = figure.skin.matrices(joints).astype(np.float64).reshape(-1, 3, 4)
    follows = figure.skin.influences
    of_vertex = np.einsum("vk,vkij->vij", follows.weight.astype(np.float64), matrix[follows.bone])
    rest = figure.avatar.mesh.vertices.astype(np.float64)
    return np.einsum("vij,vj->vi", of_vertex[:, :, :3], rest) + of_vertex[:, :, 3]


def by_dual_quaternions(figure: Figure, joints: JointPose) -> F64:
    """(V, 3) of the figure's mesh, dual quaternion linear blending (Kavan 2008) in double precision."""
    dual = figure.skin.bones(joints)[:, 12:20].astype(np.float64)
    follows = figure.skin.influences
    each = dual[follows.bone]
    sign = np.where((each[:, :1, :4] * each[:, :, :4]).sum(axis=2) < 0.0, -1.0, 1.0)
    blend = ((follows.weight * sign)[:, :, None] * each).sum(axis=1)
    blend /= np.linalg.norm(blend[:, :4], axis=1, keepdims=True)
    r, w, t, e = blend[:, :3], blend[:, 3:4], blend[:, 4:7], blend[:, 7:8]
    p = figure.avatar.mesh.vertices.astype(np.float64)
    return p + 2.0 * np.cross(r, np.cross(r, p) + w * p) + 2.0 * (w * t - e * r + np.cross(r, t))
