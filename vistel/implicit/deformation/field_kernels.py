"""Leaf kernels of the deformation: fields of primitives along vertex normals.

Everything is float32. Vertices come in blocks of LANES, a block in patches of WIDTH, which is what one `Lanes` value
holds; in memory, row r of a patch's array is [r * WIDTH : (r + 1) * WIDTH]. Branches are written as selections. Along a
vertex's normal, P(s) = P0 + s n, a cone-sphere needs four numbers per vertex, found once: |P0 - a|^2, (P0 - a).n,
(P0 - a).u and n.u.

Row of a cone-sphere: ax ay az, ux uy uz (unit axis), length, influence radius at a, its growth per metre of
axis, weight W. Row of any other primitive: rotation (9, room to own frame), position (3), parameters,
weight last.
"""

# pyright: basic, reportCallIssue=false, reportOperatorIssue=false

from typing import Any, NamedTuple

import numpy as np

from vistel.implicit.constants import THRESHOLD
from vistel.jit.kernel_jit import fast_inner, inlined
from vistel.jit.lanes import choose, inverse_root, least, most, of_width, store
from vistel.jit.numbers import FOUR, HALF, ONE, TWO, ZERO
from vistel.jit.pointers import at

WIDTH = 32
"""Vertices that are worked on at once: a patch."""
load, spread, first_lanes, _ = of_width(WIDTH)
LANES = 64
"""Vertices of a block: for who meets whom."""
PATCHES = LANES // WIDTH
"""Patches of a block, for tighter bounds and for the solver."""
ROW = 24
"""Numbers per primitive row."""
RAY_SIZE = 6 * WIDTH
"""Numbers of a patch's positions and normals, or of a primitive's rays."""

SMALL = np.float32(1e-20)
"""Least divisor among squares and sums of powers."""
TINY = np.float32(1e-12)
"""Least divisor among lengths and zones."""
HUGE = np.float32(1e30)
"""More than any field or deficit."""
T = np.float32(THRESHOLD)


class Normals(NamedTuple):
    """Positions P0 [m] and unit normals n of a patch, Lanes each."""

    x: Any
    y: Any
    z: Any
    nx: Any
    ny: Any
    nz: Any


@inlined
def load_normals(p):
    """A patch's positions and normals, six rows from p on."""
    return Normals(
        load(p), load(at(p, WIDTH)), load(at(p, 2 * WIDTH)), load(at(p, 3 * WIDTH)), load(at(p, 4 * WIDTH)), load(at(p, 5 * WIDTH))
    )


@inlined
def load_field(p):
    """Two rows from p on: F and dF/ds, mostly."""
    return load(p), load(at(p, WIDTH))


@inlined
def store_field(p, f, df):
    """F and dF/ds into two rows from p on."""
    store(p, f)
    store(at(p, WIDTH), df)


@inlined
def ball_ray(v, p):
    """|P0 - a|^2 and (P0 - a).n for each lane of v (`Normals`). p: the row of a cone-sphere."""
    wx, wy, wz = v.x - p[0], v.y - p[1], v.z - p[2]
    return wx * wx + wy * wy + wz * wz, wx * v.nx + wy * v.ny + wz * v.nz


@inlined
def axis_ray(v, p):
    """(P0 - a).u and n.u."""
    ux, uy, uz = p[3], p[4], p[5]
    return (v.x - p[0]) * ux + (v.y - p[1]) * uy + (v.z - p[2]) * uz, v.nx * ux + v.ny * uy + v.nz * uz


@inlined
def ball_along(s, m, b, p):
    """F and dF/ds at s (Lanes) of a cone-sphere without length."""
    inverse, w, half = ONE / (p[7] * p[7]), p[9], b + s
    q = most(ONE - (m + s * (half + b)) * inverse, ZERO)
    return (w * q) * q, (-FOUR * w * inverse) * q * half


@inlined
def cone_along(s, m, b, x0, nu, p):
    """F and dF/ds at s (Lanes) of a cone-sphere (min-ratio form, quartic).

    With x along the axis, rho the squared distance from it and D = ra + k x, the smallest squared ratio is
    rho / (D^2 + k^2 rho), at x + k rho / D on the axis; beyond an end it is that of the end's ball.
    """
    length, ra, k, w = p[6], p[7], p[8], p[9]
    half = b + s
    x = x0 + s * nu
    rho = most(m + s * (half + b) - x * x, ZERO)
    if k == ZERO:  # no division where both radii are one
        a = least(most(x, ZERO), length)
        inverse = spread(ONE / (ra * ra))
    else:
        a = least(most(x + k * rho / most(ra + k * x, TINY), ZERO), length)
        inverse = ONE / (ra + k * a)
        inverse = inverse * inverse
    dx = x - a
    q = most(ONE - (dx * dx + rho) * inverse, ZERO)
    wq = w * q
    return wq * q, -FOUR * wq * (half - a * nu) * inverse


@inlined
def cone(s, c, p):
    """F and dF/ds at s of the cone-sphere whose `ray` was laid down from c on."""
    m, b = load_field(c)
    if p[6] == ZERO:
        return ball_along(s, m, b, p)
    return cone_along(s, m, b, load(at(c, 2 * WIDTH)), load(at(c, 3 * WIDTH)), p)


@inlined
def cone_at_rest(v, p):
    """The same at s = 0 along v (`Normals`)."""
    m, b = ball_ray(v, p)
    if p[6] == ZERO:
        return ball_along(spread(ZERO), m, b, p)
    x, nu = axis_ray(v, p)
    return cone_along(spread(ZERO), m, b, x, nu, p)


@inlined
def ray(v, p, out):
    """Lay down the numbers of a cone-sphere: four rows, of a ball two."""
    m, b = ball_ray(v, p)
    store_field(out, m, b)
    if p[6] != ZERO:
        x, nu = axis_ray(v, p)
        store_field(at(out, 2 * WIDTH), x, nu)


@inlined
def union_add(f, df, total, slope):
    """Add a primitive to a Ricci union of power 4: its sums of F^4 and F^3 dF."""
    f3 = f * f * f
    return total + f3 * f, slope + f3 * df


@inlined
def union_end(total, slope):
    """F and dF/ds of the union from its sums."""
    t = most(total, SMALL)
    half = inverse_root(t)
    quarter = inverse_root(t * half)
    return t * half * quarter, slope * half * quarter


@inlined
def local_ray(v, p, out):
    """P0 and n of each lane of v (`Normals`) in a primitive's own frame, six rows from out on. p: its row."""
    x, y, z = v.x - p[9], v.y - p[10], v.z - p[11]
    for r in range(3):
        a, b, c = p[3 * r], p[3 * r + 1], p[3 * r + 2]
        store(at(out, r * WIDTH), a * x + b * y + c * z)
        store(at(out, (3 + r) * WIDTH), a * v.nx + b * v.ny + c * v.nz)


@fast_inner
def _power(x, e):
    """|x|^e with 0 for x = 0 whatever e (mathematics M1.7)."""
    return abs(x) ** e if abs(x) > TINY else ZERO


@fast_inner
def superellipsoid(s, c, p, out):
    """F and dF/ds of a superellipsoid, two rows, at s, a row; c: its rows of `local_ray`. p[12:17] influence half
    axes a1, a2, a3, exponents e1, e2; p[17] weight."""
    a1, a2, a3, e1, e2, w = p[12], p[13], p[14], p[15], p[16], p[17]
    for i in range(WIDTH):
        nx, ny, nz = c[3 * WIDTH + i] / a1, c[4 * WIDTH + i] / a2, c[5 * WIDTH + i] / a3
        x, y, z = c[i] / a1 + s[i] * nx, c[WIDTH + i] / a2 + s[i] * ny, c[2 * WIDTH + i] / a3 + s[i] * nz
        if max(abs(x), abs(y), abs(z)) >= ONE:
            out[i], out[WIDTH + i] = ZERO, ZERO
            continue
        inner = _power(x, TWO / e2) + _power(y, TWO / e2)
        h = _power(inner, e2 / e1) + _power(z, TWO / e1)
        d2 = _power(h, e1)
        q = max(ONE - d2, ZERO)
        # d(d^2) = e1 h^(e1 - 1) dh
        bend = _power(inner, e2 / e1 - ONE)
        dh = bend * (_slope(x, e2) * nx + _slope(y, e2) * ny) + _slope(z, e1) * nz
        out[i] = w * q * q
        out[WIDTH + i] = -TWO * w * q * TWO * _power(h, e1 - ONE) * dh


@fast_inner
def _slope(x, e):
    """(e / 2) d|x|^(2/e)/dx."""
    v = _power(x, TWO / e - ONE)
    return v if x >= ZERO else -v


@fast_inner
def supertoroid(s, c, p, out):
    """As `cone`, for a supertoroid about Z; p[12:18] a1, a2, a3 (surface), alpha, e1, e2; p[18] weight;
    p[19] reach.

    Its ring stays where it is, only the tube grows to the realm: the ratio is that of the tube (mathematics
    M1.8).
    """
    a1, a2, a3, alpha, e1, e2, w, reach = p[12], p[13], p[14], p[15], p[16], p[17], p[18], p[19]
    for i in range(WIDTH):
        nx, ny, nz = c[3 * WIDTH + i] / a1, c[4 * WIDTH + i] / a2, c[5 * WIDTH + i] / (a3 * reach)
        x, y, z = c[i] / a1 + s[i] * nx, c[WIDTH + i] / a2 + s[i] * ny, c[2 * WIDTH + i] / (a3 * reach) + s[i] * nz
        around = _power(x, TWO / e2) + _power(y, TWO / e2)
        v = (_power(around, HALF * e2) - alpha) / reach
        if abs(v) >= ONE or abs(z) >= ONE:
            out[i], out[WIDTH + i] = ZERO, ZERO
            continue
        h = _power(v, TWO / e1) + _power(z, TWO / e1)
        q = max(ONE - _power(h, e1), ZERO)
        dv = _power(around, HALF * e2 - ONE) * (_slope(x, e2) * nx + _slope(y, e2) * ny) / reach
        dh = _slope(v, e1) * dv + _slope(z, e1) * nz
        out[i] = w * q * q
        out[WIDTH + i] = -FOUR * w * q * _power(h, e1 - ONE) * dh


@inlined
def rounded_polygon(s, c, p, corners):
    """As `cone`, for a rounded convex polygon in its plane z = 0; p[12] radius, p[13] weight, p[14] first of
    its p[15] corners, x and y each."""
    inverse, w, first, n = ONE / (p[12] * p[12]), p[13], np.int64(p[14]), np.int64(p[15])
    v = load_normals(c)
    x, y, z = v.x + s * v.nx, v.y + s * v.ny, v.z + s * v.nz
    best, bx, by = spread(HUGE), spread(ZERO), spread(ZERO)
    outside = x < -HUGE
    for j in range(first, first + n):
        e = j + 1 if j + 1 < first + n else first
        ex, ey = corners[2 * e] - corners[2 * j], corners[2 * e + 1] - corners[2 * j + 1]
        wx, wy = x - corners[2 * j], y - corners[2 * j + 1]
        outside = outside | (ex * wy - ey * wx < ZERO)
        t = least(most((ex * wx + ey * wy) * (ONE / max(ex * ex + ey * ey, SMALL)), ZERO), ONE)
        dx, dy = wx - t * ex, wy - t * ey
        d2 = dx * dx + dy * dy
        closer = d2 < best
        best, bx, by = choose(closer, d2, best), choose(closer, dx, bx), choose(closer, dy, by)
    bx, by = choose(outside, bx, ZERO), choose(outside, by, ZERO)
    q = most(ONE - (bx * bx + by * by + z * z) * inverse, ZERO)
    wq = w * q
    return wq * q, -FOUR * wq * (bx * v.nx + by * v.ny + z * v.nz) * inverse
