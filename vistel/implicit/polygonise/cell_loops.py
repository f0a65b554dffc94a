"""From lines on the faces of cells to triangles in the cells.

Where all cells are alike, the table of cases says what the surface does in each. Cells beside finer ones, or beside
polygons that are kept, have other lines on some of their faces. Whatever the lines, they close to loops, since each
crossing of a cell's edge ends one line on either of the two faces that meet there. A loop of three is a triangle;
longer ones become a fan about a vertex in their middle. No side of a fan lies in a face, so a side of a triangle belongs to the two
fans of one cell, or to the cells on both sides of a face: closed and manifold, as in the table.
"""

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.implicit.polygonise.tables import CORNERS, EDGE_ENDS, case_table, face_runs

BITS = 20
MASK = (1 << BITS) - 1
NONE = -1


def pack(index: I64) -> I64:
    """Numbers (n,) of lattice points (n, 3), each index below 2^20."""
    return (index[..., 0] << (2 * BITS)) | (index[..., 1] << BITS) | index[..., 2]


def unpack(key: I64) -> I64:
    """Lattice points (n, 3) of numbers (n,)."""
    return np.stack([key >> (2 * BITS), (key >> BITS) & MASK, key & MASK], axis=-1)


def find(sorted_keys: I64, keys: I64) -> I64:
    """Where each key is among sorted ones; NONE where it is not."""
    if not len(sorted_keys):
        return np.full(np.shape(keys), NONE, np.int64)
    place = np.minimum(np.searchsorted(sorted_keys, keys), len(sorted_keys) - 1)
    return np.where(sorted_keys[place] == keys, place, NONE)


def edge_key(start: I64, axis: I64 | int) -> I64:
    """Number of the edge that starts at a lattice point's number and runs along an axis."""
    return (start << 2) | axis


def cases(inside: NDArray[np.bool_]) -> I64:
    """(n,) case of each cell from whether its corners (n, 8) are inside."""
    return (inside.astype(np.int64) << np.arange(8)).sum(axis=1)


def table_triangles(case: I64, corner: I64) -> tuple[I64, I64]:
    """Triangles (m, 3) of edge numbers, and the row (m,) of the cell of each; corner: (n, 8) numbers of the corners."""
    table, count = case_table()
    row = np.repeat(np.arange(len(case)), count[case])
    number = np.arange(len(row)) - np.repeat(np.cumsum(count[case]) - count[case], count[case])
    edges = table[case[row][:, None], 3 * number[:, None] + np.arange(3)].astype(np.int64)
    start = corner[row[:, None], EDGE_ENDS[edges, 0]]
    return edge_key(start, edges // 4), row


def _pairs() -> I64:
    """(256, 4, 2) for each pattern of 8 signs round a face the steps between which runs are cut off; NONE for none."""
    found = np.full((256, 4, 2), NONE, np.int64)
    for pattern in range(256):
        runs = face_runs(tuple(bool(pattern >> k & 1) for k in range(8)))
        for k, run in enumerate(runs):
            found[pattern, k] = run
    return found


RUNS = _pairs()


def lines(inside: NDArray[np.bool_], crossing: I64) -> tuple[I64, I64, I64]:
    """Lines on faces: the row of the face, the crossing it starts at and the one it ends at, as its left cell sees it.

    inside: (n, 8) of the points round each face; crossing: (n, 8) the crossing between a point and the next.
    """
    pattern = (inside.astype(np.int64) << np.arange(8)).sum(axis=1)
    runs = RUNS[pattern]
    face, k = np.nonzero(runs[:, :, 0] != NONE)
    into, out = runs[face, k, 0], runs[face, k, 1]
    return face, crossing[face, into], crossing[face, out]


def loops(cell: I64, start: I64, stop: I64) -> tuple[I64, I64]:
    """For lines (n,) in cells from crossing to crossing: the number of the loop of each, and of the line after it."""
    base = int(max(start.max(initial=0), stop.max(initial=0))) + 1
    _, dense = np.unique(cell, return_inverse=True)
    key = dense * base + start
    order = np.argsort(key, kind="stable")
    follows = order[np.searchsorted(key[order], dense * base + stop)]
    label, jump = np.arange(len(cell)), follows
    while True:
        least = np.minimum(label, label[jump])
        if np.array_equal(least, label):
            break
        label, jump = least, jump[jump]
    return np.unique(label, return_inverse=True)[1], follows


def fans(cell: I64, start: I64, stop: I64, points: F64) -> tuple[I64, I64, F64, I64, I64]:
    """Triangles (m, 3) of the loops that lines make, whose middles are numbered on from len(points); the cell (m,) of
    each; the middles (k, 3), their cells (k,) and a crossing (k,) of each one's loop."""
    loop, follows = loops(cell, start, stop)
    size = np.bincount(loop)
    first = np.zeros(len(size), np.int64)
    first[loop[::-1]] = np.arange(len(loop))[::-1]
    small = first[size == 3]
    triangles = [np.stack([start[small], stop[small], stop[follows[small]]], axis=1)]
    cells = [cell[small]]
    wide = size > 3
    number = np.cumsum(wide) - 1
    middles = np.zeros((int(wide.sum()), 3))
    of_wide = wide[loop]
    # Lines count by their length, so that many short ones do not draw the middle to their side.
    a, b = points[start[of_wide]], points[stop[of_wide]]
    length = np.linalg.norm(b - a, axis=1) + 1e-12
    total = np.zeros(len(middles))
    np.add.at(middles, number[loop[of_wide]], 0.5 * length[:, None] * (a + b))
    np.add.at(total, number[loop[of_wide]], length)
    middles /= total[:, None]
    triangles.append(np.stack([start[of_wide], stop[of_wide], len(points) + number[loop[of_wide]]], axis=1))
    cells.append(cell[of_wide])
    return np.concatenate(triangles), np.concatenate(cells), middles, cell[first[wide]], start[first[wide]]


CORNER_OFFSETS = CORNERS.astype(np.int64)
"""(8, 3) the corners of a cell of size 1."""
