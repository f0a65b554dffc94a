"""Packets of up to 64 neighbouring rays: which primitives they can meet, and between which distances.

A packet is bounded by a cone about its mean ray, whose radius at a distance t is at most lo + (hi - lo) (t - a) / (b - a)
between the nearest and farthest distances a and b of interest. The hierarchy of the program is walked with that cone;
what is left is tested ray by ray against the primitive's box. Distances in a packet are measured from its base, so that
float32 carries the size of the scene and not the camera's distance.
"""

# pyright: basic, reportCallIssue=false

from __future__ import annotations

import math

import numpy as np

from vistel.implicit.kernel_jit import fast, reduction
from vistel.implicit.pointers import at

RAYS = 64
F32 = np.float32
ZERO, ONE, HALF = F32(0.0), F32(1.0), F32(0.5)
NEVER = F32(1e30)
SMALL = F32(1e-12)


@fast
def slab(low, high, o, d):
    """Distances at which a line (a point o and direction d along one axis) is between two planes."""
    if abs(d) < 1e-30:
        return (-1e300, 1e300) if low <= o <= high else (1e300, -1e300)
    a, b = (low - o) / d, (high - o) / d
    return (a, b) if a < b else (b, a)


@fast
def clip_to_box(low, high, o, d, near, far):
    """The part of [near, far] in which a ray (3,), (3,) is in a box; empty where the first exceeds the second."""
    for k in range(3):
        a, b = slab(low[k], high[k], o[k], d[k])
        near, far = max(near, a), min(far, b)
    return near, far


@fast
def bound(rays, near, far, n, cone):
    """The cone about a packet. rays: (6, RAYS) float32 points on the base and directions; near, far: of each ray;
    cone: (10,) point, unit axis, distances a and b along it, radius at a and b. False where no ray has any length."""
    ax = ay = az = cx = cy = cz = ZERO
    m = 0
    first, last = NEVER, -NEVER
    for i in range(n):
        if near[i] <= far[i]:
            cx += rays[i]
            cy += rays[RAYS + i]
            cz += rays[2 * RAYS + i]
            ax += rays[3 * RAYS + i]
            ay += rays[4 * RAYS + i]
            az += rays[5 * RAYS + i]
            first, last = min(first, near[i]), max(last, far[i])
            m += 1
    if m == 0:
        return False
    length = math.sqrt(ax * ax + ay * ay + az * az)
    if length < F32(1e-3) * F32(m):
        ax, ay, az, length = ONE, ZERO, ZERO, ONE  # rays in all directions: any axis will do
    ax, ay, az = ax / length, ay / length, az / length
    cx, cy, cz = cx / F32(m), cy / F32(m), cz / F32(m)
    low, high = NEVER, -NEVER
    for end in range(2):
        for i in range(n):
            if near[i] <= far[i]:
                t = near[i] if end == 0 else far[i]
                x = rays[i] + t * rays[3 * RAYS + i] - cx
                y = rays[RAYS + i] + t * rays[4 * RAYS + i] - cy
                z = rays[2 * RAYS + i] + t * rays[5 * RAYS + i] - cz
                along = x * ax + y * ay + z * az
                low, high = min(low, along), max(high, along)
    span = max(high - low, SMALL)
    r0 = r1 = ZERO
    # The distance from the axis is convex along a ray, so a line through both ends' distances bounds it; the cone must
    # lie above every such line, which raising both ends of one line does.
    for i in range(n):
        if near[i] <= far[i]:
            for end in range(2):
                t = near[i] if end == 0 else far[i]
                x = rays[i] + t * rays[3 * RAYS + i] - cx
                y = rays[RAYS + i] + t * rays[4 * RAYS + i] - cy
                z = rays[2 * RAYS + i] + t * rays[5 * RAYS + i] - cz
                along = x * ax + y * ay + z * az
                x, y, z = x - along * ax, y - along * ay, z - along * az
                r = math.sqrt(x * x + y * y + z * z)
                f = (along - low) / span
                # Which end an excess is charged to: the nearer one.
                excess = r - (r0 + f * (r1 - r0))
                if excess > ZERO:
                    if f < HALF:
                        r0 += excess / (ONE - f)
                    else:
                        r1 += excess / f
    cone[0], cone[1], cone[2], cone[3], cone[4], cone[5] = cx, cy, cz, ax, ay, az
    cone[6], cone[7], cone[8], cone[9] = low, high, r0, r1
    return True


@fast
def misses(cone, box, reach):
    """Whether the ball round a box, widened by `reach`, lies outside the cone."""
    cx, cy, cz = HALF * (box[0] + box[3]), HALF * (box[1] + box[4]), HALF * (box[2] + box[5])
    hx, hy, hz = box[3] - cx, box[4] - cy, box[5] - cz
    radius = math.sqrt(hx * hx + hy * hy + hz * hz) + reach
    x, y, z = cx - cone[0], cy - cone[1], cz - cone[2]
    along = x * cone[3] + y * cone[4] + z * cone[5]
    if along + radius < cone[6] or along - radius > cone[7]:
        return True
    x, y, z = x - along * cone[3], y - along * cone[4], z - along * cone[5]
    grow = (cone[9] - cone[8]) / max(cone[7] - cone[6], SMALL)
    a, b = max(along - radius, cone[6]), min(along + radius, cone[7])
    widest = cone[8] + grow * ((b if grow > ZERO else a) - cone[6])
    total = radius + widest
    return x * x + y * y + z * z > total * total


@fast
def gather(tree_box, tree_link, tree_order, nodes, leaf_box, shift, cone, found):
    """The leaves whose boxes, moved by `shift` (3,), may meet the cone; how many. They are not in order."""
    count = 0
    node = 0
    box = np.empty(6, np.float32)
    while node < nodes:
        b = at(tree_box, 6 * node)
        for k in range(3):
            box[k], box[3 + k] = b[k] + shift[k], b[3 + k] + shift[k]
        if misses(cone, box, ZERO):
            node = tree_link[3 * node]
            continue
        for k in range(tree_link[3 * node + 1], tree_link[3 * node + 2]):
            leaf = tree_order[k]
            b = at(leaf_box, 6 * leaf)
            for j in range(3):
                box[j], box[3 + j] = b[j] + shift[j], b[3 + j] + shift[j]
            if not misses(cone, box, ZERO):
                found[count] = leaf
                count += 1
        node += 1
    return count


@fast
def sort(found, count):
    """Rising order, in place (Shell's gaps)."""
    gap = 1
    while gap < count:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(gap, count):
            v = found[i]
            j = i - gap
            while j >= 0 and found[j] > v:
                found[j + gap] = found[j]
                j -= gap
            found[j + gap] = v
        gap //= 3


@reduction
def box_range(rays, inverse, near, far, box, shift):
    """Between which distances any of the RAYS rays is in a box (6,) moved by `shift`; inverse: (3, RAYS) 1 / D."""
    first, last = NEVER, -NEVER
    ax, ay, az = box[0] + shift[0], box[1] + shift[1], box[2] + shift[2]
    bx, by, bz = box[3] + shift[0], box[4] + shift[1], box[5] + shift[2]
    for i in range(RAYS):
        u, v = (ax - rays[i]) * inverse[i], (bx - rays[i]) * inverse[i]
        a, b = min(u, v), max(u, v)
        u, v = (ay - rays[RAYS + i]) * inverse[RAYS + i], (by - rays[RAYS + i]) * inverse[RAYS + i]
        a, b = max(a, min(u, v)), min(b, max(u, v))
        u, v = (az - rays[2 * RAYS + i]) * inverse[2 * RAYS + i], (bz - rays[2 * RAYS + i]) * inverse[2 * RAYS + i]
        a, b = max(a, min(u, v)), min(b, max(u, v))
        a, b = max(a, near[i]), min(b, far[i])
        inside = a <= b
        first, last = min(first, a if inside else NEVER), max(last, b if inside else -NEVER)
    return first, last
