"""Where the triangles of a polyhedron cut the squares of a lattice's planes.

All coordinates are in cells. A point on a plane counts as above it, so that every decision is one between two whole
numbers and the same wherever it is taken; triangles that share an edge share its points.
"""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64, I64
from vistel.implicit.polygonise.cell_loops import edge_key, pack

# What a vertex is: on an edge of the polyhedron in a plane, on an edge of the lattice, the polyhedron's own, made in a
# cell. The lowest two bits of a vertex's number say so.
ON_MESH = 0
ON_LATTICE = 1
CORNER = 2
MIDDLE = 3


@dataclass(frozen=True, eq=False)
class Sections:
    """Straight pieces (n,), each of one triangle in one square: the square's axis and lowest point (n, 3), triangle,
    vertices at both ends (n, 2) as numbers, and where those are (n, 2, 3). What is above lies left of them."""

    axis: I64
    square: I64
    triangle: I64
    ends: I64
    at: F64


@dataclass(frozen=True, eq=False)
class MeshEdges:
    """Edges (e, 2) of a triangle mesh, lower vertex first, and those of each triangle (m, 3): from corner k to k + 1."""

    ends: I64
    of: I64

    @classmethod
    def of_triangles(cls, triangles: I64) -> "MeshEdges":
        """The edges of triangles (T, 3), each once."""
        directed = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
        ends, of = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True)
        return cls(ends, of.reshape(-1, 3))


def on_mesh(edge: I64, axis: int, plane: I64, first: int) -> I64:
    """Number of the vertex where an edge of the polyhedron meets a plane; first: number of its first edge."""
    return ((((first + edge) * 3 + axis) << 20 | plane) << 2) | ON_MESH


def crossed_planes(x: F64, edges: MeshEdges, axis: int) -> tuple[I64, I64, F64]:
    """Edge, plane and point (n, 3) of every meeting of the edges with the planes across an axis."""
    low, high = x[edges.ends[:, 0]], x[edges.ends[:, 1]]
    a, b = np.floor(low[:, axis]).astype(np.int64), np.floor(high[:, axis]).astype(np.int64)
    edge, plane = _ranges(np.minimum(a, b) + 1, np.maximum(a, b) + 1)
    return edge, plane, _meet(low[edge], high[edge], axis, plane)


def sections(x: F64, triangles: I64, edges: MeshEdges, first: int) -> Sections:
    """Every piece of every triangle in the planes of the lattice. x: (n, 3); first: number of the first edge."""
    parts = [_across(x, triangles, edges, first, axis) for axis in range(3)]
    axes, squares, cut, ends, at = zip(*parts, strict=True)
    return Sections(*map(np.concatenate, (axes, squares, cut, ends, at)))  # type: ignore[arg-type]


def _across(x: F64, triangles: I64, edges: MeshEdges, first: int, axis: int) -> tuple[I64, I64, I64, I64, F64]:
    below = np.floor(x[:, axis]).astype(np.int64)[triangles]
    triangle, plane = _ranges(below.min(axis=1) + 1, below.max(axis=1) + 1)
    above = below[triangle] >= plane[:, None]
    following = np.roll(above, -1, axis=1)
    # From the side that goes down to the one that goes up: round what is above the plane counter-clockwise.
    side = np.stack([(above & ~following).argmax(axis=1), (~above & following).argmax(axis=1)], axis=1)
    edge = edges.of[triangle[:, None], side]
    ends = edges.ends[edge]
    at = _meet(x[ends[..., 0]], x[ends[..., 1]], axis, plane[:, None])
    number = on_mesh(edge, axis, plane[:, None], first)
    return _walk(axis, plane, triangle, number, at)


def _walk(axis: int, plane: I64, triangle: I64, number: I64, at: F64) -> tuple[I64, I64, I64, I64, F64]:
    """Cut pieces in planes at the lines of their squares."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    n = len(plane)
    cell = np.floor(at[:, :, [u, v]]).astype(np.int64)
    whose: list[I64] = [np.arange(n), np.arange(n)]
    share: list[F64] = [np.full(n, -1.0), np.full(n, 2.0)]
    kind: list[I64] = [np.full(n, -1), np.full(n, -1)]
    line: list[I64] = [np.zeros(n, np.int64), np.zeros(n, np.int64)]
    for k, w in enumerate((u, v)):
        a, b = cell[:, 0, k], cell[:, 1, k]
        row, value = _ranges(np.minimum(a, b) + 1, np.maximum(a, b) + 1)
        whose.append(row)
        share.append((value - at[row, 0, w]) / (at[row, 1, w] - at[row, 0, w]))
        kind.append(np.full(len(row), k))
        line.append(value)
    row, what, where = (np.concatenate(p) for p in (whose, kind, line))
    s = np.concatenate(share)
    order = np.lexsort((s, row))
    row, s, what, where = row[order], s[order], what[order], where[order]
    # Where in the plane each event finds us: the first square, moved on by the lines crossed before.
    start = np.searchsorted(row, np.arange(n))
    here = np.empty((len(row), 2), np.int64)
    for k in range(2):
        step = np.sign(cell[:, 1, k] - cell[:, 0, k])
        done = np.cumsum(what == k)
        here[:, k] = cell[row, 0, k] + step[row] * (done - done[start][row])
    point = at[row, 0] + np.clip(s, 0, 1)[:, None] * (at[row, 1] - at[row, 0])
    vertex = number[row, np.where(s < 0, 0, 1)]
    point[s > 1] = at[row[s > 1], 1]
    for k, (w, other) in enumerate(((u, v), (v, u))):
        rows = np.flatnonzero(what == k)
        point[rows, w] = where[rows]
        index = np.empty((len(rows), 3), np.int64)
        index[:, axis], index[:, w], index[:, other] = plane[row[rows]], where[rows], here[rows, 1 - k]
        vertex[rows] = edge_key(pack(index), other) << 2 | ON_LATTICE
    from_, to = np.flatnonzero(s <= 1), np.flatnonzero(s >= 0)
    square = np.empty((len(from_), 3), np.int64)
    square[:, axis], square[:, u], square[:, v] = plane[row[from_]], here[from_, 0], here[from_, 1]
    return (
        np.full(len(from_), axis),
        square,
        triangle[row[from_]],
        np.stack([vertex[from_], vertex[to]], axis=1),
        np.stack([point[from_], point[to]], axis=1),
    )


def _meet(low: F64, high: F64, axis: int, plane: I64) -> F64:
    s = (plane - low[..., axis]) / (high[..., axis] - low[..., axis])
    at = low + s[..., None] * (high - low)
    at[..., axis] = plane
    return at


def _ranges(first: I64, last: I64) -> tuple[I64, I64]:
    """Rows, and for each row the whole numbers from its first to before its last."""
    count = np.maximum(last - first, 0)
    row = np.repeat(np.arange(len(count)), count)
    return row, first[row] + np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
