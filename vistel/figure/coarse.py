"""A coarser set of triangles over the same vertices, for figures that are small in the picture."""

from __future__ import annotations

import fast_simplification
import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]


def coarse_triangles(vertices: F32, triangles: I32, share: float) -> I32:
    """(M, 3) triangles, M about `share` of the number given, that use a subset of `vertices` (V, 3).

    Edges collapse by quadric error; each vertex that is left is drawn as the nearest of those it stands for, so
    texture coordinates and a deformation of the vertices stay valid.
    """
    points, faces, collapses = fast_simplification.simplify(
        vertices, triangles, target_reduction=1.0 - share, return_collapses=True
    )
    _, _, stands_for = fast_simplification.replay_simplification(vertices, triangles, collapses)
    away = ((vertices - points[stands_for]) ** 2).sum(axis=1)
    order = np.lexsort((away, stands_for))
    first = np.flatnonzero(np.diff(stands_for[order], prepend=-1))
    nearest = np.full(len(points), -1, np.int32)
    nearest[stands_for[order][first]] = order[first]
    out = nearest[faces].astype(np.int32)
    return out[(out >= 0).all(axis=1)]
