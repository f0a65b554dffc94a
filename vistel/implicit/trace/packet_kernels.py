"""Packets of up to 64 neighbouring rays: which primitives they can meet, and between which distances.

A packet is bounded by a cone about its mean direction: the distance of a ray from an axis is convex along it, so what the
widest ray reaches at both ends bounds all of them between. The hierarchy of the program is walked with that cone; what is
left is tested ray by ray. Distances in a packet are measured from its base, the point of its first ray nearest to the
middle of the scene, so that float32 carries the size of the scene and not the camera's distance.
"""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.jit.kernel_jit import fast, fast_inner, leaf, reduction
from vistel.jit.numbers import HALF, ONE, ZERO
from vistel.jit.pointers import at
from vistel.jit.wide import wide

RAYS = 64
F32 = np.float32
NEVER = F32(1e30)
SMALL = F32(1e-12)


@fast
def load(origins, directions, near, far, first, n, centre, radius, rays, start, end, place):
    """Put n rays from `first` on into rows: points on the packet's base, directions; start, end: from where to where each
    is inside the ball (centre, radius) that holds all primitives, start > end where it never is.

    place: (4,) becomes the base point and its distance on the rays. False where no ray meets the ball.
    """
    base = 0.0
    for k in range(3):
        base += (centre[k] - origins[first, k]) * directions[first, k]
    for k in range(3):
        place[k] = origins[first, k] + base * directions[first, k]
    place[3] = base
    for i in range(RAYS):
        j = first + (i if i < n else 0)
        dx, dy, dz = directions[j, 0], directions[j, 1], directions[j, 2]
        rays[i] = F32(origins[j, 0] + base * dx - place[0])
        rays[RAYS + i] = F32(origins[j, 1] + base * dy - place[1])
        rays[2 * RAYS + i] = F32(origins[j, 2] + base * dz - place[2])
        rays[3 * RAYS + i], rays[4 * RAYS + i], rays[5 * RAYS + i] = F32(dx), F32(dy), F32(dz)
        start[i], end[i] = F32(near[j] - base), F32(min(far[j] - base, 1e29) if i < n else -1e29)
    x, y, z = F32(centre[0] - place[0]), F32(centre[1] - place[1]), F32(centre[2] - place[2])
    clip_to_ball(rays, x, y, z, F32(radius), start, end)
    return smallest(start) < NEVER


@leaf
def clip_to_ball(rays, x, y, z, radius, start, end):
    """The stretches start to end of rays that lie in a ball; NEVER where none does."""
    wide()
    for i in range(RAYS):
        px, py, pz = x - rays[i], y - rays[RAYS + i], z - rays[2 * RAYS + i]
        dx, dy, dz = rays[3 * RAYS + i], rays[4 * RAYS + i], rays[5 * RAYS + i]
        t = px * dx + py * dy + pz * dz
        px, py, pz = px - t * dx, py - t * dy, pz - t * dz
        rest = radius * radius - (px * px + py * py + pz * pz)
        half = math.sqrt(max(rest, ZERO))
        a, b = max(t - half, start[i]), min(t + half, end[i])
        inside = (rest > ZERO) & (a <= b)
        start[i] = a if inside else NEVER
        end[i] = b if inside else -NEVER


@reduction
def smallest(row):
    """The smallest of a row."""
    v = row[0]
    for i in range(1, RAYS):
        v = min(v, row[i])
    return v


@reduction
def largest(row):
    """The largest of a row."""
    v = row[0]
    for i in range(1, RAYS):
        v = max(v, row[i])
    return v


@reduction
def total(row):
    """The sum of a row."""
    v = ZERO
    for i in range(RAYS):
        v += row[i]
    return v


@reduction
def _widest(rays, start, axis, t):
    """Of the rays that count, the largest squared distance from the axis (through 0) and | along - t | at t."""
    ax, ay, az = axis[3], axis[4], axis[5]
    wide_, slack = ZERO, ZERO
    for i in range(RAYS):
        x, y = rays[i] + t * rays[3 * RAYS + i], rays[RAYS + i] + t * rays[4 * RAYS + i]
        z = rays[2 * RAYS + i] + t * rays[5 * RAYS + i]
        along = x * ax + y * ay + z * az
        x, y, z = x - along * ax, y - along * ay, z - along * az
        counts = start[i] < NEVER
        wide_ = max(wide_, x * x + y * y + z * z if counts else ZERO)
        slack = max(slack, abs(along - t) if counts else ZERO)
    return wide_, slack


@fast
def bound(rays, start, end, cone):
    """The cone about the rays of a packet that count. cone: (11,) point 0, unit axis, distances a and b between which it
    reaches, radius at a and b, and by how much a distance on a ray differs from that on the axis."""
    a, b = smallest(start), largest(end)
    ax = ay = az = ZERO
    for i in range(0, RAYS, 9):  # corners and middle of the square will do; any axis is right
        ax, ay, az = ax + rays[3 * RAYS + i], ay + rays[4 * RAYS + i], az + rays[5 * RAYS + i]
    length = math.sqrt(ax * ax + ay * ay + az * az)
    if length < SMALL:
        ax, length = ONE, ONE
    cone[0] = cone[1] = cone[2] = ZERO
    cone[3], cone[4], cone[5] = ax / length, ay / length, az / length
    r0, slack0 = _widest(rays, start, cone, a)
    r1, slack1 = _widest(rays, start, cone, b)
    cone[6], cone[7], cone[8], cone[9] = a, b, math.sqrt(r0), math.sqrt(r1)
    cone[10] = max(slack0, slack1)


@fast_inner
def misses(cone, x, y, z, radius):
    """Whether a ball lies outside the cone."""
    along = x * cone[3] + y * cone[4] + z * cone[5]
    reach = radius + cone[10]
    low, high = max(along - reach, cone[6]), min(along + reach, cone[7])
    if low > high:
        return True
    x, y, z = x - along * cone[3], y - along * cone[4], z - along * cone[5]
    grow = (cone[9] - cone[8]) / max(cone[7] - cone[6], SMALL)
    widest = cone[8] + grow * ((high if grow > ZERO else low) - cone[6])
    far = radius + widest
    return x * x + y * y + z * z > far * far


@fast
def gather(tree_box, tree_link, tree_order, nodes, capsule, shift, cone, found):
    """The leaves whose capsules, moved by `shift` (3,), may meet the cone; how many. They are not in order."""
    count = 0
    node = 0
    sx, sy, sz = shift[0], shift[1], shift[2]
    while node < nodes:
        b = at(tree_box, 6 * node)
        hx, hy, hz = HALF * (b[3] - b[0]), HALF * (b[4] - b[1]), HALF * (b[5] - b[2])
        if misses(cone, b[0] + hx + sx, b[1] + hy + sy, b[2] + hz + sz, math.sqrt(hx * hx + hy * hy + hz * hz)):
            node = tree_link[3 * node]
            continue
        for k in range(tree_link[3 * node + 1], tree_link[3 * node + 2]):
            leaf_ = tree_order[k]
            c = at(capsule, 7 * leaf_)
            hx, hy, hz = HALF * (c[3] - c[0]), HALF * (c[4] - c[1]), HALF * (c[5] - c[2])
            half = math.sqrt(hx * hx + hy * hy + hz * hz)
            if not misses(cone, c[0] + hx + sx, c[1] + hy + sy, c[2] + hz + sz, c[6] + half):
                found[count] = leaf_
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
