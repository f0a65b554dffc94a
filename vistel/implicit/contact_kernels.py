"""Numba kernels of the contact search: surface ratio and distance of one primitive, boxes, pairs. float64."""

# pyright: basic

from __future__ import annotations

import math

import numba as nb
import numpy as np

from vistel.implicit.contact_set import CONE_SPHERE, ROUNDED_POLYGON, SPHERE, SUPERELLIPSOID, SUPERTOROID

T = 0.5
INVERSE_T = math.sqrt(1.0 - math.sqrt(T))
"""f^-1(T) of the quartic: surface radius / influence radius."""

_TINY = 1e-12
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@nb.njit(cache=True, inline="always")
def _signed_power(x, e):
    return math.copysign(abs(x) ** e, x) if x != 0.0 else 0.0


@nb.njit(cache=True)
def cone_sphere_foot(px, py, pz, c):
    """(fraction of the axis in [0, 1], distance to the foot, radius there): a cone-sphere's nearest ball."""
    ux, uy, uz = c[3] - c[0], c[4] - c[1], c[5] - c[2]
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    wx, wy, wz = px - c[0], py - c[1], pz - c[2]
    if length < _TINY:
        s = 0.0 if c[6] >= c[7] else 1.0
        return s, math.sqrt(wx * wx + wy * wy + wz * wz), max(c[6], c[7])
    x = (wx * ux + wy * uy + wz * uz) / length
    k = (c[7] - c[6]) / length
    rho = math.sqrt(max(0.0, wx * wx + wy * wy + wz * wz - x * x))
    if abs(k) < 1.0:
        s = x + k * rho / math.sqrt(1.0 - k * k)
    else:
        s = length if k > 0.0 else 0.0
    s = min(max(s, 0.0), length)
    return s / length, math.sqrt((x - s) * (x - s) + rho * rho), c[6] + k * s


@nb.njit(cache=True)
def _polygon(px, py, pz, p, out):
    """Distance to a filled planar convex polygon (params without r), unit vector from it in out[1:4]."""
    n = len(p) // 3
    ax, ay, az = p[3] - p[0], p[4] - p[1], p[5] - p[2]
    nx = ny = nz = 0.0
    for i in range(2, n):
        bx, by, bz = p[3 * i] - p[0], p[3 * i + 1] - p[1], p[3 * i + 2] - p[2]
        nx += ay * bz - az * by
        ny += az * bx - ax * bz
        nz += ax * by - ay * bx
        ax, ay, az = bx, by, bz
    norm = max(_TINY, math.sqrt(nx * nx + ny * ny + nz * nz))
    nx, ny, nz = nx / norm, ny / norm, nz / norm
    height = (px - p[0]) * nx + (py - p[1]) * ny + (pz - p[2]) * nz
    inside = True
    best = 1e300
    qx = qy = qz = 0.0
    for i in range(n):
        j = (i + 1) % n
        ex, ey, ez = p[3 * j] - p[3 * i], p[3 * j + 1] - p[3 * i + 1], p[3 * j + 2] - p[3 * i + 2]
        wx, wy, wz = px - p[3 * i], py - p[3 * i + 1], pz - p[3 * i + 2]
        if (ey * wz - ez * wy) * nx + (ez * wx - ex * wz) * ny + (ex * wy - ey * wx) * nz < 0.0:
            inside = False
        t = (ex * wx + ey * wy + ez * wz) / max(_TINY, ex * ex + ey * ey + ez * ez)
        t = min(max(t, 0.0), 1.0)
        dx, dy, dz = wx - t * ex, wy - t * ey, wz - t * ez
        d2 = dx * dx + dy * dy + dz * dz
        if d2 < best:
            best, qx, qy, qz = d2, dx, dy, dz
    if inside:
        sign = 1.0 if height >= 0.0 else -1.0
        out[1], out[2], out[3] = sign * nx, sign * ny, sign * nz
        return abs(height)
    distance = math.sqrt(best)
    if distance > _TINY:
        out[1], out[2], out[3] = qx / distance, qy / distance, qz / distance
    else:
        out[1], out[2], out[3] = nx, ny, nz
    return distance


@nb.njit(cache=True)
def surface(px, py, pz, kind, p, out):
    """A primitive seen from a point of its own frame.

    out: [0] signed distance to the surface (exact but for superquadrics, there to first order) [m],
    [1:4] outward unit normal, [4] distance ratio relative to the surface (1 on it).
    """
    if kind == SPHERE:
        m = math.sqrt(px * px + py * py + pz * pz)
        if m > _TINY:
            out[1], out[2], out[3] = px / m, py / m, pz / m
        else:
            out[1], out[2], out[3] = 0.0, 1.0, 0.0
        out[0], out[4] = m - p[0], m / p[0]
    elif kind == CONE_SPHERE:
        s, distance, r = cone_sphere_foot(px, py, pz, p)
        ux, uy, uz = p[3] - p[0], p[4] - p[1], p[5] - p[2]
        dx, dy, dz = px - p[0] - s * ux, py - p[1] - s * uy, pz - p[2] - s * uz
        if distance > _TINY:
            out[1], out[2], out[3] = dx / distance, dy / distance, dz / distance
        else:
            _perpendicular(ux, uy, uz, out)
        out[0], out[4] = distance - r, distance / r
    elif kind == ROUNDED_POLYGON:
        distance = _polygon(px, py, pz, p[1:], out)
        out[0], out[4] = distance - p[0], distance / p[0]
    elif kind == SUPERELLIPSOID:
        e1, e2 = p[3], p[4]
        w = (abs(px / p[0]) ** (2 / e2) + abs(py / p[1]) ** (2 / e2))
        h = w ** (e2 / e1) + abs(pz / p[2]) ** (2 / e1)
        if h < 1e-30:
            out[0], out[1], out[2], out[3], out[4] = -min(p[0], p[1], p[2]), 0.0, 0.0, 1.0, 0.0
            return
        d = h ** (0.5 * e1)
        outer = h ** (0.5 * e1 - 1.0)
        inner = w ** (e2 / e1 - 1.0) if w > 1e-30 else 0.0
        gx = outer * inner * _signed_power(px / p[0], 2 / e2 - 1) / p[0]
        gy = outer * inner * _signed_power(py / p[1], 2 / e2 - 1) / p[1]
        gz = outer * _signed_power(pz / p[2], 2 / e1 - 1) / p[2]
        _ratio(d, gx, gy, gz, out)
    elif kind == SUPERTOROID:
        a1, a2, a3, alpha, e1, e2 = p[0], p[1], p[2], p[3], p[4], p[5]
        w = abs(px / a1) ** (2 / e2) + abs(py / a2) ** (2 / e2)
        q = w ** (0.5 * e2)
        v = q - alpha
        h = abs(v) ** (2 / e1) + abs(pz / a3) ** (2 / e1)
        if h < 1e-30 or w < 1e-30:
            out[0], out[1], out[2], out[3] = -min(a1, a3), 0.0, 0.0, 1.0
            out[4] = h ** (0.5 * e1)
            if w < 1e-30:
                out[0] = a1 * (out[4] - 1.0)
            return
        d = h ** (0.5 * e1)
        outer = d ** (1.0 - 2 / e1)
        dv = outer * _signed_power(v, 2 / e1 - 1) * w ** (0.5 * e2 - 1.0)
        gx = dv * _signed_power(px / a1, 2 / e2 - 1) / a1
        gy = dv * _signed_power(py / a2, 2 / e2 - 1) / a2
        gz = outer * _signed_power(pz / a3, 2 / e1 - 1) / a3
        _ratio(d, gx, gy, gz, out)


@nb.njit(cache=True, inline="always")
def _ratio(d, gx, gy, gz, out):
    g = math.sqrt(gx * gx + gy * gy + gz * gz)
    if g < _TINY:
        out[0], out[1], out[2], out[3], out[4] = d - 1.0, 0.0, 0.0, 1.0, d
        return
    out[0], out[1], out[2], out[3], out[4] = (d - 1.0) / g, gx / g, gy / g, gz / g, d


@nb.njit(cache=True)
def _perpendicular(ux, uy, uz, out):
    """A unit vector across (ux, uy, uz) in out[1:4]."""
    if abs(ux) <= abs(uy) and abs(ux) <= abs(uz):
        x, y, z = 0.0, -uz, uy
    elif abs(uy) <= abs(uz):
        x, y, z = uz, 0.0, -ux
    else:
        x, y, z = -uy, ux, 0.0
    m = math.sqrt(x * x + y * y + z * z)
    if m < _TINY:
        x, y, z, m = 0.0, 1.0, 0.0, 1.0
    out[1], out[2], out[3] = x / m, y / m, z / m


@nb.njit(cache=True)
def field_of_ratio(d):
    """Quartic field at a ratio relative to the surface."""
    x = d * INVERSE_T
    q = 1.0 - x * x
    return q * q if q > 0.0 else 0.0


@nb.njit(cache=True)
def box_of(kind, p, rotation, position, out):
    """Axis-aligned box of a primitive in the room: out[0:3] low, out[3:6] high [m]."""
    if kind in (CONE_SPHERE, ROUNDED_POLYGON):
        out[0:3] = 1e300
        out[3:6] = -1e300
        first = 0 if kind == CONE_SPHERE else 1
        count = 2 if kind == CONE_SPHERE else (len(p) - 1) // 3
        for i in range(count):
            r = p[6 + i] if kind == CONE_SPHERE else p[0]
            for axis in range(3):
                c = position[axis]
                for k in range(3):
                    c += rotation[axis, k] * p[first + 3 * i + k]
                out[axis] = min(out[axis], c - r)
                out[3 + axis] = max(out[3 + axis], c + r)
        return
    if kind == SPHERE:
        hx = hy = hz = p[0]
    elif kind == SUPERELLIPSOID:
        hx, hy, hz = p[0], p[1], p[2]
    else:
        hx, hy, hz = p[0] * (p[3] + 1.0), p[1] * (p[3] + 1.0), p[2]
    for axis in range(3):
        if kind == SPHERE:
            h = hx
        else:
            h = abs(rotation[axis, 0]) * hx + abs(rotation[axis, 1]) * hy + abs(rotation[axis, 2]) * hz
        out[axis], out[3 + axis] = position[axis] - h, position[axis] + h


@nb.njit(cache=True)
def _boxes(kind, start, params, rotation, position):
    out = np.empty((len(kind), 6))
    for i in range(len(kind)):
        box_of(kind[i], params[start[i] : start[i + 1]], rotation[i], position[i], out[i])
    return out


@nb.njit(cache=True)
def _apart(a, b, margin):
    return (
        a[0] > b[3] + margin or b[0] > a[3] + margin
        or a[1] > b[4] + margin or b[1] > a[4] + margin
        or a[2] > b[5] + margin or b[2] > a[5] + margin
    )  # fmt: skip


@nb.njit(cache=True)
def _hull(boxes, out):
    out[0:3], out[3:6] = 1e300, -1e300
    for i in range(len(boxes)):
        for axis in range(3):
            out[axis] = min(out[axis], boxes[i, axis])
            out[3 + axis] = max(out[3 + axis], boxes[i, 3 + axis])


@nb.njit(cache=True)
def _cone_in_room(kind, p, rotation, position, out):
    """A sphere or cone-sphere as cone-sphere parameters in the room frame."""
    if kind == SPHERE:
        out[0:3], out[3:6] = position, position
        out[6] = out[7] = p[0]
        return
    for end in range(2):
        for axis in range(3):
            c = position[axis]
            for k in range(3):
                c += rotation[axis, k] * p[3 * end + k]
            out[3 * end + axis] = c
    out[6], out[7] = p[6], p[7]


@nb.njit(cache=True)
def cone_pair(a, b, row):
    """Contact of two cone-spheres in the room; row: point, normal, depth, field depth. Returns the depth."""
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
        for _ in range(64):
            old_s, old_t = s, t
            t = cone_sphere_foot(a[0] + s * ux, a[1] + s * uy, a[2] + s * uz, b)[0]
            s = cone_sphere_foot(b[0] + t * vx, b[1] + t * vy, b[2] + t * vz, a)[0]
            if abs(s - old_s) + abs(t - old_t) < 1e-6:
                break
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
            side = np.empty(4)
            _perpendicular(ux, uy, uz, side)
            row[3:6] = side[1:4]
    ratio = distance / (ra + rb)
    row[0] = a[0] + s * ux + row[3] * ratio * ra
    row[1] = a[1] + s * uy + row[4] * ratio * ra
    row[2] = a[2] + s * uz + row[5] * ratio * ra
    row[6] = ra + rb - distance
    row[7] = field_of_ratio(ratio) - T
    return row[6]


@nb.njit(cache=True)
def _along(cone, s, kind, p, rotation, position, out):
    """Distance of the sphere at fraction s of a cone-sphere (room) to a primitive; `out` as in `surface`."""
    x = cone[0] + s * (cone[3] - cone[0]) - position[0]
    y = cone[1] + s * (cone[4] - cone[1]) - position[1]
    z = cone[2] + s * (cone[5] - cone[2]) - position[2]
    surface(
        rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0] * z,
        rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1] * z,
        rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2] * z,
        kind, p, out,
    )  # fmt: skip
    return out[0] - cone[6] - s * (cone[7] - cone[6])


@nb.njit(cache=True)
def cone_against(cone, kind, p, rotation, position, row):
    """Contact of a cone-sphere (room) with a primitive of any kind; `row` as in `cone_pair`."""
    out = np.empty(5)
    samples = 9
    best, at = 1e300, 0.0
    for i in range(samples):
        s = i / (samples - 1.0)
        gap = _along(cone, s, kind, p, rotation, position, out)
        if gap < best:
            best, at = gap, s
    low, high = max(0.0, at - 1.0 / (samples - 1)), min(1.0, at + 1.0 / (samples - 1))
    x1, x2 = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    f1 = _along(cone, x1, kind, p, rotation, position, out)
    f2 = _along(cone, x2, kind, p, rotation, position, out)
    for _ in range(20):
        if f1 <= f2:
            high, x2, f2 = x2, x1, f1
            x1 = high - _GOLDEN * (high - low)
            f1 = _along(cone, x1, kind, p, rotation, position, out)
        else:
            low, x1, f1 = x1, x2, f2
            x2 = low + _GOLDEN * (high - low)
            f2 = _along(cone, x2, kind, p, rotation, position, out)
    middle = 0.5 * (low + high)
    s = middle if _along(cone, middle, kind, p, rotation, position, out) <= best else at
    gap = _along(cone, s, kind, p, rotation, position, out)
    radius = cone[6] + s * (cone[7] - cone[6])
    n = out[1:4].copy()
    nx = rotation[0, 0] * n[0] + rotation[0, 1] * n[1] + rotation[0, 2] * n[2]
    ny = rotation[1, 0] * n[0] + rotation[1, 1] * n[1] + rotation[1, 2] * n[2]
    nz = rotation[2, 0] * n[0] + rotation[2, 1] * n[1] + rotation[2, 2] * n[2]
    row[3], row[4], row[5] = -nx, -ny, -nz
    # Where both ratios are equal, on the line from the sphere's centre into the primitive.
    cx = cone[0] + s * (cone[3] - cone[0])
    cy = cone[1] + s * (cone[4] - cone[1])
    cz = cone[2] + s * (cone[5] - cone[2])
    low, high = 0.0, max(out[0], 0.0) + radius
    for _ in range(24):
        tau = 0.5 * (low + high)
        x, y, z = cx - tau * nx - position[0], cy - tau * ny - position[1], cz - tau * nz - position[2]
        surface(
            rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0] * z,
            rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1] * z,
            rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2] * z,
            kind, p, out,
        )  # fmt: skip
        if tau < radius * out[4]:
            low = tau
        else:
            high = tau
    tau = 0.5 * (low + high)
    row[0], row[1], row[2] = cx - tau * nx, cy - tau * ny, cz - tau * nz
    row[6] = -gap
    row[7] = field_of_ratio(max(tau / max(radius, _TINY), 0.0)) - T
    return -gap


@nb.njit(cache=True)
def probes(kind, p, out):
    """Points on the surface of a primitive that is no cone-sphere, in its frame; returns how many (<= 64)."""
    n = 0
    if kind == ROUNDED_POLYGON:
        count = (len(p) - 1) // 3
        cx = cy = cz = 0.0
        for i in range(count):
            cx += p[1 + 3 * i] / count
            cy += p[2 + 3 * i] / count
            cz += p[3 + 3 * i] / count
        for i in range(count):
            j = (i + 1) % count
            out[n] = p[1 + 3 * i : 4 + 3 * i]
            out[n + 1] = 0.5 * (p[1 + 3 * i : 4 + 3 * i] + p[1 + 3 * j : 4 + 3 * j])
            n += 2
        out[n, 0], out[n, 1], out[n, 2] = cx, cy, cz
        return n + 1
    if kind == SUPERTOROID:
        for i in range(16):
            c, s = math.cos(i * math.pi / 8), math.sin(i * math.pi / 8)
            x, y = _signed_power(c, p[5]) * p[0] * p[3], _signed_power(s, p[5]) * p[1] * p[3]
            out[n, 0], out[n, 1], out[n, 2] = x, y, p[2]
            out[n + 1, 0], out[n + 1, 1], out[n + 1, 2] = x, y, -p[2]
            out[n + 2, 0], out[n + 2, 1], out[n + 2, 2] = x * (1 + 1 / p[3]), y * (1 + 1 / p[3]), 0.0
            n += 3
        return n
    for ix in range(-1, 2):
        for iy in range(-1, 2):
            for iz in range(-1, 2):
                if ix == 0 and iy == 0 and iz == 0:
                    continue
                x, y, z = ix * p[0], iy * p[1], iz * p[2]
                w = abs(ix) + abs(iy)
                h = float(w) ** (p[4] / p[3]) + abs(iz) if w > 0 else float(abs(iz))
                d = h ** (0.5 * p[3])
                out[n, 0], out[n, 1], out[n, 2] = x / d, y / d, z / d
                n += 1
    return n


@nb.njit(cache=True)
def _by_probes(kind_a, p_a, rotation_a, position_a, kind_b, p_b, rotation_b, position_b, row):
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


@nb.njit(cache=True)
def find_pairs(
    kind_a, start_a, params_a, rotation_a, position_a, kind_b, start_b, params_b, rotation_b, position_b,
    skip, margin, pairs, rows,
):  # fmt: skip
    """All contacts; returns their number, which may exceed what `pairs` and `rows` hold."""
    box_a = _boxes(kind_a, start_a, params_a, rotation_a, position_a)
    box_b = _boxes(kind_b, start_b, params_b, rotation_b, position_b)
    hull_a, hull_b = np.empty(6), np.empty(6)
    _hull(box_a, hull_a)
    _hull(box_b, hull_b)
    count = 0
    if len(kind_a) == 0 or len(kind_b) == 0 or _apart(hull_a, hull_b, margin):
        return count
    near = np.empty(len(kind_b), np.int32)
    n_near = 0
    for j in range(len(kind_b)):
        if not _apart(hull_a, box_b[j], margin):
            near[n_near] = j
            n_near += 1
    cone_a, cone_b, row = np.empty(8), np.empty(8), np.empty(8)
    use_skip = skip.shape[0] > 0
    for i in range(len(kind_a)):
        if _apart(hull_b, box_a[i], margin):
            continue
        p_a = params_a[start_a[i] : start_a[i + 1]]
        round_a = kind_a[i] <= CONE_SPHERE
        if round_a:
            _cone_in_room(kind_a[i], p_a, rotation_a[i], position_a[i], cone_a)
        for m in range(n_near):
            j = near[m]
            if _apart(box_a[i], box_b[j], margin) or (use_skip and skip[i, j]):
                continue
            p_b = params_b[start_b[j] : start_b[j + 1]]
            round_b = kind_b[j] <= CONE_SPHERE
            if round_b:
                _cone_in_room(kind_b[j], p_b, rotation_b[j], position_b[j], cone_b)
            if round_a and round_b:
                depth = cone_pair(cone_a, cone_b, row)
            elif round_a:
                depth = cone_against(cone_a, kind_b[j], p_b, rotation_b[j], position_b[j], row)
            elif round_b:
                depth = cone_against(cone_b, kind_a[i], p_a, rotation_a[i], position_a[i], row)
                row[3:6] = -row[3:6]
            else:
                depth = _by_probes(kind_a[i], p_a, rotation_a[i], position_a[i],
                                   kind_b[j], p_b, rotation_b[j], position_b[j], row)  # fmt: skip
            if depth > -margin:
                if count < len(pairs):
                    pairs[count, 0], pairs[count, 1] = i, j
                    rows[count] = row
                count += 1
    return count
