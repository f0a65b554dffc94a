"""Fewer, well-shaped triangles: edges collapse, shortest first, in a metric of wanted size and bending.

Unlike quadric simplification this keeps triangles near equilateral, also along limbs, which bend later.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vistel.arrays import F64, I64
from vistel.figure.people import reduce_kernels

_kernels: Any = reduce_kernels


def reduce(vertices: F64, triangles: I64, size: F64, count: int) -> tuple[F64, I64, F64]:
    """A closed mesh of about `count` vertices; size (V,) is the wanted relative edge length at each vertex.

    Returns vertices, triangles and the sizes at the kept vertices; the topology stays (link condition).
    """
    v, t, h = vertices.copy(), triangles.copy(), size.copy()
    n = normals(v, t)
    left = len(v)
    step = 0.35
    while left > count and step < 50.0:
        left = _kernels.collapse(v, n, h, t, step * step, left, count)
        t = t[t[:, 0] >= 0]
        step *= 1.12
    used, index = np.unique(t, return_inverse=True)
    return v[used], index.reshape(-1, 3), h[used]


def improve(vertices: F64, triangles: I64, size: F64) -> tuple[F64, I64]:
    """One round of edge flips towards equal angles, then vertices moved to the middle of their neighbours along the
    surface (weighted by the wanted size)."""
    t = triangles.copy()
    _kernels.flip(vertices, t)
    n = normals(vertices, t)
    edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    w = 1.0 / (size[edges[:, 0]] + size[edges[:, 1]])
    total = np.bincount(edges[:, 0], w, len(vertices))
    middle = np.stack([np.bincount(edges[:, 0], w * vertices[edges[:, 1], c], len(vertices)) for c in range(3)], axis=1)
    move = middle / total[:, None] - vertices
    move -= np.einsum("ij,ij->i", move, n)[:, None] * n
    return vertices + 0.5 * move, t


def normals(vertices: F64, triangles: I64) -> F64:
    """(V, 3) area-weighted unit vertex normals."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    face = np.cross(b - a, c - a)
    out = np.zeros_like(vertices)
    for k in range(3):
        for axis in range(3):
            out[:, axis] += np.bincount(triangles[:, k], face[:, axis], len(vertices))
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-15)
