"""Kernels of the levels of detail: the cheapest collapse of each vertex, and making independent ones."""

# pyright: basic

import math

import numpy as np

from vistel.geometry.vector_kernels import cross, difference, dot
from vistel.jit.kernel_jit import compiled, inner

_RING = 32
"""Most triangles round a vertex that is considered."""
_VALENCE = 14
_NEVER = np.inf


@inner
def add_quadric(q, normal, offset, weight) -> None:
    """Add weight * (normal . x + offset)^2 to the ten coefficients q of a quadric."""
    x, y, z = normal
    q[0] += weight * x * x
    q[1] += weight * x * y
    q[2] += weight * x * z
    q[3] += weight * x * offset
    q[4] += weight * y * y
    q[5] += weight * y * z
    q[6] += weight * y * offset
    q[7] += weight * z * z
    q[8] += weight * z * offset
    q[9] += weight * offset * offset


@inner
def quadric_at(q, p) -> float:
    """Value of a quadric at p, in m^2 times its weight."""
    x, y, z = p
    value = q[0] * x * x + q[4] * y * y + q[7] * z * z + q[9]
    value += 2.0 * (q[1] * x * y + q[2] * x * z + q[5] * y * z + q[3] * x + q[6] * y + q[8] * z)
    return max(0.0, value)


@compiled
def face_quadrics(p, tri, quadric, weight) -> None:
    """Planes of the triangles, weighted by area, summed at the vertices."""
    for f in range(len(tri)):
        a, b, c = p[tri[f, 0]], p[tri[f, 1]], p[tri[f, 2]]
        n = cross(difference(b, a), difference(c, a))
        size = math.sqrt(dot(n, n))
        if size < 1e-16:
            continue
        normal = n[0] / size, n[1] / size, n[2] / size
        for k in range(3):
            add_quadric(quadric[tri[f, k]], normal, -dot(normal, a), 0.5 * size)
            weight[tri[f, k]] += 0.5 * size


@compiled
def seam_quadrics(p, tri, seam, quadric) -> None:
    """Walls along texture seams (seam: (F, 3), 1 where the edge k, k + 1 is one), so that charts keep their outline."""
    for f in range(len(tri)):
        a, b, c = p[tri[f, 0]], p[tri[f, 1]], p[tri[f, 2]]
        normal = cross(difference(b, a), difference(c, a))
        for k in range(3):
            if not seam[f, k]:
                continue
            u, v = tri[f, k], tri[f, (k + 1) % 3]
            along = difference(p[v], p[u])
            w = cross(along, normal)
            size = math.sqrt(dot(w, w))
            if size < 1e-16:
                continue
            wall = w[0] / size, w[1] / size, w[2] / size
            square = dot(along, along)
            add_quadric(quadric[u], wall, -dot(wall, p[u]), square)
            add_quadric(quadric[v], wall, -dot(wall, p[u]), square)


@inner
def _edge_corners(u, v, tri, corner, fan, first, last, out) -> int:
    """Corners of u and v in the triangles they share: out (2, 2), a row per triangle; how many there are."""
    count = 0
    for i in range(first, last):
        f = fan[i]
        ku = kv = -1
        for k in range(3):
            if tri[f, k] == u:
                ku = k
            elif tri[f, k] == v:
                kv = k
        if kv >= 0:
            if count < 2:
                out[count, 0], out[count, 1] = corner[f, ku], corner[f, kv]
            count += 1
    return count


@inner
def _corner_count(u, tri, corner, fan, first, last) -> int:
    """Drawn vertices of u: 1 inside a chart, 2 on a seam, more (given as 3) where seams meet."""
    one = two = -1
    for i in range(first, last):
        for k in range(3):
            if tri[fan[i], k] == u:
                c = corner[fan[i], k]
                if one < 0 or c == one:
                    one = c
                elif two < 0 or c == two:
                    two = c
                else:
                    return 3
    return 1 if two < 0 else 2


@inner
def _spoils(p, u, v, tri, fan, first, last, limit) -> bool:
    """Whether a triangle of u turns over, becomes a sliver or gets an edge of limit [m^2] when u goes to v."""
    for i in range(first, last):
        f = tri[fan[i]]
        if f[0] == v or f[1] == v or f[2] == v:
            continue
        k = 0 if f[0] == u else (1 if f[1] == u else 2)
        b, c = p[f[(k + 1) % 3]], p[f[(k + 2) % 3]]
        to_b, to_c, side = difference(b, p[v]), difference(c, p[v]), difference(b, c)
        before, after = cross(difference(b, p[u]), difference(c, p[u])), cross(to_b, to_c)
        if dot(before, after) <= 0.4 * math.sqrt(dot(before, before) * dot(after, after)):
            return True
        longest = max(dot(side, side), dot(to_b, to_b), dot(to_c, to_c))
        if longest > limit or math.sqrt(dot(after, after)) < 0.08 * longest:
            return True
    return False


@compiled
def cheapest(p, tri, corner, start, fan, quadric, weight, limit, to, cost) -> None:
    """For each vertex the neighbour to collapse to and its cost: mean square distance to the planes left [m^2].

    limit: no edge longer than its root is made.
    """
    shared = np.empty((2, 2), np.int64)
    for u in range(len(p)):
        to[u], cost[u] = -1, _NEVER
        first, last = start[u], start[u + 1]
        if last - first < 3 or last - first > _RING:
            continue
        corners = _corner_count(u, tri, corner, fan, first, last)
        if corners > 2:
            continue
        for i in range(first, last):
            for k in range(3):
                v = tri[fan[i], k]
                if v == u:
                    continue
                price = quadric_at(quadric[u], p[v]) / max(1e-12, weight[u])
                if price >= cost[u]:
                    continue
                if last - first + start[v + 1] - start[v] - 4 > _VALENCE:
                    continue
                if _edge_corners(u, v, tri, corner, fan, first, last, shared) != 2:
                    continue
                along_seam = shared[0, 0] != shared[1, 0] and shared[0, 1] != shared[1, 1]
                if corners == 2 and not along_seam:
                    continue
                if corners == 1 and shared[0, 1] != shared[1, 1]:
                    continue
                if _spoils(p, u, v, tri, fan, first, last, limit):
                    continue
                to[u], cost[u] = v, price


@compiled
def collapse(order, to, cost, tri, corner, start, fan, quadric, weight, left) -> int:
    """Make the collapses in `order` that do not touch one another, until `left` triangles are left; gives how many are.

    Collapsed triangles get -1.
    """
    living = 0
    for f in range(len(tri)):
        living += tri[f, 0] >= 0
    touched = np.zeros(len(to), np.bool_)
    mark = np.full(len(to), -1, np.int64)
    shared = np.empty((2, 2), np.int64)
    for u in order:
        v = to[u]
        if living <= left or v < 0:
            break
        first, last = start[u], start[u + 1]
        free = not touched[v]
        for i in range(first, last):
            for k in range(3):
                free = free and not touched[tri[fan[i], k]]
        if not free:
            continue
        # Link condition of a closed surface: u and v have exactly two neighbours in common.
        common = 0
        for i in range(first, last):
            for k in range(3):
                mark[tri[fan[i], k]] = u
        for i in range(start[v], start[v + 1]):
            for k in range(3):
                w = tri[fan[i], k]
                if w not in (u, v) and mark[w] == u:
                    mark[w] = -1
                    common += 1
        if common != 2:
            continue
        _edge_corners(u, v, tri, corner, fan, first, last, shared)
        for i in range(first, last):
            for k in range(3):
                touched[tri[fan[i], k]] = True
        for i in range(first, last):
            f = fan[i]
            if tri[f, 0] == v or tri[f, 1] == v or tri[f, 2] == v:
                tri[f, 0] = tri[f, 1] = tri[f, 2] = -1
                living -= 1
                continue
            for k in range(3):
                if tri[f, k] == u:
                    tri[f, k] = v
                    corner[f, k] = shared[0, 1] if corner[f, k] == shared[0, 0] else shared[1, 1]
        quadric[v] += quadric[u]
        weight[v] += weight[u]
    return living
