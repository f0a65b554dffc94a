"""Kernels of mesh reduction: edge collapses that keep the topology, edge flips."""

# pyright: basic

from __future__ import annotations

import numpy as np

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
        before = np.cross(b - v[moved], c - v[moved])
        after = np.cross(b - place, c - place)
        size = np.sqrt((before * before).sum() * (after * after).sum())
        if (before * after).sum() <= 0.3 * size:
            return False
        # No slivers, unless the triangle was a worse one.
        opposite = ((b - c) ** 2).sum()
        longest = max(opposite, ((b - place) ** 2).sum(), ((c - place) ** 2).sum())
        was = max(opposite, ((b - v[moved]) ** 2).sum(), ((c - v[moved]) ** 2).sum())
        shape = np.sqrt((after * after).sum()) / longest
        if shape < 0.15 and shape < np.sqrt((before * before).sum()) / was:
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
            bend = n[a] - n[b]
            size = 0.5 * (h[a] + h[b])
            d = v[a] - v[b]
            metric = (d * d).sum() / (size * size) + (bend * bend).sum() / (_BENDING * _BENDING)
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
            place = 0.5 * (v[a] + v[b])
            if not (_keeps_facing(v, t, fan_u, na, a, b, place) and _keeps_facing(v, t, fan_v, nb_, b, a, place)):
                continue
            v[a] = place
            middle = n[a] + n[b]
            n[a] = middle / max(1e-9, np.sqrt((middle * middle).sum()))
            h[a] = size
            for i in range(nb_):
                g = fan_v[i]
                if t[g, 0] == a or t[g, 1] == a or t[g, 2] == a:
                    t[g, :] = -1
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
    u, v, w = b - a, c - b, a - c
    lu, lv, lw = np.sqrt((u * u).sum()), np.sqrt((v * v).sum()), np.sqrt((w * w).sum())
    if lu * lv * lw < 1e-30:
        return 1.0
    return max(-(u * w).sum() / (lu * lw), -(u * v).sum() / (lu * lv), -(v * w).sum() / (lv * lw))


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
            n1, n2 = np.cross(v[b] - v[a], v[c] - v[a]), np.cross(v[a] - v[b], v[d] - v[b])
            m1, m2 = np.cross(v[d] - v[c], v[b] - v[c]), np.cross(v[c] - v[d], v[a] - v[d])
            n1 /= np.sqrt((n1 * n1).sum())
            n2 /= np.sqrt((n2 * n2).sum())
            m1 /= max(1e-30, np.sqrt((m1 * m1).sum()))
            m2 /= max(1e-30, np.sqrt((m2 * m2).sum()))
            if (n1 * n2).sum() < 0.85 or (m1 * m2).sum() < (n1 * n2).sum() - 0.05 or (m1 * n1).sum() < 0.7 or (m2 * n1).sum() < 0.7:
                continue
            t[f, 0], t[f, 1], t[f, 2] = c, d, b
            t[g, 0], t[g, 1], t[g, 2] = d, c, a
            touched[a] = touched[b] = touched[c] = touched[d] = True
            break
