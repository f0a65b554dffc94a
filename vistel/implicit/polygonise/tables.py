"""What the surface does in a cube, for each of the 256 ways in which its corners are inside: marching cubes by rule.

Corner c lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edges 0-3 run along x at (y, z) = (0, 0), (1, 0), (0, 1), (1, 1),
edges 4-7 along y at the same (x, z), edges 8-11 along z at the same (x, y).

On every face the runs of inside corners are cut off from each other. The rule looks at the face alone, so both cubes
beside it draw the same lines and no crack can open. The lines close to loops, one through each crossing; a loop is cut
into triangles by diagonals that lie in no face, so an edge of the mesh belongs to one cube alone or to two that share
a face: closed and manifold by construction. Loops that no such diagonals can cut get a vertex in their middle.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

Loop = tuple[int, ...]

CORNERS = np.array([(c & 1, c >> 1 & 1, c >> 2 & 1) for c in range(8)])
EDGE_ENDS = np.array([(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)])
FACES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
"""Corners of the faces -x, +x, -y, +y, -z, +z, counter-clockwise seen from outside."""

_EDGE_OF = {frozenset((int(a), int(b))): i for i, (a, b) in enumerate(EDGE_ENDS)}
_EDGE_FACES = [{f for f, face in enumerate(FACES) if {int(a), int(b)} <= set(face)} for a, b in EDGE_ENDS]
_MIDDLES = (CORNERS[EDGE_ENDS[:, 0]] + CORNERS[EDGE_ENDS[:, 1]]) / 2


def face_runs(inside: tuple[bool, ...]) -> list[tuple[int, int]]:
    """Pairs (into, out of) of steps round a face between which its corners are inside, a step being i to i + 1."""
    n = len(inside)
    found: list[tuple[int, int]] = []
    for i in range(n):
        if not inside[i] and inside[(i + 1) % n]:
            j = (i + 1) % n
            while inside[(j + 1) % n]:
                j = (j + 1) % n
            found.append((i, j))
    return found


def loops(case: int) -> list[Loop]:
    """The surface's outlines in a cube, as edge numbers, counter-clockwise seen from outside the object."""
    follows: dict[int, int] = {}
    for face in FACES:
        for into, out in face_runs(tuple(bool(case >> c & 1) for c in face)):
            first = _EDGE_OF[frozenset((face[into], face[(into + 1) % 4]))]
            last = _EDGE_OF[frozenset((face[out], face[(out + 1) % 4]))]
            follows[first] = last
    found: list[Loop] = []
    while follows:
        start, at = follows.popitem()
        loop = [start]
        while at != start:
            loop.append(at)
            at = follows.pop(at)
        found.append(tuple(loop))
    return sorted(found, key=min)


def _cut(loop: Loop) -> list[tuple[int, int, int]]:
    """Triangles of a loop without a diagonal in a face, the least of them as fat as can be."""

    @cache
    def best(i: int, j: int) -> tuple[float, tuple[tuple[int, int, int], ...]] | None:
        """Of the polygon i..j along the loop, whose side i-j is allowed."""
        if j - i < 2:
            return np.inf, ()
        found = None
        for k in range(i + 1, j):
            if any(b - a > 1 and _EDGE_FACES[loop[a]] & _EDGE_FACES[loop[b]] for a, b in ((i, k), (k, j))):
                continue
            left, right = best(i, k), best(k, j)
            if left is None or right is None:
                continue
            p, q, r = (_MIDDLES[loop[v]] for v in (i, k, j))
            area = float(np.linalg.norm(np.cross(q - p, r - p)))
            longest = max(float((e * e).sum()) for e in (q - p, r - q, p - r))
            score = min(left[0], right[0], area / longest)
            if found is None or score > found[0]:
                found = score, (*left[1], (loop[i], loop[k], loop[j]), *right[1])
        return found

    result = best(0, len(loop) - 1)
    assert result is not None
    return list(result[1])


@cache
def case_table() -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """(256, 16) corners of the triangles of each case as edge numbers, and how many triangles (256,)."""
    table, count = np.full((256, 16), -1, np.int8), np.zeros(256, np.int8)
    for case in range(256):
        flat = [v for loop in loops(case) for triangle in _cut(loop) for v in triangle]
        table[case, : len(flat)] = flat
        count[case] = len(flat) // 3
    return table, count


@cache
def kernel_table() -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(256, 16) `case_table` filled up with edge 0, and how many triangles (256,)."""
    table, count = case_table()
    return np.maximum(table, 0).astype(np.int32), count.astype(np.int32)
