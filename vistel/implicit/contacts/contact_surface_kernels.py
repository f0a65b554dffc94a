"""Numba kernels of one primitive: signed distance and ratio of its surface, box, probe points. float64."""

# pyright: basic

import math

from vistel.implicit.constants import SURFACE_RATIO
from vistel.implicit.contacts.contact_set import CONE_SPHERE, ROUNDED_POLYGON, SPHERE, SUPERELLIPSOID, SUPERTOROID
from vistel.jit.kernel_jit import compiled, inner

_TINY = 1e-12


@compiled(inline="always")
def _signed_power(x, e):
    return math.copysign(abs(x) ** e, x) if x != 0.0 else 0.0


@inner
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


@inner
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


@compiled(inline="always")
def _superellipsoid(px, py, pz, p):
    """Both sums of a superellipsoid's equation at a point of its frame: of x and y, and of all three."""
    e1, e2 = p[3], p[4]
    w = abs(px / p[0]) ** (2 / e2) + abs(py / p[1]) ** (2 / e2)
    return w, w ** (e2 / e1) + abs(pz / p[2]) ** (2 / e1)


@inner
def superellipsoid_ratio(px, py, pz, p):
    """As out[4] of `surface`, of a superellipsoid."""
    h = _superellipsoid(px, py, pz, p)[1]
    return h ** (0.5 * p[3]) if h >= 1e-30 else 0.0


@compiled
def surface(px, py, pz, kind, p, out):
    """A primitive seen from a point of its own frame.

    out: [0] signed distance to the surface (exact but for superquadrics: there to first order, and no less than to the box round a
    superellipsoid) [m], [1:4] outward unit normal, [4] distance ratio relative to the surface (1 on it).
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
            perpendicular(ux, uy, uz, out)
        out[0], out[4] = distance - r, distance / r
    elif kind == ROUNDED_POLYGON:
        distance = _polygon(px, py, pz, p[1:], out)
        out[0], out[4] = distance - p[0], distance / p[0]
    elif kind == SUPERELLIPSOID:
        e1, e2 = p[3], p[4]
        w, h = _superellipsoid(px, py, pz, p)
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
        _beside_box(px, py, pz, p, out)
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


@compiled(inline="always")
def _ratio(d, gx, gy, gz, out):
    g = math.sqrt(gx * gx + gy * gy + gz * gz)
    if g < _TINY:
        out[0], out[1], out[2], out[3], out[4] = d - 1.0, 0.0, 0.0, 1.0, d
        return
    out[0], out[1], out[2], out[3], out[4] = (d - 1.0) / g, gx / g, gy / g, gz / g, d


@compiled(inline="always")
def _beside_box(px, py, pz, p, out):
    """The distance to the box round a superellipsoid, where that is more than the first order says, and a normal turned towards
    it as far: beside a flat one the slope is nearly that across it, and says a tenth of the way. Neither is ever more than the
    distance to the surface, which is convex."""
    dx, dy, dz = max(abs(px) - p[0], 0.0), max(abs(py) - p[1], 0.0), max(abs(pz) - p[2], 0.0)
    distance = math.sqrt(dx * dx + dy * dy + dz * dz)
    if distance <= max(out[0], 0.0):
        return
    kept = out[0] / distance
    turned = (1.0 - kept) / distance
    nx = kept * out[1] + turned * math.copysign(dx, px)
    ny = kept * out[2] + turned * math.copysign(dy, py)
    nz = kept * out[3] + turned * math.copysign(dz, pz)
    norm = math.sqrt(nx * nx + ny * ny + nz * nz)
    out[0], out[1], out[2], out[3] = distance, nx / norm, ny / norm, nz / norm


@inner
def perpendicular(ux, uy, uz, out):
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


@compiled
def field_of_ratio(d):
    """Quartic field at a ratio relative to the surface."""
    x = d * SURFACE_RATIO
    q = 1.0 - x * x
    return q * q if q > 0.0 else 0.0


@inner
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


@inner
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
