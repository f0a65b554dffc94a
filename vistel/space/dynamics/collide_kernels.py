"""Numba kernels that find the contacts of things in a step. float64.

Broad phase: things sorted along X, and each moving thing searches for others within reach. Narrow phase: contact points of one
thing in the primitives of the other.

Rows of `contacts`: point, normal (out of b into a), two tangents, arms of a and b to the point, velocity of a pusher
(each three numbers); gap, impulses along normal and tangents, effective masses along them, closing speed before.
"""

# pyright: basic
# ruff: noqa: SIM102

import math

import numpy as np

from vistel.implicit.contacts.contact_kernels import surface
from vistel.jit.kernel_jit import compiled, inner

PUSHER = -2
"""Stands for a person in a pair of contacts; -1 stands for the floor."""
WIDTH = 29
"""Numbers of one contact."""
MARGIN = 0.004
"""Gaps smaller than this are contacts, even of things that rest [m]."""


@inner
def _length(v, n):
    """Of row n of v."""
    return math.sqrt(v[n, 0] * v[n, 0] + v[n, 1] * v[n, 1] + v[n, 2] * v[n, 2])


@inner
def _turned(r, k, v):
    """Row k of r @ v."""
    return r[k, 0] * v[0] + r[k, 1] * v[1] + r[k, 2] * v[2]


@inner
def _cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@inner
def _add(pairs, contacts, count, a, b, primitive, x, y, z, nx, ny, nz, gap, position):
    """Append one contact; returns the new count. b: other thing, -1 the floor, -2 a pusher."""
    if count >= len(contacts) or not (gap > -0.5 and gap < 1.0):
        return count
    pairs[count, 0], pairs[count, 1], pairs[count, 2] = a, b, primitive
    c = contacts[count]
    c[:] = 0.0
    c[0], c[1], c[2], c[3], c[4], c[5], c[21] = x, y, z, nx, ny, nz, gap
    if abs(nx) > 0.7:  # any tangent will do, always the same one
        m = 1.0 / math.sqrt(nx * nx + ny * ny)
        c[6], c[7], c[8] = -ny * m, nx * m, 0.0
    else:
        m = 1.0 / math.sqrt(ny * ny + nz * nz)
        c[6], c[7], c[8] = 0.0, -nz * m, ny * m
    _cross(c[3:6], c[6:9], c[9:12])
    for k in range(3):
        c[12 + k] = c[k] - position[a, k]
        if b >= 0:
            c[15 + k] = c[k] - position[b, k]
    return count + 1


@inner
def _speed_at(velocity, spin, position, n, x, y, z):
    """Speed of thing n at a point of the room."""
    rx, ry, rz = x - position[n, 0], y - position[n, 1], z - position[n, 2]
    vx = velocity[n, 0] + spin[n, 1] * rz - spin[n, 2] * ry
    vy = velocity[n, 1] + spin[n, 2] * rx - spin[n, 0] * rz
    vz = velocity[n, 2] + spin[n, 0] * ry - spin[n, 1] * rx
    return math.sqrt(vx * vx + vy * vy + vz * vz)


@inner
def pairs_in_reach(position, radius, speed, mode, dt):
    """Pairs of things a, b one of which moves the other or may wake it, as a * n + b with a not fixed; sorted.

    Two that are not fixed come both ways round.
    """
    n = len(mode)
    loose = np.flatnonzero(mode != 0)
    fixed = np.flatnonzero(mode == 0)
    reach = np.empty(n)
    for a in range(n):
        reach[a] = radius[a] + 0.5 * MARGIN + speed[a] * dt
    widest = reach[loose].max() if len(loose) > 0 else 0.0
    x = position[loose, 0]
    order = np.argsort(x)
    x = x[order]
    out, count = np.empty(64, np.int64), 0
    for a in loose:
        if mode[a] == 2:
            continue
        if mode[a] == 1:
            for b in fixed:
                count, out = _with_pair(out, count, a, b, n, position, reach)
        for k in range(np.searchsorted(x, position[a, 0] - reach[a] - widest), len(loose)):
            b = loose[order[k]]
            if position[b, 0] > position[a, 0] + reach[a] + widest:
                break
            # Of two that both move the first brings the pair; two that hands carry leave each other alone.
            if b == a or (mode[b] != 2 and (b < a or (mode[a] == 3 and mode[b] == 3))):
                continue
            before = count
            count, out = _with_pair(out, count, a, b, n, position, reach)
            if count > before:
                count, out = _with_pair(out, count, b, a, n, position, reach)
    return np.sort(out[:count])


@inner
def _with_pair(out, count, a, b, n, position, reach):
    """The pair added, if its spheres meet."""
    dx, dy = position[a, 0] - position[b, 0], position[a, 1] - position[b, 1]
    dz = position[a, 2] - position[b, 2]
    far = reach[a] + reach[b]
    if not dx * dx + dy * dy + dz * dz <= far * far:
        return count, out
    if count == len(out):
        more = np.empty(2 * count, np.int64)
        more[:count] = out
        out = more
    out[count] = a * n + b
    return count + 1, out


@inner
def _among(some, number):
    """Whether a number is among some that are sorted."""
    k = np.searchsorted(some, number) if len(some) > 0 else 0
    return k < len(some) and some[k] == number


@compiled
def detect(
    first,
    kind,
    start,
    params,
    rotation,
    position_p,
    contact_point_first,
    contact_point,
    contact_point_radius,
    radius,
    bound,
    body_r,
    centre,
    position,
    velocity,
    spin,
    mode,
    still,
    push_thing,
    push_point,
    push_normal,
    push_gap,
    push_velocity,
    apart,
    dt,
    pairs,
    contacts,
):
    """Write all contacts of things with each other and with what pushes them into `pairs` (K, 3) and `contacts` (K, columns); wake
    things asleep that something moving touches. Arrays as `Solids`, `Motions`, `Pushes` and `Joined` have them, room frame,
    SI units; dt: step [s]. Gives the number of contacts, and whether a thing was woken."""
    n = len(mode)
    count = 0
    woken = False
    seen = np.empty(5)
    w = np.empty(3)
    speed = np.empty(n)
    middle = np.empty((len(kind), 3))  # of the spheres round the primitives, in the room
    for a in range(n):
        speed[a] = _length(velocity, a) + radius[a] * _length(spin, a)
        for p in range(first[a], first[a + 1]):
            for k in range(3):
                middle[p, k] = position[a, k] + _turned(body_r[a], k, centre[p])
    near = pairs_in_reach(position, radius, speed, mode, dt)
    next_pair = 0
    for a in range(n):
        if mode[a] == 0:
            continue
        while next_pair < len(near) and near[next_pair] // n == a:  # contact points of one in the primitives of the other
            b, joined = near[next_pair] % n, _among(apart, near[next_pair])
            next_pair += 1
            if joined:
                continue
            margin = MARGIN + (speed[a] + speed[b]) * dt
            # (a, b) walks a's contact points; b's contact points against a come when the loops meet (b, a), except that fixed
            # things are no `a`: theirs are walked here.
            for turn in range(2):
                if turn == 1 and mode[b] != 0:
                    break
                i, j = (a, b) if turn == 0 else (b, a)
                for q in range(contact_point_first[i], contact_point_first[i + 1]):
                    for k in range(3):
                        w[k] = position[i, k] + _turned(body_r[i], k, contact_point[q])
                    for p in range(first[j], first[j + 1]):
                        far = 0.0
                        for k in range(3):
                            far += (w[k] - middle[p, k]) * (w[k] - middle[p, k])
                        reach = bound[p] + contact_point_radius[q] + margin
                        if far > reach * reach:
                            continue
                        r = rotation[p]
                        x, y, z = w[0] - position_p[p, 0], w[1] - position_p[p, 1], w[2] - position_p[p, 2]
                        surface(
                            r[0, 0] * x + r[1, 0] * y + r[2, 0] * z,
                            r[0, 1] * x + r[1, 1] * y + r[2, 1] * z,
                            r[0, 2] * x + r[1, 2] * y + r[2, 2] * z,
                            kind[p],
                            params[start[p] : start[p + 1]],
                            seen,
                        )
                        gap = seen[0] - contact_point_radius[q]
                        if not gap < margin:
                            continue
                        nx = r[0, 0] * seen[1] + r[0, 1] * seen[2] + r[0, 2] * seen[3]
                        ny = r[1, 0] * seen[1] + r[1, 1] * seen[2] + r[1, 2] * seen[3]
                        nz = r[2, 0] * seen[1] + r[2, 1] * seen[2] + r[2, 2] * seen[3]
                        back = contact_point_radius[q] + 0.5 * gap
                        px, py, pz = w[0] - back * nx, w[1] - back * ny, w[2] - back * nz
                        if gap < 0.003:
                            for k in range(2):
                                u, v = (a, b) if k == 0 else (b, a)
                                if mode[u] == 2 and (mode[v] == 1 or mode[v] == 3):
                                    if _speed_at(velocity, spin, position, v, px, py, pz) > 0.08:
                                        mode[u], still[u] = 1, 0
                                        woken = True
                        if mode[i] == 0:  # keep `a` the one that moves
                            count = _add(pairs, contacts, count, j, i, 0, px, py, pz, -nx, -ny, -nz, gap, position)
                        else:
                            part = p - first[j]
                            count = _add(pairs, contacts, count, i, j, part, px, py, pz, nx, ny, nz, gap, position)
        # The floor is the plane y = 0.
        if mode[a] == 1 and position[a, 1] - radius[a] < MARGIN + speed[a] * dt:
            for q in range(contact_point_first[a], contact_point_first[a + 1]):
                for k in range(3):
                    w[k] = position[a, k] + _turned(body_r[a], k, contact_point[q])
                gap = w[1] - contact_point_radius[q]
                if gap < MARGIN + speed[a] * dt:
                    count = _add(pairs, contacts, count, a, -1, 0, w[0], 0.5 * gap, w[2], 0.0, 1.0, 0.0, gap, position)
    for i in range(len(push_thing)):
        a = push_thing[i]
        v = push_velocity[i]
        if mode[a] == 2 and push_gap[i] < 0.0:
            if _length(push_velocity, i) > 0.03 or push_gap[i] < -0.004:
                mode[a], still[a] = 1, 0
                woken = True
        if mode[a] == 1:
            before = count
            x, m = push_point[i], push_normal[i]
            gap = push_gap[i]
            count = _add(pairs, contacts, count, a, -2, 0, x[0], x[1], x[2], m[0], m[1], m[2], gap, position)
            if count > before:
                contacts[before, 18:21] = v
    return count, woken
