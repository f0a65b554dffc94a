"""Numba kernels of joints: their coordinates, poses on them, and the impulses that keep things on them. float64.

The five directions that a joint locks are solved at once (a 5 x 5 system), so that no iteration is needed to hold one; what acts
along the sixth (limits, spring, brake, detents) moves the thing in that direction alone. After each substep things are put exactly
on their joints. So a joint neither drifts nor adds energy, however coarse the step.

Rows of `joints`: point and frame (3, 3) on the base, the same on the thing, whether it slides; limits; stiffness, damping, target
and greatest force of the drive; then place, reach and force of each detent. `ends`: rows of base and thing; base -1: the room.
"""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.jit.kernel_jit import compiled, inner

SLIDES = 24
LOWER = 25
UPPER = 26
STIFFNESS = 27
DAMPING = 28
TARGET = 29
MOST = 30
DETENTS = 31
JOINT = 43
"""Numbers of one joint."""
LOCKED = 5
"""Directions that a joint locks; row 5 of each matrix below is the direction that is left."""
DRAG = 0.2
"""A detent's damping, as a share of what would be critical for one kilogram."""


@inner
def _base_frame(j, base, position, rotation):
    """Point (3,) and frame (3, 3) of a joint on its base, in the room."""
    p, r = j[0:3].copy(), j[3:12].copy().reshape(3, 3)
    if base < 0:
        return p, r
    turn = matrix_from_quaternion(rotation[base])
    out_p, out_r = position[base].copy(), np.zeros((3, 3))
    for i in range(3):
        for k in range(3):
            out_p[i] += turn[i, k] * p[k]
            for m in range(3):
                out_r[i, m] += turn[i, k] * r[k, m]
    return out_p, out_r


@inner
def _thing_frame(j, position, turn):
    """The same on a thing at `position` (3,) and `turn` (3, 3)."""
    out_p, out_r = position.copy(), np.zeros((3, 3))
    for i in range(3):
        for k in range(3):
            out_p[i] += turn[i, k] * j[12 + k]
            for m in range(3):
                out_r[i, m] += turn[i, k] * j[15 + 3 * k + m]
    return out_p, out_r


@compiled
def coordinate(j, base, thing, position, rotation):
    """The coordinate of a joint [m or rad], of things at `position` (N, 3) and `rotation` (N, 4)."""
    pb, rb = _base_frame(j, base, position, rotation)
    pc, rc = _thing_frame(j, position[thing], matrix_from_quaternion(rotation[thing]))
    if j[SLIDES] > 0.0:
        return rb[0, 0] * (pc[0] - pb[0]) + rb[1, 0] * (pc[1] - pb[1]) + rb[2, 0] * (pc[2] - pb[2])
    sine, cosine = 0.0, 0.0
    for k in range(3):
        cosine += rb[k, 1] * rc[k, 1] + rb[k, 2] * rc[k, 2]
        sine += rb[k, 2] * rc[k, 1] - rb[k, 1] * rc[k, 2]
    return math.atan2(sine, cosine)


@compiled
def put(j, base, thing, at, position, rotation):
    """Puts a thing on its joint at the coordinate `at`: changes its rows of position (N, 3) and rotation (N, 4)."""
    pb, rb = _base_frame(j, base, position, rotation)
    if j[SLIDES] > 0.0:
        for k in range(3):
            pb[k] += at * rb[k, 0]
    else:
        c, s = math.cos(at), math.sin(at)
        for k in range(3):
            y, z = rb[k, 1], rb[k, 2]
            rb[k, 1], rb[k, 2] = c * y + s * z, c * z - s * y
    turn = np.zeros((3, 3))
    for i in range(3):
        for k in range(3):
            for m in range(3):
                turn[i, k] += rb[i, m] * j[15 + 3 * k + m]
    for i in range(3):
        total = pb[i]
        for k in range(3):
            total -= turn[i, k] * j[12 + k]
        position[thing, i] = total
    rotation[thing] = quaternion_from_matrix(turn)


@compiled
def nearest(j, base, place, turn, grip, breadth, position, rotation):
    """The coordinate at which the point `grip` (3,) of a thing is nearest to where it would be at `place` (3,) and `turn` (3, 3),
    and the thing turned as there; a radian counts as `breadth` metres. Limits are not looked at."""
    pb, rb = _base_frame(j, base, position, rotation)
    _, rc = _thing_frame(j, place, turn)
    own, wanted = np.zeros(3), np.zeros(3)  # the grip in the joint's frames of thing and base
    for k in range(3):
        there = place[k] - pb[k]
        for m in range(3):
            there += turn[k, m] * grip[m]
        for m in range(3):
            own[m] += j[15 + 3 * k + m] * (grip[k] - j[12 + k])
            wanted[m] += rb[k, m] * there
    if j[SLIDES] > 0.0:
        return wanted[0] - own[0]
    cosine = wanted[1] * own[1] + wanted[2] * own[2]
    sine = wanted[2] * own[1] - wanted[1] * own[2]
    for k in range(3):
        cosine += breadth * breadth * (rb[k, 1] * rc[k, 1] + rb[k, 2] * rc[k, 2])
        sine += breadth * breadth * (rb[k, 2] * rc[k, 1] - rb[k, 1] * rc[k, 2])
    return math.atan2(sine, cosine)


@compiled
def wake(ends, velocity, spin, mode, still):
    """Things asleep wake where the other end of their joint moves."""
    for k in range(len(ends)):
        b, c = ends[k, 0], ends[k, 1]
        if b < 0:
            continue
        if mode[c] == 2 and (mode[b] == 1 or mode[b] == 3):
            mode[c], still[c] = 1, 0
        elif mode[b] == 2 and mode[c] == 1 and (velocity[c] * velocity[c]).sum() + 0.01 * (spin[c] * spin[c]).sum() > 1e-3:
            mode[b], still[b] = 1, 0


@inner
def prepare(joints, ends, mass, inertia, position, rotation, directions, moved, solution, free):
    """Fills in what a joint is at this instant, for inverse masses (N,) and inertias (N, 3, 3): directions (K, 6, 12) of its
    rows, of speed and spin of base and thing; moved (K, 6, 12): what a unit impulse along each gives them, row 5 with the others
    held; solution (K, 5, 5): the impulses that cancel the motion in the locked directions; free (K,): mass along the joint, 0: it
    is idle.
    """
    for k in range(len(ends)):
        j, b, c = joints[k], ends[k, 0], ends[k, 1]
        free[k] = 0.0
        if mass[c] == 0.0:  # in a hand, or asleep: it is where it is
            continue
        _, rb = _base_frame(j, b, position, rotation)
        pc, _ = _thing_frame(j, position[c], matrix_from_quaternion(rotation[c]))
        slides = j[SLIDES] > 0.0
        d = directions[k]
        d[:] = 0.0
        row = 0
        for axis in range(3):  # what is locked first
            for turning in range(2):
                along = slides == (turning == 0) and axis == 0
                n = LOCKED if along else row
                row += 0 if along else 1
                x, y, z = rb[0, axis], rb[1, axis], rb[2, axis]
                if turning == 1:
                    d[n, 3], d[n, 4], d[n, 5] = -x, -y, -z
                    d[n, 9], d[n, 10], d[n, 11] = x, y, z
                    continue
                d[n, 0], d[n, 1], d[n, 2] = -x, -y, -z
                d[n, 6], d[n, 7], d[n, 8] = x, y, z
                ax, ay, az = pc[0] - position[c, 0], pc[1] - position[c, 1], pc[2] - position[c, 2]
                d[n, 9], d[n, 10], d[n, 11] = ay * z - az * y, az * x - ax * z, ax * y - ay * x
                if b >= 0:
                    ax, ay, az = pc[0] - position[b, 0], pc[1] - position[b, 1], pc[2] - position[b, 2]
                    d[n, 3], d[n, 4], d[n, 5] = az * y - ay * z, ax * z - az * x, ay * x - ax * y
        _move(d, b, c, mass, inertia, moved[k])
        free[k] = _solve(d, moved[k], solution[k])


@inner
def _move(d, b, c, mass, inertia, moved):
    """What unit impulses along the directions d (6, 12) give base and thing."""
    for n in range(LOCKED + 1):
        for turn in range(2):
            body, at = (b, 0) if turn == 0 else (c, 6)
            for i in range(3):
                moved[n, at + i], moved[n, at + 3 + i] = 0.0, 0.0
                if body >= 0 and mass[body] > 0.0:
                    moved[n, at + i] = mass[body] * d[n, at + i]
                    for m in range(3):
                        moved[n, at + 3 + i] += inertia[body, i, m] * d[n, at + 3 + m]


@inner
def _solve(d, moved, solution):
    """Inverts the locked part by Gauss and Jordan, and takes it out of the last row. Gives the mass along that row."""
    a = np.zeros((LOCKED + 1, LOCKED + 1))
    for n in range(LOCKED + 1):
        for m in range(LOCKED + 1):
            for i in range(12):
                a[n, m] += d[n, i] * moved[m, i]
    left = a[:LOCKED, :LOCKED].copy()
    for n in range(LOCKED):
        for m in range(LOCKED):
            solution[n, m] = 1.0 if n == m else 0.0
    for n in range(LOCKED):
        scale = 1.0 / left[n, n]
        for m in range(LOCKED):
            left[n, m] *= scale
            solution[n, m] *= scale
        for o in range(LOCKED):
            share = left[o, n]
            if o != n and share != 0.0:
                for m in range(LOCKED):
                    left[o, m] -= share * left[n, m]
                    solution[o, m] -= share * solution[n, m]
    inverse = a[LOCKED, LOCKED]
    for n in range(LOCKED):
        share = 0.0
        for m in range(LOCKED):
            share += solution[n, m] * a[m, LOCKED]
        inverse -= share * a[n, LOCKED]
        for i in range(12):
            moved[LOCKED, i] -= share * moved[n, i]
    return 1.0 / inverse if inverse > 1e-12 else 0.0


@inner
def _speed(d, b, c, velocity, spin):
    """Speed along a row."""
    out = 0.0
    for i in range(3):
        out += d[6 + i] * velocity[c, i] + d[9 + i] * spin[c, i]
        if b >= 0:
            out += d[i] * velocity[b, i] + d[3 + i] * spin[b, i]
    return out


@inner
def _push(moved, b, c, impulse, mass, velocity, spin):
    for i in range(3):
        velocity[c, i] += impulse * moved[6 + i]
        spin[c, i] += impulse * moved[9 + i]
        if b >= 0 and mass[b] > 0.0:
            velocity[b, i] += impulse * moved[i]
            spin[b, i] += impulse * moved[3 + i]


@inner
def hold(joined, driven, h):
    """One pass over all joints: no motion in their locked directions, none past their limits. joined: joints, ends, coordinates
    (K,), the impulses (K, 5) that drive and detents have given in this substep, inverse masses, velocity, spin, and what
    `prepare` fills in; driven: whether drive and detents act in this pass; h: the substep [s]."""
    joints, ends, at, given, mass, velocity, spin, directions, moved, solution, free = joined
    locked = np.empty(LOCKED)
    for k in range(len(ends)):
        if free[k] == 0.0:
            continue
        b, c, j, d = ends[k, 0], ends[k, 1], joints[k], directions[k]
        for n in range(LOCKED):
            locked[n] = _speed(d[n], b, c, velocity, spin)
        for n in range(LOCKED):
            impulse = 0.0
            for m in range(LOCKED):
                impulse -= solution[k, n, m] * locked[m]
            _push(moved[k, n], b, c, impulse, mass, velocity, spin)
        if driven:
            _spring(
                j[STIFFNESS], j[DAMPING], at[k] - j[TARGET], j[MOST] * h, k, 0, ends, given, mass, velocity, spin, d, moved, free, h
            )
            for n in range((JOINT - DETENTS) // 3):
                place, reach, force = j[DETENTS + 3 * n], j[DETENTS + 3 * n + 1], j[DETENTS + 3 * n + 2]
                if force > 0.0 and abs(at[k] - place) < reach:
                    stiffness = force / reach
                    drag = DRAG * math.sqrt(stiffness * free[k])
                    _spring(
                        stiffness,
                        drag,
                        at[k] - place,
                        2.0 * force * h,
                        k,
                        1 + n,
                        ends,
                        given,
                        mass,
                        velocity,
                        spin,
                        d,
                        moved,
                        free,
                        h,
                    )
        speed = _speed(d[LOCKED], b, c, velocity, spin)
        allowed = min((j[UPPER] - at[k]) / h, max((j[LOWER] - at[k]) / h, speed))
        if allowed != speed:
            _push(moved[k, LOCKED], b, c, (allowed - speed) * free[k], mass, velocity, spin)


@inner
def _spring(stiffness, damping, off, most, k, n, ends, given, mass, velocity, spin, d, moved, free, h):
    """An implicit spring and brake along a joint: it is stable however stiff (Catto, "Soft constraints", 2011)."""
    strength = damping + h * stiffness
    if strength <= 0.0:
        return
    soft = 1.0 / (h * strength)
    speed = _speed(d[LOCKED], ends[k, 0], ends[k, 1], velocity, spin)
    impulse = -(speed + off * stiffness / strength + soft * given[k, n]) / (1.0 / free[k] + soft)
    total = min(most, max(-most, given[k, n] + impulse))
    _push(moved[k, LOCKED], ends[k, 0], ends[k, 1], total - given[k, n], mass, velocity, spin)
    given[k, n] = total


@inner
def speeds(ends, velocity, spin, directions, free, out):
    """(K,) speeds along the joints [m/s or rad/s], of those that are not idle."""
    for k in range(len(ends)):
        if free[k] > 0.0:
            out[k] = _speed(directions[k, LOCKED], ends[k, 0], ends[k, 1], velocity, spin)


@inner
def coordinates(joints, ends, position, rotation, out):
    """(K,) coordinates of all joints."""
    for k in range(len(ends)):
        out[k] = coordinate(joints[k], ends[k, 0], ends[k, 1], position, rotation)


@inner
def settle(joints, ends, at, speed, mass, mode, position, rotation, free, h):
    """Puts things on their joints, h seconds on from the coordinates `at` (K,), which it changes. What that takes is shared with
    a base that can move, by their masses."""
    for k in range(len(ends)):
        j, b, c = joints[k], ends[k, 0], ends[k, 1]
        if free[k] > 0.0:
            at[k] = min(j[UPPER], max(j[LOWER], at[k] + h * speed[k]))
        elif b < 0 or mode[b] == 0 or mode[b] == 2:
            continue  # an idle thing whose base stands still
        before = position[c].copy()
        put(j, b, c, at[k], position, rotation)
        if b >= 0 and mass[b] > 0.0 and mass[c] > 0.0 and not _hangs(ends, b):
            share = mass[b] / (mass[b] + mass[c])
            for i in range(3):
                off = share * (before[i] - position[c, i])
                position[b, i] += off
                position[c, i] += off


@inner
def _hangs(ends, body):
    """Whether a thing hangs on a joint itself: then it stays where that has put it."""
    found = False
    for k in range(len(ends)):
        found = found or ends[k, 1] == body
    return found


@inner
def keep_speeds(ends, speed, mass, velocity, spin, directions, moved, free):
    """Gives things on joints with what stands fast the speed along the joint that they had before they were put there: to turn
    round a hinge costs none."""
    for k in range(len(ends)):
        b, c = ends[k, 0], ends[k, 1]
        if free[k] > 0.0 and (b < 0 or mass[b] == 0.0):
            now = _speed(directions[k, LOCKED], b, c, velocity, spin)
            _push(moved[k, LOCKED], b, c, (speed[k] - now) * free[k], mass, velocity, spin)
