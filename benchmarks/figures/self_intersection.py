"""Triangles of a mesh that pass through others of it."""

import numpy as np
from numpy.typing import NDArray

from vistel.jit.kernel_jit import compiled

CELL = 0.02
"""Edge of the cells by which triangles find each other, for meshes in metres."""


def intersecting(
    vertices: NDArray[np.float32] | NDArray[np.float64], triangles: NDArray[np.int32], least: float = 0.0
) -> NDArray[np.bool_]:
    """(F,) whether each triangle passes through another that has no vertex with it in common.

    vertices (V, 3) [m], finite; triangles (F, 3). Triangles that only touch, or lie in one plane, do not count. least: nor do pairs
    that are apart after a shorter move of one of them [m].
    """
    p = np.ascontiguousarray(vertices, np.float64)
    return _intersecting(p, np.ascontiguousarray(triangles), CELL, least).astype(np.bool_)


@compiled
def _sign(a, b, c, d):
    """Six times the signed volume of a tetrahedron."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    return ux * (vy * wz - vz * wy) - uy * (vx * wz - vz * wx) + uz * (vx * wy - vy * wx)


@compiled
def _pierces(p, q, a, b, c):
    """Whether the edge from p to q goes through the inside of a triangle."""
    if _sign(p, a, b, c) * _sign(q, a, b, c) >= 0.0:
        return False
    u, v, w = _sign(p, q, a, b), _sign(p, q, b, c), _sign(p, q, c, a)
    return (u > 0.0 and v > 0.0 and w > 0.0) or (u < 0.0 and v < 0.0 and w < 0.0)


@compiled
def _cross(p, s, t):
    for k in range(3):
        if _pierces(p[s[k]], p[s[(k + 1) % 3]], p[t[0]], p[t[1]], p[t[2]]):
            return True
        if _pierces(p[t[k]], p[t[(k + 1) % 3]], p[s[0]], p[s[1]], p[s[2]]):
            return True
    return False


@compiled
def _move_apart(p, s, t):
    """The shortest move that separates two triangles: their least overlap along the normals of both and what is at right angles to
    an edge of each (Gottschalk 1996)."""
    least = np.inf
    for k in range(11):
        if k < 2:
            of = s if k == 0 else t
            u, v = p[of[1]] - p[of[0]], p[of[2]] - p[of[0]]
        else:
            i, j = (k - 2) // 3, (k - 2) % 3
            u, v = p[s[(i + 1) % 3]] - p[s[i]], p[t[(j + 1) % 3]] - p[t[j]]
        x, y, z = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
        length = np.sqrt(x * x + y * y + z * z)
        if length < 1e-12:
            continue
        low, high = np.full(2, np.inf), np.full(2, -np.inf)
        for side in range(2):
            for corner in range(3):
                q = p[t[corner]] if side else p[s[corner]]
                along = (x * q[0] + y * q[1] + z * q[2]) / length
                low[side], high[side] = min(low[side], along), max(high[side], along)
        least = min(least, high[0] - low[1], high[1] - low[0])
    return least


@compiled
def _intersecting(p, triangles, cell, least):
    count = len(triangles)
    low, high = np.empty((count, 3)), np.empty((count, 3))
    for f in range(count):
        for axis in range(3):
            x, y, z = p[triangles[f, 0], axis], p[triangles[f, 1], axis], p[triangles[f, 2], axis]
            low[f, axis], high[f, axis] = min(x, y, z), max(x, y, z)
    origin = np.array([low[:, 0].min(), low[:, 1].min(), low[:, 2].min()])
    size = np.empty(3, np.int64)
    for axis in range(3):
        size[axis] = int((high[:, axis].max() - origin[axis]) / cell) + 1
    start = np.zeros(size[0] * size[1] * size[2] + 1, np.int64)
    member = np.empty(0, np.int32)
    for filling in (False, True):
        if filling:
            start[1:] = np.cumsum(start[1:])
            member = np.empty(start[-1], np.int32)
        for f in range(count - 1, -1, -1):
            for i in range(int((low[f, 0] - origin[0]) / cell), int((high[f, 0] - origin[0]) / cell) + 1):
                for j in range(int((low[f, 1] - origin[1]) / cell), int((high[f, 1] - origin[1]) / cell) + 1):
                    for k in range(int((low[f, 2] - origin[2]) / cell), int((high[f, 2] - origin[2]) / cell) + 1):
                        at = (i * size[1] + j) * size[2] + k
                        if filling:
                            # From the end of the cell's part to its beginning, which then is where it starts.
                            start[at + 1] -= 1
                            member[start[at + 1]] = f
                        else:
                            start[at + 1] += 1
    out = np.zeros(count, np.uint8)
    for at in range(1, len(start)):
        end = start[at + 1] if at + 1 < len(start) else len(member)
        for m in range(start[at], end):
            f = member[m]
            for n in range(m + 1, end):
                g = member[n]
                if out[f] and out[g]:
                    continue
                if (
                    low[f, 0] > high[g, 0]
                    or low[g, 0] > high[f, 0]
                    or low[f, 1] > high[g, 1]
                    or low[g, 1] > high[f, 1]
                    or low[f, 2] > high[g, 2]
                    or low[g, 2] > high[f, 2]
                ):
                    continue
                s, t = triangles[f], triangles[g]
                shared = False
                for x in range(3):
                    for y in range(3):
                        shared = shared or s[x] == t[y]
                if not shared and _cross(p, s, t) and (least <= 0.0 or _move_apart(p, s, t) >= least):
                    out[f] = out[g] = 1
    return out
