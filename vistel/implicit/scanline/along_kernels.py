"""Primitives along the rays of sixteen neighbouring pixels of a row (Singh §3.3.3, mathematics M10.1).

A ray is A + s E in eye space, relative to a fixed point, with A_z = 0 and E_z = 1: s is depth. Along it a primitive
is q(s) = 1 - d^2, so that its field is w max(q, 0)^2 with the quartic; q rises to one summit and falls after it. What
depends on the ray alone is found once (`prepare`), then q, its slope and its summit cost a few operations.

Row of a primitive, float32 (all of eye space, relative to that fixed point):

| at | holds |
|---|---|
| KIND, WEIGHT, NEAR | kind of shape; w; least s of the realm |
| FRAMED | 1 where rays are first taken to a frame of its own |
| A | centre; start of the axis; origin of the polygon |
| U | axis: of a sphylinder the whole vector, of a cone-sphere its direction |
| K | 1 / r^2 of sphere, sphylinder and polygon; radius at the start of a cone-sphere |
| L | r^2 / 2 of a sphere (HALF_SQUARE); 1 / length^2 of a sphylinder; length of a cone-sphere; first corner of a polygon |
| M | length^2 / r^2 of a sphylinder; growth of a cone-sphere's radius; number of corners |
| FRAME | nine numbers of the map into the own frame, row by row |

Polygon corners are pairs of float32 in the own frame, anticlockwise.
"""

# pyright: basic, reportCallIssue=false

from collections.abc import Callable
from typing import Any

import numpy as np

from vistel.implicit.scanline.lanes_kernels import WIDTH, first_lanes, load, spread
from vistel.jit.kernel_jit import compiled
from vistel.jit.lanes import bits, choose, least, most, store
from vistel.jit.numbers import HALF, ONE, TWO, ZERO
from vistel.jit.pointers import at

ROW = 24
# Columns of a row: A is the first of a place's three.
KIND = 0
WEIGHT = 1
NEAR = 2
FRAMED = 3
A = 4
U = 7
"""First of three columns: the unit direction of the axis."""
K = 10
L = 11
M = 12
FRAME = 13
"""First of the frame's columns."""
HALF_SQUARE = L
# Kinds, as in `kinds.KINDS`.
SPHERE = 0
SPHYLINDER = 1
CONE = 2
POLYGON = 3
TERMS = 12 * WIDTH
"""Floats kept for one primitive: six lanes of the ray's numbers, then its summit and its q there; q and its slope at
either end of the interval that is being searched."""
SUMMIT = 6 * WIDTH
PEAK = 7 * WIDTH
LOW_Q = 8 * WIDTH
LOW_SLOPE = 9 * WIDTH
HIGH_Q = 10 * WIDTH
HIGH_SLOPE = 11 * WIDTH

F = np.float32
TINY = F(1e-20)
"""Least divisor."""
LARGE = F(1e30)
"""Farther than any surface [m]."""


def scan_inner(function: Callable[..., Any]) -> Any:
    """A function that kernels call."""
    return compiled(no_cpython_wrapper=True, nogil=True, error_model="numpy", fastmath={"contract"})(function)


@scan_inner
def _clamp(x, low, high):
    return most(least(x, high), low)


@scan_inner
def _own(p, ax, ay, ex, ey):
    """Rays from a primitive's own origin, in its own frame if it has one: six lanes."""
    fx, fy, fz = ax - p[A], spread(ay - p[A + 1]), spread(-p[A + 2])
    gx, gy, gz = ex, spread(ey), spread(ONE)
    if p[FRAMED] != ZERO:
        m = at(p, FRAME)
        hx, hy, hz = m[0] * fx + m[1] * fy + m[2] * fz, m[3] * fx + m[4] * fy + m[5] * fz, m[6] * fx + m[7] * fy + m[8] * fz
        kx, ky, kz = m[0] * gx + m[1] * gy + m[2] * gz, m[3] * gx + m[4] * gy + m[5] * gz, m[6] * gx + m[7] * gy + m[8] * gz
        return hx, hy, hz, kx, ky, kz
    return fx, fy, fz, gx, gy, gz


@scan_inner
def prepare(p, ax, ay, ex, ey, e2, t):
    """The terms of a primitive for sixteen rays, into t; whether any of them may come into its reach.

    ax, ex: lanes; ay, ey: float32; e2: lanes of |E|^2. Spheres out of a ray's reach are made to vanish from it.
    """
    kind = p[KIND]
    if kind == SPHERE and p[FRAMED] == ZERO:
        fx, fy, fz, k = ax - p[A], ay - p[A + 1], -p[A + 2], p[K]
        a = ONE - k * (fx * fx + (fy * fy + fz * fz))
        b = (-TWO * k) * (ex * fx + (ey * fy + fz))
        c = -k * e2
        reached = b * b - F(4.0) * a * c > ZERO
        store(t, choose(reached, a, -ONE))
        store(at(t, WIDTH), choose(reached, b, ZERO))
        store(at(t, 2 * WIDTH), choose(reached, c, ZERO))
        return bits(reached) != 0
    fx, fy, fz, gx, gy, gz = _own(p, ax, ay, ex, ey)
    if kind == POLYGON:
        for k, lane in enumerate((fx, fy, fz, gx, gy, gz)):
            store(at(t, k * WIDTH), lane)
        return True
    m0, m1, m2 = fx * fx + fy * fy + fz * fz, fx * gx + fy * gy + fz * gz, gx * gx + gy * gy + gz * gz
    if kind == CONE:
        store(t, m0)
        store(at(t, WIDTH), m1)
        store(at(t, 2 * WIDTH), m2)
        store(at(t, 3 * WIDTH), fx * p[U] + fy * p[U + 1] + fz * p[U + 2])
        store(at(t, 4 * WIDTH), gx * p[U] + gy * p[U + 1] + gz * p[U + 2])
        return True
    k = p[K]
    store(t, ONE - k * m0)
    store(at(t, WIDTH), (-TWO * k) * m1)
    store(at(t, 2 * WIDTH), -k * m2)
    if kind == SPHYLINDER:
        store(at(t, 3 * WIDTH), p[L] * (fx * p[U] + fy * p[U + 1] + fz * p[U + 2]))
        store(at(t, 4 * WIDTH), p[L] * (gx * p[U] + gy * p[U + 1] + gz * p[U + 2]))
    return True


@scan_inner
def _cone_at(p, m0, m1, m2, x0, x1, s):
    """Foot on a cone-sphere's axis, and 1 / r^2 there."""
    x, rho = x0 + s * x1, m0 + s * (TWO * m1 + s * m2)
    rho = most(rho - x * x, ZERO)
    radius = p[K] + p[M] * x
    foot = x + p[M] * rho / most(radius, TINY)
    foot = _clamp(choose(radius > ZERO, foot, p[L] if p[M] > ZERO else ZERO), ZERO, p[L])
    radius = p[K] + p[M] * foot
    return foot, rho + (x - foot) * (x - foot), ONE / (radius * radius)


@scan_inner
def _polygon_at(p, corners, x, y):
    """Offset of points (x, y) from the closest points of a convex polygon, 0 inside it."""
    first, count = int(p[L]), int(p[M])
    best, dx, dy = spread(LARGE), spread(ZERO), spread(ZERO)
    outside = first_lanes(0)
    bx, by = corners[2 * (first + count - 1)], corners[2 * (first + count - 1) + 1]
    for j in range(first, first + count):
        cx, cy = corners[2 * j], corners[2 * j + 1]
        ux, uy = cx - bx, cy - by
        wx, wy = x - bx, y - by
        h = _clamp((ux * wx + uy * wy) * (ONE / (ux * ux + uy * uy)), ZERO, ONE)
        outside = outside | (ux * wy - uy * wx < ZERO)
        wx, wy = wx - h * ux, wy - h * uy
        d2 = wx * wx + wy * wy
        nearer = d2 < best
        best, dx, dy = choose(nearer, d2, best), choose(nearer, wx, dx), choose(nearer, wy, dy)
        bx, by = cx, cy
    return choose(outside, dx, ZERO), choose(outside, dy, ZERO)


@scan_inner
def along(p, corners, t, s):
    """q and dq/ds at s."""
    kind = p[KIND]
    if kind == SPHERE:
        sc = s * load(at(t, 2 * WIDTH))
        b = load(at(t, WIDTH))
        return load(t) + s * (b + sc), b + (sc + sc)
    if kind == SPHYLINDER:
        sc = s * load(at(t, 2 * WIDTH))
        b, f1 = load(at(t, WIDTH)), load(at(t, 4 * WIDTH))
        foot = load(at(t, 3 * WIDTH)) + s * f1
        h = p[M] * _clamp(foot, ZERO, ONE)
        over = foot + foot - _clamp(foot, ZERO, ONE)
        return load(t) + s * (b + sc) + h * over, b + (sc + sc) + TWO * f1 * h
    if kind == CONE:
        m1, m2, x1 = load(at(t, WIDTH)), load(at(t, 2 * WIDTH)), load(at(t, 4 * WIDTH))
        foot, d2, over = _cone_at(p, load(t), m1, m2, load(at(t, 3 * WIDTH)), x1, s)
        return ONE - d2 * over, -TWO * (m1 + s * m2 - foot * x1) * over
    gx, gy, gz = load(at(t, 3 * WIDTH)), load(at(t, 4 * WIDTH)), load(at(t, 5 * WIDTH))
    z = load(at(t, 2 * WIDTH)) + s * gz
    dx, dy = _polygon_at(p, corners, load(t) + s * gx, load(at(t, WIDTH)) + s * gy)
    return ONE - p[K] * (dx * dx + dy * dy + z * z), (-TWO * p[K]) * (dx * gx + dy * gy + z * gz)


@scan_inner
def _segment_summit(a, b, c, f0, f1, m):
    """Summit of a sphylinder's q: of the infinite cylinder, its foot clamped, then along the ray for that foot."""
    s = (b + TWO * m * f0 * f1) / most(F(-2.0) * (c + m * f1 * f1), TINY)
    h = _clamp(f0 + s * f1, ZERO, ONE)
    s = (b + TWO * m * f1 * h) / (F(-2.0) * c)
    foot = f0 + s * f1
    return s, a + s * (b + s * c) + m * h * (foot + foot - h)


@scan_inner
def _better(found, s, q):
    """The higher of two summits."""
    higher = q > found[1]
    return choose(higher, s, found[0]), choose(higher, q, found[1])


@scan_inner
def summit(p, corners, t, over_e2):
    """Where q is highest along each ray, and how high; also kept in the terms. over_e2: 1 / |E|^2."""
    kind = p[KIND]
    if kind == SPHERE and p[FRAMED] == ZERO:
        a, b = load(t), load(at(t, WIDTH))
        s = b * (p[HALF_SQUARE] * over_e2)
        q = a + HALF * s * b
        s = choose(q > ZERO, s, LARGE)
    elif kind == SPHERE:
        a, b, c = load(t), load(at(t, WIDTH)), load(at(t, 2 * WIDTH))
        s = choose(c < ZERO, b / (F(-2.0) * c), LARGE)
        q = choose(c < ZERO, a + HALF * s * b, -ONE)
    elif kind == SPHYLINDER:
        m0, m1, m2 = load(t), load(at(t, WIDTH)), load(at(t, 2 * WIDTH))
        s, q = _segment_summit(m0, m1, m2, load(at(t, 3 * WIDTH)), load(at(t, 4 * WIDTH)), p[M])
    elif kind == CONE:
        m0, m1, m2 = load(t), load(at(t, WIDTH)), load(at(t, 2 * WIDTH))
        x0, x1 = load(at(t, 3 * WIDTH)), load(at(t, 4 * WIDTH))
        d0, d1 = p[K] + p[M] * x0, p[M] * x1
        r0, r1, r2 = m0 - x0 * x0, m1 - x0 * x1, m2 - x1 * x1
        # rho / (r + k x)^2 is stationary where this linear function of s vanishes.
        under = r2 * d0 - r1 * d1
        s = (r0 * d1 - r1 * d0) / choose(under > TINY, under, TINY)
        foot, d2, over = _cone_at(p, m0, m1, m2, x0, x1, s)
        found = spread(ZERO), spread(-LARGE)
        for k in range(3):
            c = foot if k == 0 else spread(p[L] if k == 1 else ZERO)
            s = (c * x1 - m1) / m2
            _again, d2, over = _cone_at(p, m0, m1, m2, x0, x1, s)
            found = _better(found, s, ONE - d2 * over)
        s, q = found
    else:
        fx, fy, fz = load(t), load(at(t, WIDTH)), load(at(t, 2 * WIDTH))
        gx, gy, gz = load(at(t, 3 * WIDTH)), load(at(t, 4 * WIDTH)), load(at(t, 5 * WIDTH))
        first, count, k = int(p[L]), int(p[M]), p[K]
        slant = gz * gz > TINY
        s = -fz / choose(slant, gz, ONE)
        dx, dy = _polygon_at(p, corners, fx + s * gx, fy + s * gy)
        pierced = slant & (dx * dx + dy * dy <= ZERO)
        found = choose(pierced, s, ZERO), choose(pierced, ONE, -LARGE)
        m2 = gx * gx + gy * gy + gz * gz
        for j in range(first, first + count):
            i = j + 1 if j + 1 < first + count else first
            bx, by = corners[2 * j], corners[2 * j + 1]
            ux, uy = corners[2 * i] - bx, corners[2 * i + 1] - by
            l2 = ux * ux + uy * uy
            wx, wy = fx - bx, fy - by
            s, q = _segment_summit(
                ONE - k * (wx * wx + wy * wy + fz * fz),
                (-TWO * k) * (wx * gx + wy * gy + fz * gz),
                -k * m2,
                (wx * ux + wy * uy) * (ONE / l2),
                (gx * ux + gy * uy) * (ONE / l2),
                k * l2,
            )
            found = _better(found, s, q)
        s, q = found
    store(at(t, SUMMIT), s)
    store(at(t, PEAK), q)
    return s, q


@scan_inner
def gradient(p, corners, t, ax, ay, ex, ey, s):
    """q and its gradient in eye space at s."""
    kind = p[KIND]
    if kind == SPHERE and p[FRAMED] == ZERO:
        scale = -TWO * p[K]
        px, py, pz = ax + s * ex, ay + s * ey, s
        q = load(t) + s * (load(at(t, WIDTH)) + s * load(at(t, 2 * WIDTH)))
        return q, scale * (px - p[A]), scale * (py - p[A + 1]), scale * (pz - p[A + 2])
    fx, fy, fz, gx, gy, gz = _own(p, ax, ay, ex, ey)
    x, y, z = fx + s * gx, fy + s * gy, fz + s * gz
    if kind == POLYGON:
        x, y = _polygon_at(p, corners, x, y)
        over = spread(p[K])
    elif kind == CONE:
        foot, _d2, over = _cone_at(
            p, load(t), load(at(t, WIDTH)), load(at(t, 2 * WIDTH)), load(at(t, 3 * WIDTH)), load(at(t, 4 * WIDTH)), s
        )
        x, y, z = x - foot * p[U], y - foot * p[U + 1], z - foot * p[U + 2]
    else:
        over = spread(p[K])
        if kind == SPHYLINDER:
            h = _clamp(load(at(t, 3 * WIDTH)) + s * load(at(t, 4 * WIDTH)), ZERO, ONE)
            x, y, z = x - h * p[U], y - h * p[U + 1], z - h * p[U + 2]
    q = ONE - over * (x * x + y * y + z * z)
    over = -TWO * over
    x, y, z = over * x, over * y, over * z
    if p[FRAMED] != ZERO:
        m = at(p, FRAME)
        return q, m[0] * x + m[3] * y + m[6] * z, m[1] * x + m[4] * y + m[7] * z, m[2] * x + m[5] * y + m[8] * z
    return q, x, y, z
