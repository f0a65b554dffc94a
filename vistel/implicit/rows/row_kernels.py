"""Numba building blocks on rows of float32: one row holds one quantity for a block of points.

Small leaf functions over at most four contiguous rows, without branches or wide literals, are what LLVM turns into
full-width SIMD; a test looks for it in the machine code. Blends work on u = d^2, so that quartic and Wyvill need no
square root and no slope is singular on the skeleton.
"""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.implicit.rows.line_kernels import ROW, sphere_row
from vistel.jit.kernel_jit import compiled
from vistel.jit.numbers import FOUR, HALF, ONE, QUARTER, THREE, TWO, ZERO
from vistel.jit.pointers import at

F32 = np.float32
C4_9 = F32(4 / 9)
C11 = F32(11.0)
C6 = F32(6.0)
C22 = F32(2 / 9)

FAST = {"contract", "reassoc", "nsz", "arcp"}
row = compiled(specialised=True, no_cpython_wrapper=True, fastmath=FAST, nogil=True, error_model="numpy")
"""A function that only kernels call, compiled for each literal number among its arguments: a row's length is one."""


@row
def fill(a, n, value):
    """a = value."""
    for i in range(n):
        a[i] = value


@compiled(specialised=True, no_cpython_wrapper=True, fastmath=True, nogil=True)
def extent(a, n):
    """Smallest and largest of a row without NaN."""
    low = high = a[0]
    for i in range(1, n):
        v = a[i]
        low = v if v < low else low
        high = v if v > high else high
    return low, high


@row
def find_cells(x, y, z, cell, realm, side, n):
    """Number of the cell of each point in a box cut into side^3; side^3 for points outside it or not a number."""
    ax, ay, az, bx, by, bz = realm[0], realm[1], realm[2], realm[3], realm[4], realm[5]
    size = F32(side)
    sx, sy, sz = size / (bx - ax), size / (by - ay), size / (bz - az)
    top = size - ONE
    for i in range(n):
        px, py, pz = x[i], y[i], z[i]
        inside = (px >= ax) & (px <= bx) & (py >= ay) & (py <= by) & (pz >= az) & (pz <= bz)
        u, v, w = (px - ax) * sx, (py - ay) * sy, (pz - az) * sz
        u, v, w = (u if inside else ZERO), (v if inside else ZERO), (w if inside else ZERO)
        i0, i1, i2 = np.int32(u if u < top else top), np.int32(v if v < top else top), np.int32(w if w < top else top)
        index = (i0 * np.int32(side) + i1) * np.int32(side) + i2
        cell[i] = index if inside else np.int32(side * side * side)


@row
def add(a, b, n):
    """a += b."""
    for i in range(n):
        a[i] += b[i]


@row
def add_scaled(a, b, s, n):
    """a += s b."""
    for i in range(n):
        a[i] += s * b[i]


@row
def add_product(a, b, c, n):
    """a += b c."""
    for i in range(n):
        a[i] += b[i] * c[i]


@row
def add_positive(a, value, s, n):
    """a += s * max(value, 0)."""
    for i in range(n):
        v = value[i]
        a[i] += s * (v if v > ZERO else ZERO)


@row
def divide(a, b, n):
    """a / b where b > 0, else 0."""
    for i in range(n):
        v = b[i]
        some = v > ZERO
        a[i] = a[i] / (v if some else ONE) if some else ZERO


@row
def offset_slope(g, x, c, s, n):
    """g = s (x - c)."""
    for i in range(n):
        g[i] = s * (x[i] - c)


@row
def axis_slope(g, x, t, c, e, s, n):
    """g = s (x - c - t e)."""
    for i in range(n):
        g[i] = s * (x[i] - c - t[i] * e)


@row
def affine(out, x, y, z, a, b, c, d, n):
    """out = a x + b y + c z + d."""
    for i in range(n):
        out[i] = a * x[i] + b * y[i] + c * z[i] + d


@row
def accumulate_quartic(acc, u, w, n):
    """acc += w (1 - u)^2 below u = 1."""
    for i in range(n):
        q = ONE - u[i]
        q = q if q > ZERO else ZERO
        acc[i] += w * (q * q)


@row
def accumulate_sphere(acc, x, y, z, a, b, c, k, w, n):
    """acc += w (1 - k |P - C|^2)^2 inside the sphere."""
    for i in range(n):
        dx = x[i] - a
        dy = y[i] - b
        dz = z[i] - c
        q = ONE - (dx * dx + dy * dy + dz * dz) * k
        q = q if q > ZERO else ZERO
        acc[i] += w * (q * q)


@row
def accumulate_sphere_rows(acc, x, y, z, a, b, c, k, w, n):
    """The same for points in rows of ROW with one x and y each: rows out of reach are left out."""
    for first in range(0, n, ROW):
        dx = x[first] - a
        dy = y[first] - b
        base = ONE - (dx * dx + dy * dy) * k
        if base > ZERO:
            sphere_row(at(acc, first), at(z, first), base, c, k, w)


@row
def quartic(u, value, rate, w, n):
    """F and dF/du times w of the blend of this name at u = d^2."""
    for i in range(n):
        q = ONE - u[i]
        q = q if q > ZERO else ZERO
        value[i] = w * (q * q)
        rate[i] = -TWO * w * q


@row
def wyvill(u, value, rate, w, n):
    """As `quartic`."""
    for i in range(n):
        v = u[i]
        q = ONE - v
        q = q if q > ZERO else ZERO
        value[i] = w * (q * q) * (ONE - C4_9 * v)
        rate[i] = -w * C22 * q * (C11 - C6 * v)


@row
def hermite(u, value, rate, w, n):
    """As `quartic`."""
    for i in range(n):
        v = u[i]
        v = v if v < ONE else ONE
        x = math.sqrt(v)
        value[i] = w * (ONE - v * (THREE - TWO * x))
        rate[i] = THREE * w * (x - ONE)


@row
def quad2(u, value, rate, w, n):
    """As `quartic`."""
    for i in range(n):
        v = u[i]
        v = v if v < ONE else ONE
        x = math.sqrt(v)
        q = ONE - x
        far = v > QUARTER
        safe = x if far else ONE
        value[i] = w * (TWO * q * q if far else ONE - TWO * v)
        rate[i] = w * (-TWO * q / safe if far else -TWO)


@row
def warp_in(u, s, b, n):
    """u becomes v = y^2 of the Moebius warp y = d / (d + b (1 - d)); s keeps the denominator."""
    for i in range(n):
        v = u[i]
        v = v if v < ONE else ONE
        d = math.sqrt(v)
        k = d + b * (ONE - d)
        s[i] = k
        u[i] = v / (k * k)


@row
def warp_out(rate, s, b, n):
    """df/dv becomes df/du: dv/du = b / s^3."""
    for i in range(n):
        k = s[i]
        rate[i] *= b / (k * k * k)


@row
def blend(code, b, w, u, value, rate, spare, n):
    """value = w f(d) and rate = w df/du for rows of u = d^2; u is used up."""
    if b != ONE:
        warp_in(u, spare, b, n)
    if code == 2:
        quartic(u, value, rate, w, n)
    elif code == 1:
        wyvill(u, value, rate, w, n)
    elif code == 0:
        hermite(u, value, rate, w, n)
    else:
        quad2(u, value, rate, w, n)
    if b != ONE:
        warp_out(rate, spare, b, n)


@row
def blend_one(code, b, d):
    """f(d) and f'(d) at one distance ratio, for kernels that mix blends themselves."""
    x = d if d < ONE else ONE
    s = x + b * (ONE - x)
    y = x / s
    u = y * y
    if code == 2:
        q = ONE - u
        f, df = q * q, -FOUR * y * q
    elif code == 1:
        q = ONE - u
        f, df = q * q * (ONE - C4_9 * u), -C4_9 * y * q * (C11 - C6 * u)
    elif code == 0:
        f, df = ONE - u * (THREE - TWO * y), -C6 * y * (ONE - y)
    elif y <= HALF:
        f, df = ONE - TWO * u, -FOUR * y
    else:
        f, df = TWO * (ONE - y) * (ONE - y), -FOUR * (ONE - y)
    return f, df * b / (s * s)
