"""Normals of the vertices of a mesh."""

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64


def vertex_normals(points: F64, triangles: NDArray[np.integer]) -> F64:
    """(V, 3) unit normals at points (V, 3), triangles (F, 3) weighted by their area; zero where there is none."""
    p = points[triangles]
    face = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    out = np.zeros_like(points)
    for corner in range(3):
        for axis in range(3):
            out[:, axis] += np.bincount(triangles[:, corner], face[:, axis], len(points))
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-20)
