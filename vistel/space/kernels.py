"""Numba kernels of the room: posing and weighing things, and moving them. float64.

Rows of `contacts` are those of `collide_kernels`.
"""

# pyright: basic

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
def matrices(quaternions, out):
    """(N, 3, 3) rotations of (N, 4) quaternions."""
    for n in range(len(quaternions)):
        out[n] = matrix_from_quaternion(quaternions[n])


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
