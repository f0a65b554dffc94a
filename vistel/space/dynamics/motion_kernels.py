"""Numba kernels of the room: posing and weighing things, and moving them. float64.

Rows of `contacts` are those of `collide_kernels`.
"""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.contacts.contact_kernels import surface
from vistel.jit.kernel_jit import compiled, inner
from vistel.jit.pointers import at, keep, pointer
from vistel.space.dynamics.collide_kernels import WIDTH
from vistel.space.joints.joint_kernels import DETENTS, JOINT, LOCKED, coordinates, hold, keep_speeds, prepare, settle, speeds

GRAVITY = 9.81
FRICTION = 0.5
RESTITUTION = 0.25
STILL_STEPS = 30
"""A thing that has lain still for so many steps falls asleep."""
MAX_SPEED = 8.0
"""No thing moves faster [m/s]."""
MAX_SPIN = 40.0
"""No thing turns faster [rad/s]."""


@compiled
def inertia(kind, start, params, rotation, position, radius, grid):
    """(3, 3) inertia per kilogram about the thing's origin, by sampling its inside."""
    out = np.zeros((3, 3))
    seen, x = np.empty(5), np.empty(3)
    count = 0
    for i in range(grid**3):
        for axis in range(3):
            x[axis] = ((i // grid**axis % grid + 0.5) / grid * 2.0 - 1.0) * radius
        for k in range(len(kind)):
            d = x - position[k]
            r = rotation[k]
            a = r[0, 0] * d[0] + r[1, 0] * d[1] + r[2, 0] * d[2]
            b = r[0, 1] * d[0] + r[1, 1] * d[1] + r[2, 1] * d[2]
            c = r[0, 2] * d[0] + r[1, 2] * d[1] + r[2, 2] * d[2]
            surface(a, b, c, kind[k], params[start[k] : start[k + 1]], seen)
            if seen[0] <= 0.0:
                square = (x * x).sum()
                for j in range(3):
                    for m in range(3):
                        out[j, m] += (square if j == m else 0.0) - x[j] * x[m]
                count += 1
                break
    # A thing thinner than the grid still has some inertia.
    return out / max(1, count) + 0.01 * radius * radius * np.eye(3)


@compiled
def lost(position, rotation, velocity, spin, radius, height):
    """(N,) whether a thing is farther than `radius` from the middle of the room, or than `height` from the floor [m], or has
    numbers that are not finite."""
    out = np.zeros(len(position), np.bool_)
    for n in range(len(position)):
        x, y, z = position[n]
        finite = np.isfinite(rotation[n]).all() and np.isfinite(velocity[n]).all() and np.isfinite(spin[n]).all()
        out[n] = not (finite and math.hypot(x, z) < radius and abs(y) < height)  # no comparison holds for NaN
    return out


@compiled
def changed(position, rotation, velocity, spin, mode, before_p, before_r, before_v, before_s, before_mode, pose, speed):
    """Into `pose` and `speed` (N,): whether each thing's pose or mode is another than before, and its velocity or spin."""
    for n in range(len(mode)):
        pose[n] = mode[n] != before_mode[n] or (position[n] != before_p[n]).any() or (rotation[n] != before_r[n]).any()
        speed[n] = (velocity[n] != before_v[n]).any() or (spin[n] != before_s[n]).any()


@compiled
def pose(owner, local_r, local_p, body_r, body_p, out_r, out_p):
    """Poses of things' primitives in the room: body pose of thing `owner[k]` times the local pose of primitive k, into `out_r`
    (K, 3, 3) and `out_p` (K, 3) [m]."""
    for k in range(len(owner)):
        n = owner[k]
        for i in range(3):
            out_p[k, i] = body_p[n, i]
            for j in range(3):
                out_p[k, i] += body_r[n, i, j] * local_p[k, j]
                out_r[k, i, j] = (
                    body_r[n, i, 0] * local_r[k, 0, j] + body_r[n, i, 1] * local_r[k, 1, j] + body_r[n, i, 2] * local_r[k, 2, j]
                )


@compiled
def matrices(quaternions, out):
    """(N, 3, 3) rotations of (N, 4) quaternions."""
    for n in range(len(quaternions)):
        out[n] = matrix_from_quaternion(quaternions[n])


@compiled
def nearest_rotation(m):
    """The rotation (3, 3) nearest to a matrix of positive determinant: Newton's polar decomposition (Higham 1986), written
    out so that it gives the same bytes on every machine. A matrix that is nearly flat gives the identity's nearest try."""
    x = m / max(1e-12, math.sqrt((m * m).sum()))
    new = np.empty((3, 3))
    for _ in range(40):
        for i in range(3):
            a, b = x[(i + 1) % 3], x[(i + 2) % 3]
            for k in range(3):
                p, q = (k + 1) % 3, (k + 2) % 3
                new[i, k] = a[p] * b[q] - a[q] * b[p]
        det = x[0, 0] * new[0, 0] + x[0, 1] * new[0, 1] + x[0, 2] * new[0, 2]
        if det < 1e-9:
            return np.eye(3)
        most = 0.0
        for i in range(3):
            for k in range(3):
                better = 0.5 * (x[i, k] + new[i, k] / det)
                most = max(most, abs(better - x[i, k]))
                x[i, k] = better
        if most < 1e-12:
            break
    return x


@inner
def _relative(c, a, b, velocity, spin, axis):
    """Velocity of a against b at the contact, along c[axis : axis + 3]. Pointers, but for a, b and axis."""
    v, w = at(velocity, 3 * a), at(spin, 3 * a)
    ax = v[0] + w[1] * c[14] - w[2] * c[13]
    ay = v[1] + w[2] * c[12] - w[0] * c[14]
    az = v[2] + w[0] * c[13] - w[1] * c[12]
    if b >= 0:
        v, w = at(velocity, 3 * b), at(spin, 3 * b)
        ax -= v[0] + w[1] * c[17] - w[2] * c[16]
        ay -= v[1] + w[2] * c[15] - w[0] * c[17]
        az -= v[2] + w[0] * c[16] - w[1] * c[15]
    else:
        ax, ay, az = ax - c[18], ay - c[19], az - c[20]
    return ax * c[axis] + ay * c[axis + 1] + az * c[axis + 2]


@inner
def _push(c, turned, a, b, im, velocity, spin, axis, j):
    """An impulse of j newton seconds along axis 0, 1 or 2 (the normal, two tangents) on a, and its opposite on b.

    turned: (2, 3, 3) spin that a unit impulse gives a and b, by axis.
    """
    d = at(c, 3 + 3 * axis)
    for turn in range(2):
        n = a if turn == 0 else b
        if n < 0 or im[n] == 0.0:
            continue
        s = j if turn == 0 else -j
        v, w, t = at(velocity, 3 * n), at(spin, 3 * n), at(turned, 9 * turn + 3 * axis)
        for k in range(3):
            v[k] += s * im[n] * d[k]
            w[k] += s * t[k]


@inner
def _prepare(c, turned, a, b, im, ii, axis):
    """Fills `turned` for an axis; returns the effective mass of the two along it."""
    d = at(c, 3 + 3 * axis)
    total = 0.0
    for turn in range(2):
        n = a if turn == 0 else b
        if n < 0 or im[n] == 0.0:
            continue
        r = at(c, 12 if turn == 0 else 15)
        tx = r[1] * d[2] - r[2] * d[1]
        ty = r[2] * d[0] - r[0] * d[2]
        tz = r[0] * d[1] - r[1] * d[0]
        out, inverse = at(turned, 9 * turn + 3 * axis), at(ii, 9 * n)
        total += im[n]
        for k in range(3):
            out[k] = inverse[3 * k] * tx + inverse[3 * k + 1] * ty + inverse[3 * k + 2] * tz
            total += (tx if k == 0 else ty if k == 1 else tz) * out[k]
    return 1.0 / total if total > 0.0 else 0.0


@inner
def _iterate(pairs, contacts, turns, im, velocity, spin, rounds, biased, rate, mass_scale, impulse_scale, h, joined):
    """Impulses at all contacts, one after the other, then at all joints, some times. Pointers: turns, im, velocity, spin. joined:
    what `joint_kernels.hold` takes."""
    for _ in range(rounds):
        for i in range(len(contacts)):
            c, turned = at(pointer(contacts), WIDTH * i), at(turns, 18 * i)
            a, b = pairs[i, 0], pairs[i, 1]
            limit = FRICTION * c[22]
            for axis in range(2):
                j = -c[26 + axis] * _relative(c, a, b, velocity, spin, 6 + 3 * axis)
                total = min(limit, max(-limit, c[23 + axis] + j))
                _push(c, turned, a, b, im, velocity, spin, 1 + axis, total - c[23 + axis])
                c[23 + axis] = total
            vn = _relative(c, a, b, velocity, spin, 3)
            bias, ms, js = 0.0, 1.0, 0.0
            if c[21] > 0.0:
                bias = c[21] / h
            elif biased:
                bias, ms, js = max(rate * min(0.0, c[21] + 0.0002), -2.0), mass_scale, impulse_scale
            j = -c[25] * ms * (vn + bias) - js * c[22]
            total = max(0.0, c[22] + j)
            _push(c, turned, a, b, im, velocity, spin, 0, total - c[22])
            c[22] = total
        if len(joined[1]) > 0:
            hold(joined, biased, h)


@inner
def _weigh(free, inverse_inertia, rotation, out):
    """Inverse inertias of the free things in the room, (N, 3, 3)."""
    for a in free:
        r = matrix_from_quaternion(rotation[a])
        for i in range(3):
            for j in range(3):
                total = 0.0
                for k in range(3):
                    for m in range(3):
                        total += r[i, k] * inverse_inertia[a, k, m] * r[j, m]
                out[a, i, j] = total


@compiled
def solve(inverse_mass, inverse_inertia, position, rotation, velocity, spin, mode, still, pairs, contacts, joints, ends, dt):
    """Move every free thing by one step of `dt` [s]: velocities by impulses at the contacts (soft contacts in small steps) and
    joints, then poses. Changes position (N, 3) [m], rotation (N, 4), velocity [m/s] and spin [rad/s] in place."""
    n = len(mode)
    free = np.flatnonzero(mode == 1)
    inverse_masses, inertias, turned = np.zeros(n), np.empty((n, 3, 3)), np.empty((len(contacts), 2, 3, 3))
    touched = np.zeros(n, np.bool_)
    x, q, v, w = pointer(position), pointer(rotation), pointer(velocity), pointer(spin)
    im, ii, turns = pointer(inverse_masses), pointer(inertias), pointer(turned)
    for a in free:
        im[a] = inverse_mass[a]
    _weigh(free, inverse_inertia, rotation, inertias)
    k = len(ends)
    directions, moved = np.empty((k, LOCKED + 1, 12)), np.empty((k, LOCKED + 1, 12))
    solution, free_mass = np.empty((k, LOCKED, LOCKED)), np.zeros(k)
    coordinate, along, given = np.empty(k), np.zeros(k), np.empty((k, 1 + (JOINT - DETENTS) // 3))
    joined = joints, ends, coordinate, given, inverse_masses, velocity, spin, directions, moved, solution, free_mass
    coordinates(joints, ends, position, rotation, coordinate)
    fastest = 0.0
    for a in range(n):
        fastest = max(fastest, _length(at(v, 3 * a)))
    for i in range(len(contacts)):
        c, a, b = at(pointer(contacts), WIDTH * i), pairs[i, 0], pairs[i, 1]
        for axis in range(3):
            c[25 + axis] = _prepare(c, at(turns, 18 * i), a, b, im, ii, axis)
        c[28] = _relative(c, a, b, v, w, 3)
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
        for a in free:
            v[3 * a + 1] -= GRAVITY * h
            rolls = 1.0 + (3.0 if touched[a] else 0.3) * h  # rolling resists a little
            for i in range(3 * a, 3 * a + 3):
                v[i] /= 1.0 + 0.05 * h
                w[i] /= rolls
        if k > 0:
            prepare(joints, ends, inverse_masses, inertias, position, rotation, directions, moved, solution, free_mass)
            given[:] = 0.0
        for i in range(len(contacts)):  # begin where the last substep ended
            c, a, b = at(pointer(contacts), WIDTH * i), pairs[i, 0], pairs[i, 1]
            for axis in range(3):
                _push(c, at(turns, 18 * i), a, b, im, v, w, axis, c[22 + axis])
        _iterate(pairs, contacts, turns, im, v, w, 6, True, rate, mass_scale, impulse_scale, h, joined)
        for a in free:
            _limit(at(v, 3 * a), MAX_SPEED)
            _limit(at(w, 3 * a), MAX_SPIN)
        if k > 0:
            speeds(ends, velocity, spin, directions, free_mass, along)
        for a in free:
            for i in range(3 * a, 3 * a + 3):
                x[i] += h * v[i]
            _turn(at(q, 4 * a), at(w, 3 * a), h)
        if k > 0:
            settle(joints, ends, coordinate, along, inverse_masses, mode, position, rotation, free_mass, h)
            _weigh(free, inverse_inertia, rotation, inertias)
            prepare(joints, ends, inverse_masses, inertias, position, rotation, directions, moved, solution, free_mass)
            keep_speeds(ends, along, inverse_masses, velocity, spin, directions, moved, free_mass)
        for i in range(len(contacts)):
            contacts[i, 21] += h * _relative(at(pointer(contacts), WIDTH * i), pairs[i, 0], pairs[i, 1], v, w, 3)
        _iterate(pairs, contacts, turns, im, v, w, 2, False, rate, mass_scale, impulse_scale, h, joined)
    for i in range(len(contacts)):  # bounce
        c, a, b = at(pointer(contacts), WIDTH * i), pairs[i, 0], pairs[i, 1]
        if c[28] < -0.5 and c[22] > 0.0:
            j = -c[25] * (_relative(c, a, b, v, w, 3) + RESTITUTION * c[28])
            if j > 0.0:
                _push(c, at(turns, 18 * i), a, b, im, v, w, 0, j)
    if k > 0:
        hold(joined, False, h)
        for i in range(k):
            touched[ends[i, 1]] = True  # it may rest on its joint
    for a in free:
        slow = (velocity[a] * velocity[a]).sum() < 4e-4 and (spin[a] * spin[a]).sum() < 0.04
        still[a] = still[a] + 1 if slow and touched[a] else 0
        if still[a] >= STILL_STEPS:
            mode[a] = 2
            velocity[a] = 0.0
            spin[a] = 0.0
    keep(inverse_masses, inertias, turned)


@inner
def _length(v):
    return math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


@inner
def _limit(v, most):
    m = _length(v)
    if m > most:
        for k in range(3):
            v[k] *= most / m


@inner
def _turn(q, spin, h):
    """Turns quaternion q by spin for h seconds, in place."""
    x, y, z, w = q[0], q[1], q[2], q[3]
    sx, sy, sz = 0.5 * h * spin[0], 0.5 * h * spin[1], 0.5 * h * spin[2]
    q[0] += sx * w + sy * z - sz * y
    q[1] += sy * w + sz * x - sx * z
    q[2] += sz * w + sx * y - sy * x
    q[3] -= sx * x + sy * y + sz * z
    m = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for k in range(4):
        q[k] /= m
