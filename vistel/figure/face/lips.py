"""Which side of a mouth each vertex of a head belongs to, and which lie inside it.

On skin that is cut along the lips both edges are in one place at rest: only distance along the surface shows which lip a vertex
belongs to."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from vistel.arrays import F64, I64
from vistel.figure.face.landmarks import Landmarks
from vistel.figure.face.marks import MARK_INDEX

CLEAR_M = 0.0022
"""A vertex this far above or below the line between the lips belongs to that lip [m]."""
TALL_M = 0.014
"""How far above and below the line between the lips a mouth is looked for [m]."""
DEEP_M = 0.055
"""How far behind that line a mouth is looked for [m]."""
INSIDE_M = 0.0065
"""A vertex this far behind other skin is inside the mouth [m]."""


def line_of_lips(p: F64, marks: Landmarks) -> tuple[F64, F64]:
    """(N,) height of the line between the lips where a place is, and (N,) how far it is from the middle of the mouth to its corner:
    1 at the corner."""
    m = marks.marks
    left, right = m[MARK_INDEX["left_mouth_corner"]], m[MARK_INDEX["right_mouth_corner"]]
    middle = marks.between
    of_left = (p[:, 0] > middle[0]).astype(np.float64)
    corner = right[1] + of_left * (left[1] - right[1])
    half = (middle[0] - right[0]) + of_left * (left[0] + right[0] - 2.0 * middle[0])
    across = np.abs(p[:, 0] - middle[0]) / np.maximum(half, 1e-6)
    return middle[1] + (corner - middle[1]) * np.minimum(across, 1.0) ** 2, across


def sides_of_mouth(p: F64, triangles: I64, marks: Landmarks) -> tuple[F64, NDArray[np.bool_]]:
    """(V,) 0 of the upper lip, 1 of the lower one, NaN where neither is near; and (V,) whether it is inside the mouth. p: (V, 3)
    skin at rest; triangles: (T, 3)."""
    side, inside = np.full(len(p), np.nan), np.zeros(len(p), np.bool_)
    scale = marks.scale
    line, across = line_of_lips(p, marks)
    up = (p[:, 1] - line) / scale
    behind = (marks.between[2] - p[:, 2]) / scale
    box = np.flatnonzero((across < 1.15) & (np.abs(up) < TALL_M) & (behind < DEEP_M) & (behind > -0.025))
    place = np.full(len(p), -1)
    place[box] = np.arange(len(box))
    faces = place[triangles]
    whole = faces[(faces >= 0).all(axis=1)]
    if not len(whole):
        return side, inside
    a, b = np.concatenate((whole[:, [0, 1]], whole[:, [1, 2]], whole[:, [2, 0]])).T
    length = np.linalg.norm(p[box[a]] - p[box[b]], axis=1) + 1e-9
    inside[box] = _covered(p, box, triangles[(faces >= 0).any(axis=1)], INSIDE_M * scale)
    away = np.full((2, len(box)), np.inf)
    graph = coo_matrix((length, (a, b)), (len(box), len(box))).tocsr()
    for k, sign in enumerate((1.0, -1.0)):
        # Teeth reach past the line between the lips: they are found by the skin in front of them.
        seeds = np.flatnonzero((sign * up[box] > CLEAR_M) & ~inside[box])
        if len(seeds):
            away[k] = dijkstra(graph, directed=False, indices=seeds, min_only=True)
    known = np.isfinite(away).any(axis=0)
    side[box[known]] = (away[1] < away[0])[known]
    return side, inside


def foremost(p: F64, triangles: I64, at: F64) -> I64:
    """(N,) which of the triangles (T, 3) of places (V, 3) is seen from the front at each x and y (N, 2), -1 for none."""
    out = np.full(len(at), -1)
    through = _Through(p, triangles)
    for k, (x, y) in enumerate(at):
        which, z = through.at(x, y)
        if len(which):
            out[k] = which[np.argmax(z)]
    return out


def _covered(p: F64, which: I64, triangles: I64, by: float) -> NDArray[np.bool_]:
    """(len(which),) whether a triangle lies in front of a vertex by more than `by`."""
    through = _Through(p, triangles)
    return np.array([through.at(x, y)[1].max(initial=-np.inf) > z + by for x, y, z in p[which]], np.bool_)


class _Through:
    """Lines from the front to the back through triangles (T, 3) of places (V, 3)."""

    def __init__(self, p: F64, triangles: I64) -> None:
        a, b, c = (p[triangles[:, k]] for k in range(3))
        area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        self._real = np.flatnonzero(np.abs(area) > 1e-12)
        self._a, self._b, self._c, self._area = a[self._real], b[self._real], c[self._real], area[self._real]

    def at(self, x: float, y: float) -> tuple[I64, F64]:
        """(H,) the triangles that a line at x and y meets, and (H,) how far to the front."""
        a, b, c, area = self._a, self._b, self._c, self._area
        u = ((b[:, 0] - x) * (c[:, 1] - y) - (b[:, 1] - y) * (c[:, 0] - x)) / area
        w = ((c[:, 0] - x) * (a[:, 1] - y) - (c[:, 1] - y) * (a[:, 0] - x)) / area
        hit = np.flatnonzero((u >= 0.0) & (w >= 0.0) & (u + w <= 1.0))
        u, w = u[hit], w[hit]
        return self._real[hit], u * a[hit, 2] + w * b[hit, 2] + (1.0 - u - w) * c[hit, 2]
