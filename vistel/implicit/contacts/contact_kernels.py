"""Numba kernels of the narrow phase: the contact of two primitives of any kinds. float64."""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.implicit.constants import THRESHOLD as T
from vistel.implicit.contacts.contact_set import ROUNDED_POLYGON, SUPERELLIPSOID
from vistel.implicit.contacts.contact_surface_kernels import cone_sphere_foot, field_of_ratio, perpendicular, probes, surface
from vistel.jit.kernel_jit import inner
from vistel.jit.pointers import at

_TINY = 1e-12
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
_NEAR_END = 1e-5
"""Shares of a cone-sphere's length nearer than this are one."""
_CLOSE = 1e-9
"""Lengths nearer than this are one [m]."""
_PIECES = 8
"""Of a cone-sphere whose distance from a box is bounded."""


@inner
def cone_pair(a, b, row):
    """Contact of two cone-spheres in the room; row: point, normal, depth, field depth. Returns the depth.
    Pointers, all three."""
    ux, uy, uz = a[3] - a[0], a[4] - a[1], a[5] - a[2]
    vx, vy, vz = b[3] - b[0], b[4] - b[1], b[5] - b[2]
    wx, wy, wz = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    uu, vv, uv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
    uw, vw = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
    # Feet of the two skeletons (Ericson, Real-Time Collision Detection §5.1.9), the start for tapered ones.
    det = uu * vv - uv * uv
    s = min(max((uv * vw - uw * vv) / det, 0.0), 1.0) if det > 1e-9 * uu * vv else 0.5
    t = (uv * s + vw) / vv if vv > _TINY else 0.0
    t = min(max(t, 0.0), 1.0)
    s = min(max((uv * t - uw) / uu, 0.0), 1.0) if uu > _TINY else 0.0
    tapered = a[6] != a[7] or b[6] != b[7]
    if tapered:
        # From foot to foot; nearly parallel ones approach the end by steps of one ratio, which Aitken sums up.
        for _ in range(24):
            first = s
            t = cone_sphere_foot(a[0] + s * ux, a[1] + s * uy, a[2] + s * uz, b)[0]
            second = cone_sphere_foot(b[0] + t * vx, b[1] + t * vy, b[2] + t * vz, a)[0]
            t = cone_sphere_foot(a[0] + second * ux, a[1] + second * uy, a[2] + second * uz, b)[0]
            s = cone_sphere_foot(b[0] + t * vx, b[1] + t * vy, b[2] + t * vz, a)[0]
            if abs(s - second) < 1e-7:
                break
            ratio = (s - second) / (second - first) if second != first else 0.0
            if ratio > 0.0:
                left = (s - second) * ratio / (1.0 - ratio) if ratio < 0.999 else math.copysign(1.0, s - second)
                s = min(max(s + left, 0.0), 1.0)
    dx, dy, dz = wx * -1.0 + t * vx - s * ux, -wy + t * vy - s * uy, -wz + t * vz - s * uz
    distance = math.sqrt(dx * dx + dy * dy + dz * dz)
    ra, rb = a[6] + s * (a[7] - a[6]), b[6] + t * (b[7] - b[6])
    if distance > 1e-9:
        row[3], row[4], row[5] = dx / distance, dy / distance, dz / distance
    else:  # the skeletons cross: push across both
        cx, cy, cz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        m = math.sqrt(cx * cx + cy * cy + cz * cz)
        if m > 1e-12:
            row[3], row[4], row[5] = cx / m, cy / m, cz / m
        else:
            perpendicular(ux, uy, uz, at(row, 2))
    ratio = distance / (ra + rb)
    row[0] = a[0] + s * ux + row[3] * ratio * ra
    row[1] = a[1] + s * uy + row[4] * ratio * ra
    row[2] = a[2] + s * uz + row[5] * ratio * ra
    row[6] = ra + rb - distance
    row[7] = field_of_ratio(ratio) - T
    return row[6]


@inner
def _along(cone, s, kind, p, rotation, position, out):
    """Distance of the sphere at fraction s of a cone-sphere (room) to a primitive; `out` as in `surface`."""
    x = cone[0] + s * (cone[3] - cone[0]) - position[0]
    y = cone[1] + s * (cone[4] - cone[1]) - position[1]
    z = cone[2] + s * (cone[5] - cone[2]) - position[2]
    surface(
        rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0] * z,
        rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1] * z,
        rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2] * z,
        kind,
        p,
        out,
    )
    return out[0] - cone[6] - s * (cone[7] - cone[6])


@inner
def _lowest(cone, kind, p, rotation, position, out):
    """Where along a cone-sphere its ball comes nearest to a primitive: the best of nine, then Brent's search beside it
    (Brent 1973, ch. 5: parabolas, golden sections where they fail)."""
    samples = 9
    best, i_best = 1e300, 0
    for i in range(samples):
        gap = _along(cone, i / (samples - 1.0), kind, p, rotation, position, out)
        if gap < best:
            best, i_best = gap, i
    at = i_best / (samples - 1.0)
    if i_best == 0 or i_best == samples - 1:
        inside = _NEAR_END if i_best == 0 else 1.0 - _NEAR_END
        if _along(cone, inside, kind, p, rotation, position, out) >= best:
            return at
    low, high = max(0.0, at - 1.0 / (samples - 1)), min(1.0, at + 1.0 / (samples - 1))
    x = second = third = at
    f_x = f_second = f_third = best
    step = last = 0.0
    for _ in range(24):
        middle = 0.5 * (low + high)
        if abs(x - middle) <= 2.0 * _NEAR_END - 0.5 * (high - low):
            break
        golden = True
        if abs(last) > _NEAR_END:
            r, q = (x - second) * (f_x - f_third), (x - third) * (f_x - f_second)
            top = (x - third) * q - (x - second) * r
            q = 2.0 * (q - r)
            if q > 0.0:
                top = -top
            q = abs(q)
            before, last = last, step
            if abs(top) < abs(0.5 * q * before) and q * (low - x) < top < q * (high - x):
                step = top / q
                u = x + step
                if u - low < 2.0 * _NEAR_END or high - u < 2.0 * _NEAR_END:
                    step = math.copysign(_NEAR_END, middle - x)
                golden = False
        if golden:
            last = (low if x >= middle else high) - x
            step = (1.0 - _GOLDEN) * last
        u = x + (step if abs(step) >= _NEAR_END else math.copysign(_NEAR_END, step))
        f_u = _along(cone, u, kind, p, rotation, position, out)
        if f_u <= f_x:
            if u >= x:
                low = x
            else:
                high = x
            third, f_third, second, f_second, x, f_x = second, f_second, x, f_x, u, f_u
        else:
            if u < x:
                low = u
            else:
                high = u
            if f_u <= f_second or second == x:
                third, f_third, second, f_second = second, f_second, u, f_u
            elif f_u <= f_third or third in (x, second):
                third, f_third = u, f_u
    return x


@inner
def _clear_of_box(cone, p, rotation, position, margin):
    """Whether a cone-sphere (room) is surely farther than `margin` from a superellipsoid [m]: balls round pieces of it are from its
    box. `surface` says no less."""
    ends = np.empty((2, 3))
    for e in range(2):
        x, y, z = cone[3 * e] - position[0], cone[3 * e + 1] - position[1], cone[3 * e + 2] - position[2]
        for axis in range(3):
            ends[e, axis] = rotation[0, axis] * x + rotation[1, axis] * y + rotation[2, axis] * z
    wx, wy, wz, wr = ends[1, 0] - ends[0, 0], ends[1, 1] - ends[0, 1], ends[1, 2] - ends[0, 2], cone[7] - cone[6]
    half = 0.5 / _PIECES
    around = half * (math.sqrt(wx * wx + wy * wy + wz * wz) + abs(wr)) + margin
    for k in range(_PIECES):
        s = (k + 0.5) / _PIECES
        dx = max(abs(ends[0, 0] + s * wx) - p[0], 0.0)
        dy = max(abs(ends[0, 1] + s * wy) - p[1], 0.0)
        dz = max(abs(ends[0, 2] + s * wz) - p[2], 0.0)
        reach = cone[6] + s * wr + around
        if dx * dx + dy * dy + dz * dz <= reach * reach:
            return False
    return True


@inner
def cone_against(cone, kind, p, rotation, position, margin, row):
    """Contact of a cone-sphere (room) with a primitive of any kind; `row` as in `cone_pair`. Where they are farther apart than
    `margin` any depth below -margin may be returned."""
    if kind == SUPERELLIPSOID and _clear_of_box(cone, p, rotation, position, margin):
        return -1e300
    out = np.empty(5)
    s = _lowest(cone, kind, p, rotation, position, out)
    gap = _along(cone, s, kind, p, rotation, position, out)
    radius = cone[6] + s * (cone[7] - cone[6])
    n = out[1:4].copy()
    nx = rotation[0, 0] * n[0] + rotation[0, 1] * n[1] + rotation[0, 2] * n[2]
    ny = rotation[1, 0] * n[0] + rotation[1, 1] * n[1] + rotation[1, 2] * n[2]
    nz = rotation[2, 0] * n[0] + rotation[2, 1] * n[1] + rotation[2, 2] * n[2]
    row[3], row[4], row[5] = -nx, -ny, -nz
    # Where both ratios are equal, on the line from the sphere's centre into the primitive: regula falsi, the Illinois way.
    cx = cone[0] + s * (cone[3] - cone[0])
    cy = cone[1] + s * (cone[4] - cone[1])
    cz = cone[2] + s * (cone[5] - cone[2])
    low, high = 0.0, max(out[0], 0.0) + radius
    f_low, f_high = -radius * out[4], 0.0
    # Beyond a thin primitive the ratio grows again: until a place is found past the root, intervals are halved.
    tau, kept = 0.5 * high, 0
    for _ in range(24):
        x, y, z = cx - tau * nx - position[0], cy - tau * ny - position[1], cz - tau * nz - position[2]
        surface(
            rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0] * z,
            rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1] * z,
            rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2] * z,
            kind,
            p,
            out,
        )
        f = tau - radius * out[4]
        if f < 0.0:
            low, f_low = tau, f
            f_high *= 0.5 if kept == 1 else 1.0
            kept = 1
        else:
            high, f_high = tau, f
            f_low *= 0.5 if kept == 2 else 1.0
            kept = 2
        if abs(f) < _CLOSE or high - low < _CLOSE:
            break
        tau = (low * f_high - high * f_low) / (f_high - f_low) if f_high > 0.0 else 0.5 * (low + high)
    row[0], row[1], row[2] = cx - tau * nx, cy - tau * ny, cz - tau * nz
    row[6] = -gap
    row[7] = field_of_ratio(max(tau / max(radius, _TINY), 0.0)) - T
    return -gap


@inner
def by_probes(kind_a, p_a, rotation_a, position_a, kind_b, p_b, rotation_b, position_b, row):
    """Contact of two primitives neither of which is a cone-sphere: the deepest probe of a in b."""
    points = np.empty((64, 3))
    count = probes(kind_a, p_a, points)
    out = np.empty(5)
    cone = np.empty(8)
    radius = p_a[0] if kind_a == ROUNDED_POLYGON else 0.0
    best, at = 1e300, 0
    for i in range(count):
        cone[0:3] = rotation_a @ points[i] + position_a
        cone[3:6] = cone[0:3]
        cone[6] = cone[7] = radius
        gap = _along(cone, 0.0, kind_b, p_b, rotation_b, position_b, out)
        if gap < best:
            best, at = gap, i
    point = rotation_a @ points[at] + position_a
    cone[0:3], cone[3:6] = point, point
    cone[6] = cone[7] = radius
    _along(cone, 0.0, kind_b, p_b, rotation_b, position_b, out)
    n = rotation_b @ out[1:4].copy()
    row[3:6] = -n
    row[0:3] = point - n * (radius - 0.5 * max(0.0, -best))
    row[6] = -best
    smallest = radius if kind_a == ROUNDED_POLYGON else min(p_a[0], p_a[2])
    row[7] = field_of_ratio(1.0 + 0.5 * best / smallest) - T
    return row[6]
