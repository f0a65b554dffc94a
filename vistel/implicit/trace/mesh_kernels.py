"""Rays against triangles: a tree of boxes walked nearest side first, one ray at a time (double precision)."""

# pyright: basic, reportCallIssue=false

import numpy as np

from vistel.jit.kernel_jit import fast, fast_inner

DEPTH = 64
FAR = 1e300


@fast_inner
def _enter(box, node, ox, oy, oz, ix, iy, iz, near, far):
    """The distance at which a ray enters a node's box, FAR where it misses it between near and far."""
    u, v = (box[node, 0] - ox) * ix, (box[node, 3] - ox) * ix
    a, b = min(u, v), max(u, v)
    u, v = (box[node, 1] - oy) * iy, (box[node, 4] - oy) * iy
    a, b = max(a, min(u, v)), min(b, max(u, v))
    u, v = (box[node, 2] - oz) * iz, (box[node, 5] - oz) * iz
    a, b = max(a, min(u, v)), min(b, max(u, v))
    a, b = max(a, near), min(b, far)
    return a if a <= b * (1 + 1e-12) else FAR


@fast
def nearest(box, child, span, corner, edge1, edge2, o, d, near, far, any_hit):
    """Distance and triangle of the first hit between near and far; triangle -1 for none. Both sides count.

    box: (m, 6); child: (m, 2), second -1 at the bottom, where span (m, 2) says which triangles.
    """
    ox, oy, oz, dx, dy, dz = o[0], o[1], o[2], d[0], d[1], d[2]
    ix = 1.0 / dx if abs(dx) > 1e-300 else 1e300
    iy = 1.0 / dy if abs(dy) > 1e-300 else 1e300
    iz = 1.0 / dz if abs(dz) > 1e-300 else 1e300
    stack = np.empty(DEPTH, np.int32)
    enter = np.empty(DEPTH)
    best, which = far, -1
    top = 0
    t = _enter(box, 0, ox, oy, oz, ix, iy, iz, near, far)
    if t < FAR:
        stack[0], enter[0] = 0, t
        top = 1
    while top > 0:
        top -= 1
        if enter[top] > best:
            continue
        node = stack[top]
        while child[node, 1] >= 0:
            a, b = child[node, 0], child[node, 1]
            ta = _enter(box, a, ox, oy, oz, ix, iy, iz, near, best)
            tb = _enter(box, b, ox, oy, oz, ix, iy, iz, near, best)
            if tb < ta:
                a, b, ta, tb = b, a, tb, ta
            if ta >= FAR:
                node = -1
                break
            if tb < FAR:
                stack[top], enter[top] = b, tb
                top += 1
            node = a
        if node < 0:
            continue
        for k in range(span[node, 0], span[node, 1]):
            px = dy * edge2[k, 2] - dz * edge2[k, 1]
            py = dz * edge2[k, 0] - dx * edge2[k, 2]
            pz = dx * edge2[k, 1] - dy * edge2[k, 0]
            det = edge1[k, 0] * px + edge1[k, 1] * py + edge1[k, 2] * pz
            if det == 0.0:
                continue
            inv = 1.0 / det
            sx, sy, sz = ox - corner[k, 0], oy - corner[k, 1], oz - corner[k, 2]
            u = (sx * px + sy * py + sz * pz) * inv
            if u < -1e-12 or u > 1 + 1e-12:
                continue
            qx = sy * edge1[k, 2] - sz * edge1[k, 1]
            qy = sz * edge1[k, 0] - sx * edge1[k, 2]
            qz = sx * edge1[k, 1] - sy * edge1[k, 0]
            v = (dx * qx + dy * qy + dz * qz) * inv
            if v < -1e-12 or u + v > 1 + 1e-12:
                continue
            t = (edge2[k, 0] * qx + edge2[k, 1] * qy + edge2[k, 2] * qz) * inv
            if near <= t < best:
                best, which = t, k
                if any_hit:
                    return best, which
    return best, which


@fast
def cast(box, child, span, corner, edge1, edge2, origins, directions, near, far, any_hit, t, triangle):
    """`nearest` for rays (n, 3): t (n,), infinite for none, and triangle (n,), -1 for none."""
    for i in range(origins.shape[0]):
        if near[i] > far[i]:
            t[i], triangle[i] = np.inf, -1
            continue
        best, which = nearest(box, child, span, corner, edge1, edge2, origins[i], directions[i], near[i], min(far[i], FAR), any_hit)
        t[i], triangle[i] = (best if which >= 0 else np.inf), which


@fast
def span(box, child, _span, origins, directions, far, first, last):
    """From where to where rays are in the bottom boxes of a tree, before far (n,): first and last (n,) are widened."""
    stack = np.empty(2 * DEPTH, np.int32)
    for i in range(origins.shape[0]):
        ox, oy, oz = origins[i, 0], origins[i, 1], origins[i, 2]
        dx, dy, dz = directions[i, 0], directions[i, 1], directions[i, 2]
        ix = 1.0 / dx if abs(dx) > 1e-300 else 1e300
        iy = 1.0 / dy if abs(dy) > 1e-300 else 1e300
        iz = 1.0 / dz if abs(dz) > 1e-300 else 1e300
        stack[0] = 0
        top = 1
        while top > 0:
            top -= 1
            node = stack[top]
            u, v = (box[node, 0] - ox) * ix, (box[node, 3] - ox) * ix
            a, b = min(u, v), max(u, v)
            u, v = (box[node, 1] - oy) * iy, (box[node, 4] - oy) * iy
            a, b = max(a, min(u, v)), min(b, max(u, v))
            u, v = (box[node, 2] - oz) * iz, (box[node, 5] - oz) * iz
            a, b = max(a, min(u, v), 0.0), min(b, max(u, v), far[i])
            if a > b or (a >= first[i] and b <= last[i]):
                continue
            if child[node, 1] >= 0:
                stack[top], stack[top + 1] = child[node, 0], child[node, 1]
                top += 2
            else:
                first[i], last[i] = min(first[i], a), max(last[i], b)


@fast
def grow(low, high, order, box, child, span, bottom):
    """A tree over boxes (n, 3), (n, 3): halves at the median of the longest axis of the centres; its nodes.

    order: (n,) becomes the triangles from left to right.
    """
    n = low.shape[0]
    begin, end, slot = np.empty(DEPTH * 2, np.int64), np.empty(DEPTH * 2, np.int64), np.empty(DEPTH * 2, np.int64)
    key = np.empty(n)
    begin[0], end[0], slot[0] = 0, n, 0
    top, nodes = 1, 1
    while top > 0:
        top -= 1
        a, b, node = begin[top], end[top], slot[top]
        lo, hi = np.full(3, FAR), np.full(3, -FAR)
        clo, chi = np.full(3, FAR), np.full(3, -FAR)
        for i in range(a, b):
            for k in range(3):
                a0, a1 = low[order[i], k], high[order[i], k]
                lo[k], hi[k] = min(lo[k], a0), max(hi[k], a1)
                clo[k], chi[k] = min(clo[k], a0 + a1), max(chi[k], a0 + a1)
        for k in range(3):
            box[node, k], box[node, 3 + k] = lo[k], hi[k]
        child[node, 0] = child[node, 1] = -1
        span[node, 0], span[node, 1] = a, b
        if b - a <= bottom:
            continue
        axis = 0
        for k in range(1, 3):
            if chi[k] - clo[k] > chi[axis] - clo[axis]:
                axis = k
        for i in range(a, b):
            key[i] = low[order[i], axis] + high[order[i], axis]
        rank = np.argsort(key[a:b], kind="mergesort")
        order[a:b] = order[a:b][rank]
        middle = (a + b) // 2
        child[node, 0], child[node, 1] = nodes, nodes + 1
        begin[top], end[top], slot[top] = a, middle, nodes
        begin[top + 1], end[top + 1], slot[top + 1] = middle, b, nodes + 1
        top += 2
        nodes += 2
    return nodes
