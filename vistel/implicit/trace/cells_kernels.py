"""Cutting an intersection box into eight, again and again, down to the cells in which the surface of a sum can be."""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.implicit.rows.row_kernels import F32, blend_one
from vistel.jit.kernel_jit import fast, fast_inner

HAIR = 1e-9


@fast_inner
def _f(family, warp, d):
    return float(blend_one(family, F32(warp), F32(min(max(d, 0.0), 1.0)))[0])


@fast
def refine(box, cones, owner, leaf_of, capsule, has_cones, is_ratio, weight, family, warp, needed, threshold, levels, cells, met):
    """Cells (k, 6) of a box (6,) in which all needed leaves reach and the sum may be the threshold; k, at most its room.

    A leaf is a blob or the mean of several: leaf_of (n,) says of which leaf each blob is, rising. cones: (m, 4, 4) of the
    triangles of all blobs, owner: (m,) whose (see `exact._Placed`); of each blob: capsule (n, 7), has_cones, is_ratio (the
    distance from the capsule's axis over its radius is d), weight, family, warp, needed
    (n,). met (m,) is set for triangles that reach into a kept cell.
    """
    n, m, room = capsule.shape[0], cones.shape[0], cells.shape[0]
    stack, level = np.empty((8 * levels + 16, 6)), np.empty(8 * levels + 16, np.int64)
    begin, end = np.empty(8 * levels + 16, np.int64), np.empty(8 * levels + 16, np.int64)
    pool = np.empty((levels + 2) * m + 1, np.int64)
    inside = np.empty((levels + 2) * m + 1, np.bool_)
    nearest, farthest, some = np.empty(n), np.empty(n), np.empty(n, np.bool_)
    middle, half = np.empty(3), np.empty(3)
    for i in range(m):
        pool[i] = i
    stack[0] = box
    level[0], begin[0], end[0] = 0, 0, m
    top, kept = 1, 0
    while top > 0:
        top -= 1
        a, b, depth = begin[top], end[top], level[top]
        for k in range(3):
            middle[k], half[k] = 0.5 * (stack[top, k] + stack[top, 3 + k]), 0.5 * (stack[top, 3 + k] - stack[top, k])
        for i in range(n):
            nearest[i], farthest[i], some[i] = 1.0, 0.0, False
            if not has_cones[i]:
                x0, x1, x2 = capsule[i, 3] - capsule[i, 0], capsule[i, 4] - capsule[i, 1], capsule[i, 5] - capsule[i, 2]
                y0, y1, y2 = middle[0] - capsule[i, 0], middle[1] - capsule[i, 1], middle[2] - capsule[i, 2]
                s = (x0 * y0 + x1 * y1 + x2 * y2) / max(x0 * x0 + x1 * x1 + x2 * x2, 1e-300)
                s = min(max(s, 0.0), 1.0)
                y0, y1, y2 = y0 - s * x0, y1 - s * x1, y2 - s * x2
                distance = math.sqrt(y0 * y0 + y1 * y1 + y2 * y2)
                reach = math.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2])
                some[i] = distance - reach < capsule[i, 6]
                # Without a ratio to go by, anything is possible in reach.
                nearest[i] = (distance - reach) / capsule[i, 6] if is_ratio[i] else 0.0
                farthest[i] = (distance + reach) / capsule[i, 6] if is_ratio[i] else 1.0
        last = b
        for c in range(a, b):
            j = pool[c]
            cut = False
            value = spread = 0.0
            for q in range(4):
                value, spread = cones[j, q, 3], HAIR
                for k in range(3):
                    value += cones[j, q, k] * middle[k]
                    spread += abs(cones[j, q, k]) * half[k]
                if q < 3 and value + spread < 0.0:
                    cut = True
                    break
            if cut:
                continue
            pool[last] = j
            inside[last] = value + spread >= 0.0
            last += 1
            i = owner[j]
            farthest[i] = max(farthest[i], 1.0 - value + spread)
            if value + spread >= 0.0:
                some[i] = True
                nearest[i] = min(nearest[i], 1.0 - value - spread)
        low = high = 0.0
        missing = False
        i = 0
        while i < n:
            # A mean of blobs lies between the least and the most of them.
            first, least, most, any_of = i, 1e300, 0.0, False
            while i < n and leaf_of[i] == leaf_of[first]:
                if some[i]:
                    least = min(least, weight[i] * _f(family[i], warp[i], farthest[i]))
                    most = max(most, weight[i] * _f(family[i], warp[i], nearest[i]))
                    any_of = True
                else:
                    least = 0.0
                i += 1
            if any_of:
                low, high = low + least, high + most
            elif needed[first]:
                missing = True
        if missing or low >= threshold or high < threshold:
            continue
        if depth < levels and kept + 8 < room:
            for e in range(8):
                for k in range(3):
                    upper = (e >> k) & 1
                    stack[top, k] = middle[k] - (0.0 if upper else half[k])
                    stack[top, 3 + k] = middle[k] + (half[k] if upper else 0.0)
                level[top], begin[top], end[top] = depth + 1, b, last
                top += 1
        elif kept < room:
            for k in range(3):
                cells[kept, k], cells[kept, 3 + k] = middle[k] - half[k], middle[k] + half[k]
            kept += 1
            for c in range(b, last):
                if inside[c]:
                    met[pool[c]] = True
    return kept
