"""Signed distances to the primitives of things, as kernels over plain numbers.

Exact for spheres, cone-spheres, rounded polygons and round tori; of first order, (d - 1) / |grad d| with d the
distance ratio to the surface, for superquadrics (spec_maths §1.3). Negative inside.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

# Distance ratio of the surface within the field's influence: f(RATIO) = 1/2 for the quartic blend (1 - x^2)^2.
SURFACE_RATIO = 0.5411961001461970


@nb.njit(cache=True)
def field_of_ratio(ratio: float) -> float:
    """Quartic field of one primitive where its distance ratio to the *surface* is `ratio` (1: field 1/2)."""
    x = SURFACE_RATIO * ratio
    if x >= 1.0:
        return 0.0
    return (1.0 - x * x) * (1.0 - x * x)


@nb.njit(cache=True)
def signed_distance(kind: int, q: F64, x: float, y: float, z: float, out: F64) -> float:
    """Metres from the surface of one primitive to the point (x, y, z) in its frame; negative inside.

    `kind` and `q` are the primitive's (vistel.space.things). Fills out[0:3] with the unit normal (away from the
    primitive) and out[3] with the distance ratio to the surface (1 on it, 0 on the skeleton).
    """
    if kind == 0:
        r = math.sqrt(x * x + y * y + z * z)
        _unit(x, y, z, r, out)
        out[3] = r / q[0]
        return r - q[0]
    if kind == 1:
        return _cone_sphere(q, x, y, z, out)
    if kind == 2:
        return _rounded_polygon(q, x, y, z, out)
    if kind == 3:
        return _superellipsoid(q, x, y, z, out)
    return _supertoroid(q, x, y, z, out)


@nb.njit(cache=True)
def _unit(x: float, y: float, z: float, length: float, out: F64) -> None:
    if length < 1e-12:
        out[0], out[1], out[2] = 0.0, 1.0, 0.0
    else:
        out[0], out[1], out[2] = x / length, y / length, z / length


@nb.njit(cache=True)
def _cone_sphere(q: F64, x: float, y: float, z: float, out: F64) -> float:
    ux, uy, uz = q[3] - q[0], q[4] - q[1], q[5] - q[2]
    px, py, pz = x - q[0], y - q[1], z - q[2]
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    grow = q[7] - q[6]
    if abs(grow) >= length:  # one ball holds the other
        s = 1.0 if grow > 0.0 else 0.0
    else:
        k = grow / length
        along = (px * ux + py * uy + pz * uz) / length
        aside = math.sqrt(max(0.0, px * px + py * py + pz * pz - along * along))
        s = min(1.0, max(0.0, (along + k * aside / math.sqrt(1.0 - k * k)) / length))
    dx, dy, dz = px - s * ux, py - s * uy, pz - s * uz
    radius = q[6] + s * grow
    r = math.sqrt(dx * dx + dy * dy + dz * dz)
    _unit(dx, dy, dz, r, out)
    out[3] = r / radius
    return r - radius


@nb.njit(cache=True)
def _rounded_polygon(q: F64, x: float, y: float, z: float, out: F64) -> float:
    """q: r, number of vertices, then the vertices; convex and planar."""
    n = int(q[1])
    p = np.array([x, y, z])
    first = q[2:5]
    normal = np.zeros(3)
    for i in range(1, n - 1):  # Newell's sum: right for any winding, no vertex is special
        e, f = q[2 + 3 * i : 5 + 3 * i] - first, q[5 + 3 * i : 8 + 3 * i] - first
        normal += np.array([e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]])
    normal /= math.sqrt((normal * normal).sum())
    height = ((p - first) * normal).sum()
    inside, best = True, 1e300
    closest = p - height * normal
    nearest = closest
    for i in range(n):
        a = q[2 + 3 * i : 5 + 3 * i]
        j = (i + 1) % n
        e = q[2 + 3 * j : 5 + 3 * j] - a
        w = closest - a
        side = (normal[1] * e[2] - normal[2] * e[1]) * w[0]
        side += (normal[2] * e[0] - normal[0] * e[2]) * w[1] + (normal[0] * e[1] - normal[1] * e[0]) * w[2]
        if side < 0.0:
            inside = False
        t = min(1.0, max(0.0, (w * e).sum() / (e * e).sum()))
        gap = w - t * e
        if (gap * gap).sum() < best:
            best, nearest = (gap * gap).sum(), a + t * e
    if not inside:
        closest = nearest
    d = p - closest
    r = math.sqrt((d * d).sum())
    if r < 1e-9:
        sign = 1.0 if height >= 0.0 else -1.0
        out[0], out[1], out[2] = sign * normal[0], sign * normal[1], sign * normal[2]
    else:
        out[0], out[1], out[2] = d[0] / r, d[1] / r, d[2] / r
    out[3] = r / q[0]
    return r - q[0]


@nb.njit(cache=True)
def _power(base: float, exponent: float) -> float:
    return base**exponent if base > 1e-100 else 0.0


@nb.njit(cache=True)
def _superellipsoid(q: F64, x: float, y: float, z: float, out: F64) -> float:
    e1, e2 = q[3], q[4]
    u, v, w = abs(x / q[0]), abs(y / q[1]), abs(z / q[2])
    biggest = max(u, v, w)
    if biggest < 1e-9:  # at the centre the nearest face is along the shortest axis
        least = min(q[0], q[1], q[2])
        out[0], out[1], out[2], out[3] = 0.0, 0.0, 0.0, 0.0
        out[0 if q[0] == least else 1 if q[1] == least else 2] = 1.0
        return -least
    u, v, w = u / biggest, v / biggest, w / biggest  # the ratio is homogeneous: no power overflows
    inner = _power(u, 2.0 / e2) + _power(v, 2.0 / e2)
    h = _power(inner, e2 / e1) + _power(w, 2.0 / e1)
    ratio = _power(h, e1 / 2.0)
    common = _power(h, e1 / 2.0 - 1.0)
    planar = common * _power(inner, e2 / e1 - 1.0)
    gx = planar * _power(u, 2.0 / e2 - 1.0) * math.copysign(1.0, x) / q[0]
    gy = planar * _power(v, 2.0 / e2 - 1.0) * math.copysign(1.0, y) / q[1]
    gz = common * _power(w, 2.0 / e1 - 1.0) * math.copysign(1.0, z) / q[2]
    slope = math.sqrt(gx * gx + gy * gy + gz * gz)
    _unit(gx, gy, gz, slope, out)
    out[3] = ratio * biggest
    return (out[3] - 1.0) / max(slope, 1e-9)


@nb.njit(cache=True)
def _supertoroid(q: F64, x: float, y: float, z: float, out: F64) -> float:
    e1, e2 = q[4], q[5]
    u, v, w = abs(x / q[0]), abs(y / q[1]), abs(z / q[2])
    ring = _power(_power(u, 2.0 / e2) + _power(v, 2.0 / e2), e2 / 2.0)
    across = ring - q[3]
    ratio = _power(_power(abs(across), 2.0 / e1) + _power(w, 2.0 / e1), e1 / 2.0)
    if ratio < 1e-9 or ring < 1e-9:
        out[0], out[1], out[2], out[3] = 0.0, 0.0, 1.0, ratio
        return (ratio - 1.0) * min(q[0], q[2])
    common = _power(ratio, 1.0 - 2.0 / e1)
    radial = common * _power(abs(across), 2.0 / e1 - 1.0) * math.copysign(1.0, across)
    radial *= _power(ring, 1.0 - 2.0 / e2)
    gx = radial * _power(u, 2.0 / e2 - 1.0) * math.copysign(1.0, x) / q[0]
    gy = radial * _power(v, 2.0 / e2 - 1.0) * math.copysign(1.0, y) / q[1]
    gz = common * _power(w, 2.0 / e1 - 1.0) * math.copysign(1.0, z) / q[2]
    slope = math.sqrt(gx * gx + gy * gy + gz * gz)
    _unit(gx, gy, gz, slope, out)
    out[3] = ratio
    return (ratio - 1.0) / max(slope, 1e-9)
