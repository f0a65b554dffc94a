"""Leaf kernels of the deformation: fields of primitives along a block's 64 vertex normals.

Everything is float32 and works on flat rows of LANES numbers (one vertex each), row r of an array being
[r * LANES : (r + 1) * LANES]; a kernel passes plain pointers, a test flat arrays. Branches are written as
selections, so that the compiler turns each leaf into straight vector code. Along a vertex's normal, P(s) = P0 + s n, a
cone-sphere needs four numbers per vertex, found once: |P0 - a|^2, (P0 - a).n, (P0 - a).u and n.u.

Row of a cone-sphere: ax ay az, ux uy uz (unit axis), length, influence radius at a, its growth per metre of
axis, weight W. Row of any other primitive: rotation (9, room to own frame), position (3), parameters,
weight last.
"""

# pyright: basic, reportCallIssue=false

from __future__ import annotations

import numpy as np

from vistel.implicit.kernel_jit import fast, leaf
from vistel.implicit.wide import wide

LANES = 64
PATCH = 16
"""Lanes of a patch: a block is four of them, for tighter bounds."""
ROW = 24
"""Numbers per primitive row."""

ZERO, ONE, TWO, FOUR = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(4.0)
HALF, TINY, SMALL = np.float32(0.5), np.float32(1e-12), np.float32(1e-20)
HUGE = np.float32(1e30)
T = np.float32(0.5)



@leaf
def ray(block, p, out):
    """The four numbers of a cone-sphere for each lane. block: (6, 64) P0 and n; p: its row; out: (4, 64)."""
    wide()
    ax, ay, az, ux, uy, uz = p[0], p[1], p[2], p[3], p[4], p[5]
    for i in range(LANES):
        wx, wy, wz = block[i] - ax, block[LANES + i] - ay, block[2 * LANES + i] - az
        nx, ny, nz = block[3 * LANES + i], block[4 * LANES + i], block[5 * LANES + i]
        out[i] = wx * wx + wy * wy + wz * wz
        out[LANES + i] = wx * nx + wy * ny + wz * nz
        out[2 * LANES + i] = wx * ux + wy * uy + wz * uz
        out[3 * LANES + i] = nx * ux + ny * uy + nz * uz


@leaf
def cone(s, c, p, out):
    """F and dF/ds of a cone-sphere (min-ratio form, quartic) at s. s: (LANES,); c: (4, LANES) of `ray`; out: (2,
    LANES).

    With x along the axis, rho the squared distance from it and D = ra + k x, the smallest squared ratio is
    rho / (D^2 + k^2 rho), at x + k rho / D on the axis; beyond an end it is that of the end's ball.
    """
    wide()
    length, ra, k, w = p[6], p[7], p[8], p[9]
    for i in range(LANES):
        t, nu = s[i], c[3 * LANES + i]
        half = c[LANES + i] + t
        x = c[2 * LANES + i] + t * nu
        m = c[i] + t * (half + c[LANES + i])
        rho = max(m - x * x, ZERO)
        a = x + k * rho / max(ra + k * x, TINY)
        a = min(max(a, ZERO), length)
        dx = x - a
        inverse = ONE / (ra + k * a)
        inverse = inverse * inverse
        q = max(ONE - (dx * dx + rho) * inverse, ZERO)
        wq = w * q
        out[i] = wq * q
        out[LANES + i] = -FOUR * wq * (half - a * nu) * inverse


@leaf
def union_add(value, total):
    """Add a primitive to a Ricci union of power 4: total (2, 64) sums F^4 and F^3 dF."""
    wide()
    for i in range(LANES):
        f = value[i]
        f3 = f * f * f
        total[i] += f3 * f
        total[LANES + i] += f3 * value[LANES + i]


@leaf
def union_end(total, out):
    """F and dF/ds of the union from its sums."""
    wide()
    for i in range(LANES):
        t = max(total[i], SMALL)
        half = ONE / np.sqrt(t)
        root = t * half
        quarter = ONE / np.sqrt(root)
        out[i] = root * quarter
        out[LANES + i] = total[LANES + i] * half * quarter


@fast
def local_ray(block, p, out):
    """P0 and n of each lane in a primitive's own frame. p: its row; out: (6, 64)."""
    for i in range(LANES):
        x, y, z = block[i] - p[9], block[LANES + i] - p[10], block[2 * LANES + i] - p[11]
        nx, ny, nz = block[3 * LANES + i], block[4 * LANES + i], block[5 * LANES + i]
        out[i] = p[0] * x + p[1] * y + p[2] * z
        out[LANES + i] = p[3] * x + p[4] * y + p[5] * z
        out[2 * LANES + i] = p[6] * x + p[7] * y + p[8] * z
        out[3 * LANES + i] = p[0] * nx + p[1] * ny + p[2] * nz
        out[4 * LANES + i] = p[3] * nx + p[4] * ny + p[5] * nz
        out[5 * LANES + i] = p[6] * nx + p[7] * ny + p[8] * nz


@fast
def _power(x, e):
    """|x|^e with 0 for x = 0 whatever e (spec_maths §1.3.5)."""
    return abs(x) ** e if abs(x) > TINY else ZERO


@fast
def superellipsoid(s, c, p, out):
    """As `cone`, for a superellipsoid; p[12:17] influence half axes a1, a2, a3, exponents e1, e2; p[17]
    weight."""
    a1, a2, a3, e1, e2, w = p[12], p[13], p[14], p[15], p[16], p[17]
    for i in range(LANES):
        nx, ny, nz = c[3 * LANES + i] / a1, c[4 * LANES + i] / a2, c[5 * LANES + i] / a3
        x, y, z = c[i] / a1 + s[i] * nx, c[LANES + i] / a2 + s[i] * ny, c[2 * LANES + i] / a3 + s[i] * nz
        if max(abs(x), abs(y), abs(z)) >= ONE:
            out[i], out[LANES + i] = ZERO, ZERO
            continue
        inner = _power(x, TWO / e2) + _power(y, TWO / e2)
        h = _power(inner, e2 / e1) + _power(z, TWO / e1)
        d2 = _power(h, e1)
        q = max(ONE - d2, ZERO)
        # d(d^2) = e1 h^(e1 - 1) dh
        bend = _power(inner, e2 / e1 - ONE)
        dh = bend * (_slope(x, e2) * nx + _slope(y, e2) * ny) + _slope(z, e1) * nz
        out[i] = w * q * q
        out[LANES + i] = -TWO * w * q * TWO * _power(h, e1 - ONE) * dh


@fast
def _slope(x, e):
    """(e / 2) d|x|^(2/e)/dx."""
    v = _power(x, TWO / e - ONE)
    return v if x >= ZERO else -v


@fast
def supertoroid(s, c, p, out):
    """As `cone`, for a supertoroid about Z; p[12:18] a1, a2, a3 (surface), alpha, e1, e2; p[18] weight;
    p[19] reach.

    Its ring stays where it is, only the tube grows to the realm: the ratio is that of the tube (spec_maths
    §1.3.6).
    """
    a1, a2, a3, alpha, e1, e2, w, reach = p[12], p[13], p[14], p[15], p[16], p[17], p[18], p[19]
    for i in range(LANES):
        nx, ny, nz = c[3 * LANES + i] / a1, c[4 * LANES + i] / a2, c[5 * LANES + i] / (a3 * reach)
        x, y, z = c[i] / a1 + s[i] * nx, c[LANES + i] / a2 + s[i] * ny, c[2 * LANES + i] / (a3 * reach) + s[i] * nz
        around = _power(x, TWO / e2) + _power(y, TWO / e2)
        v = (_power(around, HALF * e2) - alpha) / reach
        if abs(v) >= ONE or abs(z) >= ONE:
            out[i], out[LANES + i] = ZERO, ZERO
            continue
        h = _power(v, TWO / e1) + _power(z, TWO / e1)
        q = max(ONE - _power(h, e1), ZERO)
        dv = _power(around, HALF * e2 - ONE) * (_slope(x, e2) * nx + _slope(y, e2) * ny) / reach
        dh = _slope(v, e1) * dv + _slope(z, e1) * nz
        out[i] = w * q * q
        out[LANES + i] = -FOUR * w * q * _power(h, e1 - ONE) * dh


@fast
def rounded_polygon(s, c, p, corners, out):
    """As `cone`, for a rounded convex polygon in its plane z = 0; p[12] radius, p[13] weight, p[14] first of
    its p[15] corners, x and y each."""
    inverse, w, first, n = ONE / (p[12] * p[12]), p[13], int(p[14]), int(p[15])
    for i in range(LANES):
        x, y, z = c[i] + s[i] * c[3 * LANES + i], c[LANES + i] + s[i] * c[4 * LANES + i], c[2 * LANES + i] + s[i] * c[5 * LANES + i]
        best, bx, by = HUGE, ZERO, ZERO
        inside = True
        for j in range(first, first + n):
            e = j + 1 if j + 1 < first + n else first
            ex, ey = corners[2 * e] - corners[2 * j], corners[2 * e + 1] - corners[2 * j + 1]
            wx, wy = x - corners[2 * j], y - corners[2 * j + 1]
            if ex * wy - ey * wx < ZERO:
                inside = False
            t = min(max((ex * wx + ey * wy) / max(ex * ex + ey * ey, SMALL), ZERO), ONE)
            dx, dy = wx - t * ex, wy - t * ey
            if dx * dx + dy * dy < best:
                best, bx, by = dx * dx + dy * dy, dx, dy
        if inside:
            bx, by = ZERO, ZERO
        q = max(ONE - (bx * bx + by * by + z * z) * inverse, ZERO)
        out[i] = w * q * q
        out[LANES + i] = -FOUR * w * q * (bx * c[3 * LANES + i] + by * c[4 * LANES + i] + z * c[5 * LANES + i]) * inverse
