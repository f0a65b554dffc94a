"""Numba kernels of the normals round moved vertices."""

# pyright: basic

import numpy as np

from vistel.implicit.constants import LEAST_SQUARE
from vistel.jit.kernel_jit import compiled

GAP = -1
"""In a fan: the next neighbour begins a new chain."""


@compiled
def build_fans(triangles, vertices):
    """The neighbours of every vertex in the order of its triangles, so that a triangle lies between each two
    of them: (start (V + 1,), fan), fan[start[v] : start[v + 1]] with GAP between chains. A closed chain ends
    with its first."""
    begin = np.zeros(vertices + 1, np.int64)
    for f in range(len(triangles)):
        for c in range(3):
            begin[triangles[f, c] + 1] += 1
    for v in range(vertices):
        begin[v + 1] += begin[v]
    one, two = np.empty(3 * len(triangles), np.int32), np.empty(3 * len(triangles), np.int32)
    used = begin[:-1].copy()
    for f in range(len(triangles)):
        for c in range(3):
            v = triangles[f, c]
            one[used[v]], two[used[v]] = triangles[f, (c + 1) % 3], triangles[f, (c + 2) % 3]
            used[v] += 1
    start, fan, n = np.zeros(vertices + 1, np.int32), np.empty(9 * len(triangles), np.int32), 0
    for v in range(vertices):
        lo, hi = begin[v], begin[v + 1]
        first = True
        while lo < hi:
            at = lo  # a chain begins at a triangle nobody comes before, if there is one
            for i in range(lo, hi):
                headed = True
                for j in range(lo, hi):
                    if two[j] == one[i]:
                        headed = False
                        break
                if headed:
                    at = i
                    break
            if not first:
                fan[n] = GAP
                n += 1
            first = False
            fan[n], fan[n + 1] = one[at], two[at]
            n += 2
            one[at], two[at] = one[lo], two[lo]
            lo += 1
            going = True
            while going:
                going = False
                for i in range(lo, hi):
                    if one[i] == fan[n - 1]:
                        fan[n] = two[i]
                        n += 1
                        one[i], two[i] = one[lo], two[lo]
                        lo += 1
                        going = True
                        break
        start[v + 1] = n
    return start, fan[:n].copy()


_LEAST_SQUARE = np.float32(LEAST_SQUARE)
_FAST = {"contract", "nsz", "arcp", "afn"}
_FEW = 16
"""Below one vertex in so many, the touched ones are listed; otherwise all are looked through, in the order
of memory."""


@compiled(nogil=True, error_model="numpy", fastmath=_FAST)
def _normal(v, start, fan, vertices, normals):
    zero = np.float32(0.0)
    x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
    nx = ny = nz = ax = ay = az = zero  # after a gap the edge before is none: its product is 0
    for c in range(start[v], start[v + 1]):
        w = fan[c]
        if w < 0:
            ax = ay = az = zero
            continue
        bx, by, bz = vertices[w, 0] - x, vertices[w, 1] - y, vertices[w, 2] - z
        nx += ay * bz - az * by
        ny += az * bx - ax * bz
        nz += ax * by - ay * bx
        ax, ay, az = bx, by, bz
    square = nx * nx + ny * ny + nz * nz
    if square > _LEAST_SQUARE:
        inverse = np.float32(1.0) / np.sqrt(square)
        normals[v, 0], normals[v, 1], normals[v, 2] = nx * inverse, ny * inverse, nz * inverse


@compiled(nogil=True, error_model="numpy", fastmath=_FAST)
def update_normals(start, fan, vertices, moved, mark, touched, normals):
    """Area-weighted unit normals of the moved vertices and their neighbours. mark: (V,) zeros, and zeros
    again afterwards; touched: room for every vertex."""
    if len(moved) * _FEW > len(vertices):
        for m in range(len(moved)):
            v = moved[m]
            mark[v] = 1
            for c in range(start[v], start[v + 1]):
                if fan[c] >= 0:
                    mark[fan[c]] = 1
        for v in range(len(vertices)):
            if mark[v]:
                mark[v] = 0
                _normal(v, start, fan, vertices, normals)
        return
    n = 0
    for m in range(len(moved)):
        v = moved[m]
        if not mark[v]:
            mark[v] = 1
            touched[n] = v
            n += 1
        for c in range(start[v], start[v + 1]):
            w = fan[c]
            if w >= 0 and not mark[w]:
                mark[w] = 1
                touched[n] = w
                n += 1
    for m in range(n):
        mark[touched[m]] = 0
        _normal(touched[m], start, fan, vertices, normals)
