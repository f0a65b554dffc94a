"""Kernels of mesh reduction: edge collapses that keep the topology, edge flips."""

# pyright: basic

from __future__ import annotations

import math

import numpy as np

from vistel.geometry.vector_kernels import cross, difference, dot
from vistel.jit.kernel_jit import compiled, inner

_BENDING = 0.42
"""Turn of the normal along an edge that counts as much as one wanted length [rad]."""


@inner
def _fan(u, head, following, t, out) -> int:
    """Living triangles round vertex u into out; drops the dead from its list."""
    count = 0
    previous = -1
    corner = head[u]
    while corner >= 0:
        after = following[corner]
        if t[corner // 3, 0] < 0:
            if previous < 0:
                head[u] = after
            else:
                following[previous] = after
        else:
            if count < len(out):
                out[count] = corner // 3
                count += 1
            previous = corner
        corner = after
    return count


@inner
def _keeps_facing(v, t, fan, count, moved, other, place) -> bool:
    """Whether the triangles of `fan` without `other` keep their side when vertex `moved` goes to `place`."""
    for i in range(count):
        f = t[fan[i]]
        if f[0] == other or f[1] == other or f[2] == other:
            continue
        k = 0 if f[0] == moved else (1 if f[1] == moved else 2)
        b, c = v[f[(k + 1) % 3]], v[f[(k + 2) % 3]]
        from_b, from_c = difference(b, v[moved]), difference(c, v[moved])
        to_b, to_c = difference(b, place), difference(c, place)
        before, after = cross(from_b, from_c), cross(to_b, to_c)
        if dot(before, after) <= 0.3 * math.sqrt(dot(before, before) * dot(after, after)):
            return False
        # No slivers, unless the triangle was a worse one.
        side = difference(b, c)
        opposite = dot(side, side)
        longest = max(opposite, dot(to_b, to_b), dot(to_c, to_c))
        was = max(opposite, dot(from_b, from_b), dot(from_c, from_c))
        shape = math.sqrt(dot(after, after)) / longest
        if shape < 0.15 and shape < math.sqrt(dot(before, before)) / was:
            return False
    return True


@compiled
def collapse(v, n, h, t, limit, left, target) -> int:
    """Collapses edges shorter than sqrt(limit) in the metric, in place; dead triangles get -1. Gives vertices left."""
    head = np.full(len(v), -1, np.int64)
    following = np.full(3 * len(t), -1, np.int64)
    for f in range(len(t)):
        for k in range(3):
            following[3 * f + k] = head[t[f, k]]
            head[t[f, k]] = 3 * f + k
    mark = np.full(len(v), -1, np.int64)
    fan_u, fan_v, fan_w = np.empty(64, np.int64), np.empty(64, np.int64), np.empty(64, np.int64)
    stamp = 0
    stride = 514229
    while len(t) % stride == 0:
        stride += 2
    f = 0
    for _ in range(len(t)):
        f = (f + stride) % len(t)
        for k in range(3):
            if t[f, 0] < 0:
                break
            a, b = t[f, k], t[f, (k + 1) % 3]
            bend, d = difference(n[a], n[b]), difference(v[a], v[b])
            size = 0.5 * (h[a] + h[b])
            metric = dot(d, d) / (size * size) + dot(bend, bend) / (_BENDING * _BENDING)
            if metric > limit:
                continue
            na, nb_ = _fan(a, head, following, t, fan_u), _fan(b, head, following, t, fan_v)
            if na + nb_ > 60 or na + nb_ - 4 > 11:
                continue
            # Link condition of a closed surface: the two ends have exactly the two opposite corners in common.
            stamp += 1
            for i in range(na):
                for c in range(3):
                    mark[t[fan_u[i], c]] = stamp
            stamp += 1
            common = 0
            thin = False
            for i in range(nb_):
                for c in range(3):
                    w = t[fan_v[i], c]
                    if w in (a, b):
                        continue
                    if mark[w] == stamp - 1:
                        mark[w] = stamp
                        common += 1
                        if _fan(w, head, following, t, fan_w) <= 3:
                            thin = True
            if common != 2 or thin:
                continue
            place = 0.5 * (v[a, 0] + v[b, 0]), 0.5 * (v[a, 1] + v[b, 1]), 0.5 * (v[a, 2] + v[b, 2])
            if not (_keeps_facing(v, t, fan_u, na, a, b, place) and _keeps_facing(v, t, fan_v, nb_, b, a, place)):
                continue
            middle = n[a, 0] + n[b, 0], n[a, 1] + n[b, 1], n[a, 2] + n[b, 2]
            length = max(1e-9, math.sqrt(dot(middle, middle)))
            for c in range(3):
                v[a, c], n[a, c] = place[c], middle[c] / length
            h[a] = size
            for i in range(nb_):
                g = fan_v[i]
                if t[g, 0] == a or t[g, 1] == a or t[g, 2] == a:
                    t[g, 0] = t[g, 1] = t[g, 2] = -1
                else:
                    for c in range(3):
                        if t[g, c] == b:
                            t[g, c] = a
                            # The corner moves to the list of a.
                            following[3 * g + c] = head[a]
                            head[a] = 3 * g + c
            head[b] = -1
            left -= 1
            if left <= target:
                return left
            break
    return left


@inner
def _sharpest(a, b, c) -> float:
    """Largest cosine of a triangle's angles (1: degenerate)."""
    u, v, w = difference(b, a), difference(c, b), difference(a, c)
    lu, lv, lw = math.sqrt(dot(u, u)), math.sqrt(dot(v, v)), math.sqrt(dot(w, w))
    if lu * lv * lw < 1e-30:
        return 1.0
    return max(-dot(u, w) / (lu * lw), -dot(u, v) / (lu * lv), -dot(v, w) / (lv * lw))


@inner
def _facing(a, b, c):
    """Unit normal of a triangle."""
    n = cross(difference(b, a), difference(c, a))
    length = max(1e-30, math.sqrt(dot(n, n)))
    return n[0] / length, n[1] / length, n[2] / length


@compiled
def flip(v, t) -> None:
    """Flips edges, in place, where that makes the smallest angle larger and the surface hardly bends there."""
    count = len(t)
    keys = np.empty(3 * count, np.int64)
    for f in range(count):
        for k in range(3):
            keys[3 * f + k] = t[f, k] * len(v) + t[f, (k + 1) % 3]
    order = np.argsort(keys)
    ordered = keys[order]
    touched = np.zeros(len(v), np.bool_)
    for f in range(count):
        for k in range(3):
            a, b, c = t[f, k], t[f, (k + 1) % 3], t[f, (k + 2) % 3]
            if a > b or touched[a] or touched[b] or touched[c]:
                continue
            key = b * len(v) + a
            i = np.searchsorted(ordered, key)
            if i == len(ordered) or ordered[i] != key:
                continue
            g, m = order[i] // 3, order[i] % 3
            d = t[g, (m + 2) % 3]
            if touched[d] or d == c:
                continue
            # The new edge must not exist yet.
            there, back = c * len(v) + d, d * len(v) + c
            i, j = np.searchsorted(ordered, there), np.searchsorted(ordered, back)
            if (i < len(ordered) and ordered[i] == there) or (j < len(ordered) and ordered[j] == back):
                continue
            now = max(_sharpest(v[a], v[b], v[c]), _sharpest(v[b], v[a], v[d]))
            then = max(_sharpest(v[c], v[d], v[b]), _sharpest(v[d], v[c], v[a]))
            if then > now - 0.01:
                continue
            n1, n2 = _facing(v[a], v[b], v[c]), _facing(v[b], v[a], v[d])
            m1, m2 = _facing(v[c], v[d], v[b]), _facing(v[d], v[c], v[a])
            flat = dot(n1, n2)
            if flat < 0.85 or dot(m1, m2) < flat - 0.05 or dot(m1, n1) < 0.7 or dot(m2, n1) < 0.7:
                continue
            t[f, 0], t[f, 1], t[f, 2] = c, d, b
            t[g, 0], t[g, 1], t[g, 2] = d, c, a
            touched[a] = touched[b] = touched[c] = touched[d] = True
            break
