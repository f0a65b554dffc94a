"""Normals of meshes with hard edges: a corner's normal is the mean over the faces that bend little from its own."""

import math

import numpy as np

from vistel.arrays import F32, F64, I32

SOFT = math.radians(40)
"""Faces at a smaller angle are shaded as one smooth surface."""


def auto_smooth(points: F64, triangles: I32, soft: float = SOFT) -> tuple[F32, I32]:
    """Normals (k, 3), and which of them (m, 3) each corner has."""
    n, m = len(points), len(triangles)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    face = np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)
    angle = np.stack([_angles(p, q, r) for p, q, r in ((a, b, c), (b, c, a), (c, a, b))], axis=1).ravel()
    vertex = triangles.ravel().astype(np.int64)
    of = np.repeat(np.arange(m), 3)
    order = np.argsort(vertex, kind="stable")
    first = np.searchsorted(vertex[order], np.arange(n + 1))
    count = np.diff(first)[vertex]
    # Every corner with every corner at its vertex.
    row = np.repeat(np.arange(3 * m), count)
    other = order[first[vertex][row] + np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)]
    near = np.einsum("ij,ij->i", face[of[row]], face[of[other]]) >= math.cos(soft)
    near |= length[of[row], 0] == 0  # a triangle without area goes with all
    total = np.zeros((3 * m, 3))
    np.add.at(total, row[near], angle[other[near], None] * face[of[other[near]]])
    size = np.linalg.norm(total, axis=1, keepdims=True)
    normal = np.divide(total, size, out=np.zeros_like(total), where=size > 0).astype(np.float32)
    # Corners of a vertex with one normal share it.
    key = np.concatenate([vertex[:, None], np.round(normal * 1e4).astype(np.int64)], axis=1)
    _, index, inverse = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return normal[index], inverse.reshape(-1, 3).astype(np.int32)


def _angles(p: F64, q: F64, r: F64) -> F64:
    u, v = q - p, r - p
    length = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
    cosine = np.divide(np.einsum("ij,ij->i", u, v), length, out=np.ones(len(p)), where=length > 0)
    return np.arccos(np.clip(cosine, -1, 1))
