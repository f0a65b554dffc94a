"""Primitives for the contacts of a polymesh: its cells in nearly convex parts, each as the superellipsoid that fills it best.

Superellipsoids reach from boxes over cylinders to balls (Solina & Bajcsy 1990 recover them from range data likewise: shape by
how well it fits, parts where one does not). Parts are cut where that leaves the least room between them and their convex
hulls (Mamou & Ghorbel 2009), then joined again as long as the joined shape fits about as well.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from vistel.arrays import F64, I32, I64
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.space.files.cells import Cells, cells_of
from vistel.space.files.superellipsoids import FittedSuperellipsoid, gap, shape_of
from vistel.space.things.things import ThingPrimitive

MOST_PARTS = 14
GOOD = 0.06
"""Share of the volume that may be wrong before parts are cut further."""
CUTS = 7
"""Places along each axis where a part may be cut."""
BALANCE = 0.06
"""What an uneven cut costs, against the volume of hulls."""
CLOSE = 0.3
"""One shape is enough when the surface lies no further from it than this, in cells, on average."""
JOIN = 0.015
"""Share of all volume that joining two parts may make wrong."""


@dataclass(frozen=True)
class Fitted:
    """Primitives in the mesh's frame; how far the mesh's surface lies from theirs: mean, and largest but 5 % [m]."""

    primitives: tuple[ThingPrimitive, ...]
    mean: float
    most: float


def fitted(vertices: F64, triangles: I32, most: int = MOST_PARTS) -> tuple[Fitted, Cells, F64]:
    """At most `most` primitives for a mesh (vertices (V, 3) [m]). With them its cells, and the axes (3, 3) along which these
    lie."""
    axes = _upright(vertices[np.unique(triangles)])
    cells = cells_of(vertices @ axes, triangles)
    whole = shape_of(cells, np.arange(len(cells.index)), fine=True)
    if most == 1 or float(np.abs(gap(cells.points, whole)).mean()) < CLOSE * cells.size:  # a box, a can, a ball
        return _told(cells, axes, [whole])
    shapes = [shape_of(cells, np.arange(len(cells.index)))]
    volume = float(cells.filled.sum()) * cells.size**3
    stuck: set[int] = set()
    while len(shapes) < 2 * most and sum(s.wrong for s in shapes) > GOOD * volume:
        left = [k for k in range(len(shapes)) if id(shapes[k]) not in stuck]
        if not left:
            break
        k = max(left, key=lambda i: shapes[i].wrong)
        halves = _cut(cells, shapes[k].rows)
        if halves is None:
            stuck.add(id(shapes[k]))
        else:
            shapes[k : k + 1] = [shape_of(cells, rows) for rows in halves]
    shapes = _joined(cells, shapes, most, JOIN * volume)
    return _told(cells, axes, [shape_of(cells, s.rows, fine=True) for s in shapes])


def _told(cells: Cells, axes: F64, fine: list[FittedSuperellipsoid]) -> tuple[Fitted, Cells, F64]:
    """The shapes as primitives, and how near they are."""
    away = np.abs(np.min([gap(cells.points, s) for s in fine], axis=0))
    primitives = tuple(_turned(s.primitive, axes) for s in fine)
    return Fitted(primitives, float(away.mean()), float(np.quantile(away, 0.95))), cells, axes


def _turned(p: ThingPrimitive, axes: F64) -> ThingPrimitive:
    turn = np.ascontiguousarray(axes @ matrix_from_quaternion(p.rotation))
    return ThingPrimitive(p.kind, p.params, axes @ p.position, quaternion_from_matrix(turn), p.colour)


def _upright(points: F64) -> F64:
    """(3, 3) whose columns are the axes of the smallest of some boxes round the points: the file's, turned about its
    vertical, or the principal ones."""
    centred = points - points.mean(axis=0)
    candidates: list[F64] = [np.eye(3)]
    for angle in np.radians(np.arange(5.0, 90.0, 5.0)):
        c, s = np.cos(angle), np.sin(angle)
        candidates.append(np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]))
    _, principal = np.linalg.eigh(centred.T @ centred)
    candidates.append(principal * np.sign(np.linalg.det(principal)))
    extents: list[F64] = [np.ptp(centred @ axes, axis=0) + 1e-4 for axes in candidates]
    volumes = [float(np.prod(extent)) for extent in extents]
    best = int(np.argmin(volumes))
    return candidates[best if volumes[best] < 0.93 * volumes[0] else 0]


def _cut(cells: Cells, rows: I64) -> tuple[I64, I64] | None:
    """The part in two, where their hulls are smallest."""
    index = cells.index[rows]
    best, found = np.inf, None
    whole = _hull(index)
    for axis in range(3):
        low, high = int(index[:, axis].min()), int(index[:, axis].max())
        for cut in np.unique(np.linspace(low, high + 1, CUTS + 2).round().astype(int)[1:-1]).tolist():
            side = index[:, axis] < cut
            if not side.any() or side.all():
                continue
            a, b = _hull(index[side]), _hull(index[~side])
            cost = (a + b) / whole + BALANCE * abs(a - b) / (a + b)
            if cost < best:
                best, found = cost, (rows[side], rows[~side])
    return found


def _hull(index: I64) -> float:
    """Volume of the convex hull of cells, in cells."""
    # Only the ends of each row of cells matter.
    axis = int(np.argmax(np.ptp(index, axis=0)))
    others = [k for k in range(3) if k != axis]
    key = index[:, others[0]] * 4096 + index[:, others[1]]
    order = np.lexsort((index[:, axis], key))
    edge = np.ones(len(order), np.bool_)
    edge[1:-1] = (key[order][1:-1] != key[order][:-2]) | (key[order][1:-1] != key[order][2:])
    ends = index[order[edge]]
    corners = (ends[:, None] + np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])).reshape(-1, 3)
    try:
        return float(ConvexHull(corners).volume)
    except QhullError:
        return float(len(index))


def _joined(cells: Cells, shapes: list[FittedSuperellipsoid], most: int, slack: float) -> list[FittedSuperellipsoid]:
    """Fewer shapes: pairs are made one, those first that lose least, down to `most` and further while it costs little."""
    tried: dict[tuple[int, int], tuple[float, FittedSuperellipsoid]] = {}
    keep = list(shapes)  # ids stay unique while they are alive
    while len(shapes) > 1:
        best: tuple[float, int, int, FittedSuperellipsoid] | None = None
        for i in range(len(shapes)):
            for j in range(i + 1, len(shapes)):
                key = id(shapes[i]), id(shapes[j])
                if key not in tried and not _beside(cells, shapes[i].rows, shapes[j].rows):
                    tried[key] = np.inf, shapes[i]
                if key not in tried:
                    one = shape_of(cells, np.sort(np.concatenate([shapes[i].rows, shapes[j].rows])))
                    keep.append(one)
                    tried[key] = one.wrong - shapes[i].wrong - shapes[j].wrong, one
                loss, one = tried[key]
                if best is None or loss < best[0]:
                    best = loss, i, j, one
        if best is None or best[0] == np.inf:
            break
        if len(shapes) <= most and best[0] > slack:
            break
        _, i, j, one = best
        shapes = [s for k, s in enumerate(shapes) if k not in (i, j)] + [one]
    return shapes


def _beside(cells: Cells, a: I64, b: I64) -> bool:
    """The boxes of two parts touch."""
    p, q = cells.index[a], cells.index[b]
    return bool((p.min(axis=0) <= q.max(axis=0) + 1).all() and (q.min(axis=0) <= p.max(axis=0) + 1).all())
