"""Numba kernels of the room: posing and weighing things, finding their contacts, moving them. float64.

Rows of `contacts`: point, normal (out of b into a), two tangents, arms of a and b to the point, velocity of a pusher
(each three numbers); gap, impulses along normal and tangents, effective masses along them, closing speed before.
"""

# pyright: basic
# ruff: noqa: SIM102

from __future__ import annotations

import math

import numpy as np

from vistel.figure.rotation import matrix_from_quaternion
from vistel.implicit.contact_kernels import surface
from vistel.implicit.kernel_jit import compiled

GRAVITY = 9.81
FRICTION = 0.5
RESTITUTION = 0.25
STILL_STEPS = 30
"""A thing that has lain still for so many steps falls asleep."""
MAX_SPEED, MAX_SPIN = 8.0, 40.0
"""Metres and radians per second no thing exceeds."""
PUSHER = -2
"""Stands for a person in a pair of contacts; -1 stands for the floor."""
WIDTH = 29
"""Numbers of one contact."""


@compiled
def inertia(kind, start, params, rotation, position, first, end, radius, grid):
    """(3, 3) inertia per kilogram about the thing's origin, by sampling its inside."""
    out = np.zeros((3, 3))
    seen = np.empty(5)
    count = 0
    for i in range(grid**3):
        x = np.array([i % grid, i // grid % grid, i // (grid * grid)])
        x = ((x + 0.5) / grid * 2.0 - 1.0) * radius
        for k in range(first, end):
            d = x - position[k]
            r = rotation[k]
            a = r[0, 0] * d[0] + r[1, 0] * d[1] + r[2, 0] * d[2]
            b = r[0, 1] * d[0] + r[1, 1] * d[1] + r[2, 1] * d[2]
            c = r[0, 2] * d[0] + r[1, 2] * d[1] + r[2, 2] * d[2]
            surface(a, b, c, kind[k], params[start[k] : start[k + 1]], seen)
            if seen[0] <= 0.0:
                out += (x * x).sum() * np.eye(3) - x.reshape(3, 1) * x.reshape(1, 3)
                count += 1
                break
    # A thing thinner than the grid still has some inertia.
    return out / max(1, count) + 0.01 * radius * radius * np.eye(3)


@compiled
def pose(owner, local_r, local_p, body_r, body_p, out_r, out_p):
    for k in range(len(owner)):
        n = owner[k]
        for i in range(3):
            out_p[k, i] = body_p[n, i]
            for j in range(3):
                out_p[k, i] += body_r[n, i, j] * local_p[k, j]
                out_r[k, i, j] = (
                    body_r[n, i, 0] * local_r[k, 0, j]
                    + body_r[n, i, 1] * local_r[k, 1, j]
                    + body_r[n, i, 2] * local_r[k, 2, j]
                )


@compiled
def _turned(r, k, v):
    """Row k of r @ v."""
    return r[k, 0] * v[0] + r[k, 1] * v[1] + r[k, 2] * v[2]


@compiled
def _cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@compiled
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


@compiled
def _speed_at(velocity, spin, position, n, x, y, z):
    """Speed of thing n at a point of the room."""
    rx, ry, rz = x - position[n, 0], y - position[n, 1], z - position[n, 2]
    vx = velocity[n, 0] + spin[n, 1] * rz - spin[n, 2] * ry
    vy = velocity[n, 1] + spin[n, 2] * rx - spin[n, 0] * rz
    vz = velocity[n, 2] + spin[n, 0] * ry - spin[n, 1] * rx
    return math.sqrt(vx * vx + vy * vy + vz * vz)


@compiled
def detect(
    first, kind, start, params, rotation, position_p, probe_first, probe, probe_radius, radius, bound, body_r, centre,
    position, velocity, spin, mode, still, push_thing, push_point, push_normal, push_gap, push_velocity, dt, pairs,
    contacts,
):  # fmt: skip
    n = len(mode)
    count = 0
    woken = False
    seen = np.empty(5)
    w = np.empty(3)
    for a in range(n):
        if mode[a] == 0:
            continue
        speed_a = math.sqrt((velocity[a] * velocity[a]).sum()) + radius[a] * math.sqrt((spin[a] * spin[a]).sum())
        for b in range(n):  # probes of one in the primitives of the other, both ways
            if a == b:
                continue
            # At least one of the two must be free, or one asleep and the other able to wake it.
            if not (mode[a] == 1 or mode[b] == 1 or (mode[a] == 2 and mode[b] == 3)):
                if not (mode[a] == 3 and mode[b] == 2):
                    continue
            speed_b = math.sqrt((velocity[b] * velocity[b]).sum()) + radius[b] * math.sqrt((spin[b] * spin[b]).sum())
            margin = 0.004 + (speed_a + speed_b) * dt
            dx, dy = position[a, 0] - position[b, 0], position[a, 1] - position[b, 1]
            dz = position[a, 2] - position[b, 2]
            reach = radius[a] + radius[b] + margin
            if dx * dx + dy * dy + dz * dz > reach * reach:
                continue
            # (a, b) walks a's probes; b's probes against a come when the loops meet (b, a), except that fixed
            # things are no `a`: theirs are walked here.
            for turn in range(2):
                if turn == 1 and mode[b] != 0:
                    break
                i, j = (a, b) if turn == 0 else (b, a)
                for q in range(probe_first[i], probe_first[i + 1]):
                    for k in range(3):
                        w[k] = position[i, k] + _turned(body_r[i], k, probe[q])
                    for p in range(first[j], first[j + 1]):
                        far = 0.0
                        for k in range(3):
                            c = position[j, k] + _turned(body_r[j], k, centre[p])
                            far += (w[k] - c) * (w[k] - c)
                        reach = bound[p] + probe_radius[q] + margin
                        if far > reach * reach:
                            continue
                        r = rotation[p]
                        x, y, z = w[0] - position_p[p, 0], w[1] - position_p[p, 1], w[2] - position_p[p, 2]
                        surface(
                            r[0, 0] * x + r[1, 0] * y + r[2, 0] * z,
                            r[0, 1] * x + r[1, 1] * y + r[2, 1] * z,
                            r[0, 2] * x + r[1, 2] * y + r[2, 2] * z,
                            kind[p], params[start[p] : start[p + 1]], seen,
                        )  # fmt: skip
                        gap = seen[0] - probe_radius[q]
                        if not gap < margin:
                            continue
                        nx = r[0, 0] * seen[1] + r[0, 1] * seen[2] + r[0, 2] * seen[3]
                        ny = r[1, 0] * seen[1] + r[1, 1] * seen[2] + r[1, 2] * seen[3]
                        nz = r[2, 0] * seen[1] + r[2, 1] * seen[2] + r[2, 2] * seen[3]
                        back = probe_radius[q] + 0.5 * gap
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
        if mode[a] == 1 and position[a, 1] - radius[a] < 0.004 + speed_a * dt:
            for q in range(probe_first[a], probe_first[a + 1]):
                for k in range(3):
                    w[k] = position[a, k] + _turned(body_r[a], k, probe[q])
                gap = w[1] - probe_radius[q]
                if gap < 0.004 + speed_a * dt:
                    count = _add(pairs, contacts, count, a, -1, 0, w[0], 0.5 * gap, w[2], 0.0, 1.0, 0.0, gap, position)
    for i in range(len(push_thing)):
        a = push_thing[i]
        v = push_velocity[i]
        if mode[a] == 2 and push_gap[i] < 0.0:
            speed = math.sqrt((v * v).sum())
            if speed > 0.03 or push_gap[i] < -0.004:
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


@compiled
def _relative(c, a, b, velocity, spin, axis):
    """Velocity of a against b at the contact, along c[axis : axis + 3]."""
    ax = velocity[a, 0] + spin[a, 1] * c[14] - spin[a, 2] * c[13]
    ay = velocity[a, 1] + spin[a, 2] * c[12] - spin[a, 0] * c[14]
    az = velocity[a, 2] + spin[a, 0] * c[13] - spin[a, 1] * c[12]
    if b >= 0:
        ax -= velocity[b, 0] + spin[b, 1] * c[17] - spin[b, 2] * c[16]
        ay -= velocity[b, 1] + spin[b, 2] * c[15] - spin[b, 0] * c[17]
        az -= velocity[b, 2] + spin[b, 0] * c[16] - spin[b, 1] * c[15]
    else:
        ax, ay, az = ax - c[18], ay - c[19], az - c[20]
    return ax * c[axis] + ay * c[axis + 1] + az * c[axis + 2]


@compiled
def _apply(c, a, b, im, ii, velocity, spin, axis, j):
    """An impulse of j newton seconds along c[axis : axis + 3] on a, and its opposite on b."""
    d = c[axis : axis + 3]
    for turn in range(2):
        n = a if turn == 0 else b
        if n < 0 or im[n] == 0.0:
            continue
        s = j if turn == 0 else -j
        at = 12 if turn == 0 else 15
        tx = c[at + 1] * d[2] - c[at + 2] * d[1]
        ty = c[at + 2] * d[0] - c[at] * d[2]
        tz = c[at] * d[1] - c[at + 1] * d[0]
        for k in range(3):
            velocity[n, k] += s * im[n] * d[k]
            spin[n, k] += s * (ii[n, k, 0] * tx + ii[n, k, 1] * ty + ii[n, k, 2] * tz)


@compiled
def _mass(c, a, b, im, ii, axis):
    """Effective mass of the two along c[axis : axis + 3]."""
    d = c[axis : axis + 3]
    total = 0.0
    for turn in range(2):
        n = a if turn == 0 else b
        if n < 0 or im[n] == 0.0:
            continue
        at = 12 if turn == 0 else 15
        tx = c[at + 1] * d[2] - c[at + 2] * d[1]
        ty = c[at + 2] * d[0] - c[at] * d[2]
        tz = c[at] * d[1] - c[at + 1] * d[0]
        total += im[n]
        for k in range(3):
            t = tx if k == 0 else ty if k == 1 else tz
            total += t * (ii[n, k, 0] * tx + ii[n, k, 1] * ty + ii[n, k, 2] * tz)
    return 1.0 / total if total > 0.0 else 0.0


@compiled
def _iterate(pairs, contacts, im, ii, velocity, spin, rounds, biased, rate, mass_scale, impulse_scale, h):
    for _ in range(rounds):
        for i in range(len(contacts)):
            c = contacts[i]
            a, b = pairs[i, 0], pairs[i, 1]
            limit = FRICTION * c[22]
            for axis in range(2):
                j = -c[26 + axis] * _relative(c, a, b, velocity, spin, 6 + 3 * axis)
                total = min(limit, max(-limit, c[23 + axis] + j))
                _apply(c, a, b, im, ii, velocity, spin, 6 + 3 * axis, total - c[23 + axis])
                c[23 + axis] = total
            vn = _relative(c, a, b, velocity, spin, 3)
            bias, ms, js = 0.0, 1.0, 0.0
            if c[21] > 0.0:
                bias = c[21] / h
            elif biased:
                bias, ms, js = max(rate * min(0.0, c[21] + 0.0002), -2.0), mass_scale, impulse_scale
            j = -c[25] * ms * (vn + bias) - js * c[22]
            total = max(0.0, c[22] + j)
            _apply(c, a, b, im, ii, velocity, spin, 3, total - c[22])
            c[22] = total


@compiled
def solve(inverse_mass, inverse_inertia, position, rotation, velocity, spin, mode, still, pairs, contacts, dt):
    n = len(mode)
    im = np.zeros(n)
    ii = np.zeros((n, 3, 3))
    touched = np.zeros(n, np.bool_)
    fastest = 0.0
    for a in range(n):
        if mode[a] == 1:
            im[a] = inverse_mass[a]
            r = matrix_from_quaternion(rotation[a])
            for i in range(3):
                for j in range(3):
                    for k in range(3):
                        for m in range(3):
                            ii[a, i, j] += r[i, k] * inverse_inertia[a, k, m] * r[j, m]
        fastest = max(fastest, math.sqrt((velocity[a] * velocity[a]).sum()))
    for i in range(len(contacts)):
        c = contacts[i]
        a, b = pairs[i, 0], pairs[i, 1]
        c[25] = _mass(c, a, b, im, ii, 3)
        c[26] = _mass(c, a, b, im, ii, 6)
        c[27] = _mass(c, a, b, im, ii, 9)
        c[28] = _relative(c, a, b, velocity, spin, 3)
        if c[21] < 0.001:
            touched[a] = True
            if b >= 0:
                touched[b] = True
    substeps = 4 if fastest < 2.0 else 8
    h = dt / substeps
    omega = 2.0 * math.pi * min(30.0, 0.25 / h)
    a1 = 20.0 + h * omega
    a2 = h * omega * a1
    rate, mass_scale, impulse_scale = omega / a1, a2 / (1.0 + a2), 1.0 / (1.0 + a2)
    for _ in range(substeps):
        for a in range(n):
            if mode[a] == 1:
                velocity[a, 1] -= GRAVITY * h
                velocity[a] /= 1.0 + 0.05 * h
                spin[a] /= 1.0 + (3.0 if touched[a] else 0.3) * h  # rolling resists a little
        for i in range(len(contacts)):  # begin where the last substep ended
            c = contacts[i]
            a, b = pairs[i, 0], pairs[i, 1]
            _apply(c, a, b, im, ii, velocity, spin, 3, c[22])
            _apply(c, a, b, im, ii, velocity, spin, 6, c[23])
            _apply(c, a, b, im, ii, velocity, spin, 9, c[24])
        _iterate(pairs, contacts, im, ii, velocity, spin, 6, True, rate, mass_scale, impulse_scale, h)
        for a in range(n):
            if mode[a] == 1:
                _limit(velocity[a], MAX_SPEED)
                _limit(spin[a], MAX_SPIN)
                position[a] += h * velocity[a]
                _turn(rotation[a], spin[a], h)
        for i in range(len(contacts)):
            contacts[i, 21] += h * _relative(contacts[i], pairs[i, 0], pairs[i, 1], velocity, spin, 3)
        _iterate(pairs, contacts, im, ii, velocity, spin, 2, False, rate, mass_scale, impulse_scale, h)
    for i in range(len(contacts)):  # bounce
        c = contacts[i]
        if c[28] < -0.5 and c[22] > 0.0:
            a, b = pairs[i, 0], pairs[i, 1]
            j = -c[25] * (_relative(c, a, b, velocity, spin, 3) + RESTITUTION * c[28])
            if j > 0.0:
                _apply(c, a, b, im, ii, velocity, spin, 3, j)
    for a in range(n):
        if mode[a] != 1:
            continue
        slow = (velocity[a] * velocity[a]).sum() < 4e-4 and (spin[a] * spin[a]).sum() < 0.04
        still[a] = still[a] + 1 if slow and touched[a] else 0
        if still[a] >= STILL_STEPS:
            mode[a] = 2
            velocity[a] = 0.0
            spin[a] = 0.0


@compiled
def _limit(v, most):
    m = math.sqrt((v * v).sum())
    if m > most:
        v *= most / m


@compiled
def _turn(q, spin, h):
    """Turns quaternion q by spin for h seconds, in place."""
    x, y, z, w = q[0], q[1], q[2], q[3]
    sx, sy, sz = 0.5 * h * spin[0], 0.5 * h * spin[1], 0.5 * h * spin[2]
    q[0] += sx * w + sy * z - sz * y
    q[1] += sy * w + sz * x - sx * z
    q[2] += sz * w + sx * y - sy * x
    q[3] -= sx * x + sy * y + sz * z
    q /= math.sqrt((q * q).sum())
