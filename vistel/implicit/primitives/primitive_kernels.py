"""One kernel for each kind of primitive: rows of points in, rows of u = d^2 and of its gradient out.

Every kernel has the form k(p, x, y, z, u, gx, gy, gz, n, slope): p points at the primitive's numbers; x, y, z,
u at rows of n float32; gx, gy, gz take du/dP
if `slope`.
"""

# pyright: basic, reportCallIssue=false

import math

from vistel.implicit.rows.row_kernels import F32, axis_slope, offset_slope, row
from vistel.jit.numbers import ONE, TWO, ZERO

TINY = F32(1e-12)
FAR = F32(2.0)
LARGE = F32(3e38)


@row
def _sphere_ratio(x, y, z, u, a, b, c, k, n):
    for i in range(n):
        dx = x[i] - a
        dy = y[i] - b
        dz = z[i] - c
        u[i] = (dx * dx + dy * dy + dz * dz) * k


@row
def sphere(p, x, y, z, u, gx, gy, gz, n, slope):
    """u of a sphere."""
    a, b, c, k = p[0], p[1], p[2], p[3]
    _sphere_ratio(x, y, z, u, a, b, c, k, n)
    if slope:
        offset_slope(gx, x, a, TWO * k, n)
        offset_slope(gy, y, b, TWO * k, n)
        offset_slope(gz, z, c, TWO * k, n)


@row
def _foot(x, y, z, h, a, b, c, ex, ey, ez, n):
    """h = foot of the point on the segment, as a fraction; e is the axis divided by its squared length."""
    for i in range(n):
        s = (x[i] - a) * ex + (y[i] - b) * ey + (z[i] - c) * ez
        s = s if s > ZERO else ZERO
        h[i] = s if s < ONE else ONE


@row
def _axis_distance(x, y, z, h, a, b, c, ex, ey, ez, k, n):
    """h becomes k |P - A - h E|^2."""
    for i in range(n):
        s = h[i]
        dx = x[i] - a - s * ex
        dy = y[i] - b - s * ey
        dz = z[i] - c - s * ez
        h[i] = (dx * dx + dy * dy + dz * dz) * k


@row
def _copy(a, b, n):
    for i in range(n):
        a[i] = b[i]


@row
def sphylinder(p, x, y, z, u, gx, gy, gz, n, slope):
    """u of a sphylinder."""
    a, b, c, ex, ey, ez = p[0], p[1], p[2], p[3], p[4], p[5]
    e, k = p[6], p[7]
    _foot(x, y, z, u, a, b, c, ex * e, ey * e, ez * e, n)
    if slope:
        axis_slope(gx, x, u, a, ex, TWO * k, n)
        axis_slope(gy, y, u, b, ey, TWO * k, n)
        axis_slope(gz, z, u, c, ez, TWO * k, n)
    _axis_distance(x, y, z, u, a, b, c, ex, ey, ez, k, n)


@row
def _cone_foot(x, y, z, s, a, b, c, ex, ey, ez, length, r, k, n):
    """s = place of the centre with the least ratio |P - C(s)| / r(s) on the axis."""
    end = length if k > ZERO else ZERO
    for i in range(n):
        dx = x[i] - a
        dy = y[i] - b
        dz = z[i] - c
        along = dx * ex + dy * ey + dz * ez
        rho2 = dx * dx + dy * dy + dz * dz - along * along
        rho2 = rho2 if rho2 > ZERO else ZERO
        radius = r + k * along
        safe = radius if radius > ZERO else ONE
        v = along + k * rho2 / safe
        v = v if radius > ZERO else end
        v = v if v > ZERO else ZERO
        s[i] = v if v < length else length


@row
def _cone_distance(x, y, z, s, a, b, c, ex, ey, ez, r, k, n):
    """s becomes |P - A - s E|^2 / (r + k s)^2."""
    for i in range(n):
        v = s[i]
        dx = x[i] - a - v * ex
        dy = y[i] - b - v * ey
        dz = z[i] - c - v * ez
        radius = r + k * v
        s[i] = (dx * dx + dy * dy + dz * dz) / (radius * radius)


@row
def _cone_slope(g, x, s, c, e, r, k, n):
    for i in range(n):
        radius = r + k * s[i]
        g[i] = TWO * (x[i] - c - s[i] * e) / (radius * radius)


@row
def _printed_cone(p, x, y, z, u, gx, gy, gz, n, slope):
    """The ratio of Singh §A.3.1: not the least one, and only C0 where the cone meets its caps."""
    a, b, c, ex, ey, ez = p[0], p[1], p[2], p[3], p[4], p[5]
    length, r, k = p[6], p[7], p[8]
    sin2 = ONE - k * k
    cot = k / math.sqrt(sin2)
    for i in range(n):
        dx, dy, dz = x[i] - a, y[i] - b, z[i] - c
        along = dx * ex + dy * ey + dz * ez
        rho2 = dx * dx + dy * dy + dz * dz - along * along
        s = along + cot * math.sqrt(max(rho2, ZERO))
        on_cone = s > ZERO and s < length
        s = min(max(s, ZERO), length)
        radius = r + k * s
        dx, dy, dz = dx - s * ex, dy - s * ey, dz - s * ez
        distance = math.sqrt(dx * dx + dy * dy + dz * dz)
        d = distance / radius
        u[i] = d * d
        if slope:
            across, axial = TWO * d / radius, ZERO
            if on_cone:
                across = TWO * d * (ONE - d * k * k) / (radius * sin2)
                axial = TWO * d * k * (ONE - d) / (radius * sin2)
            scale = across / max(distance, TINY)
            gx[i] = scale * dx + axial * ex
            gy[i] = scale * dy + axial * ey
            gz[i] = scale * dz + axial * ez


@row
def cone_sphere(p, x, y, z, u, gx, gy, gz, n, slope):
    """u of a cone-sphere."""
    if p[9] != ZERO:
        _printed_cone(p, x, y, z, u, gx, gy, gz, n, slope)
        return
    a, b, c, ex, ey, ez = p[0], p[1], p[2], p[3], p[4], p[5]
    length, r, k = p[6], p[7], p[8]
    _cone_foot(x, y, z, u, a, b, c, ex, ey, ez, length, r, k, n)
    if slope:
        _cone_slope(gx, x, u, a, ex, r, k, n)
        _cone_slope(gy, y, u, b, ey, r, k, n)
        _cone_slope(gz, z, u, c, ez, r, k, n)
    _cone_distance(x, y, z, u, a, b, c, ex, ey, ez, r, k, n)


@row
def rounded_polygon(p, x, y, z, u, gx, gy, gz, n, slope):
    """u of a rounded polygon."""
    k, m = p[0], int(p[1])
    for i in range(n):
        px, py = x[i], y[i]
        best, qx, qy = LARGE, ZERO, ZERO
        inside = False
        ax, ay = p[2 * m], p[2 * m + 1]
        for j in range(m):
            bx, by = p[2 + 2 * j], p[3 + 2 * j]
            ex, ey = bx - ax, by - ay
            s = ((px - ax) * ex + (py - ay) * ey) / (ex * ex + ey * ey)
            s = min(max(s, ZERO), ONE)
            dx, dy = px - ax - s * ex, py - ay - s * ey
            d2 = dx * dx + dy * dy
            if d2 < best:
                best, qx, qy = d2, dx, dy
            if (ay > py) != (by > py) and px < ax + ex * (py - ay) / ey:
                inside = not inside
            ax, ay = bx, by
        if inside:
            qx, qy = ZERO, ZERO
        u[i] = (qx * qx + qy * qy + z[i] * z[i]) * k
        if slope:
            gx[i], gy[i], gz[i] = TWO * k * qx, TWO * k * qy, TWO * k * z[i]


@row
def _power(base, exponent):
    """base^exponent for base >= 0; 0 where a negative power of 0 is asked for."""
    if base <= ZERO:
        return ZERO
    return F32(math.exp(exponent * math.log(base)))


@row
def superellipsoid(p, x, y, z, u, gx, gy, gz, n, slope):
    """u of a superellipsoid."""
    ia, ib, ic, e1, e2 = p[0], p[1], p[2], p[3], p[4]
    for i in range(n):
        ax, ay, az = abs(x[i]) * ia, abs(y[i]) * ib, abs(z[i]) * ic
        # Scaled by the largest coordinate, so that no power overflows or vanishes: d has degree one.
        m = max(ax, ay, az)
        if m <= TINY or m >= FAR:
            u[i] = ZERO if m <= TINY else FAR
            if slope:
                gx[i], gy[i], gz[i] = ZERO, ZERO, ZERO
            continue
        ax, ay, az = ax / m, ay / m, az / m
        w = _power(ax, TWO / e2) + _power(ay, TWO / e2)
        h = _power(w, e2 / e1) + _power(az, TWO / e1)
        d = _power(h, e1 / TWO)
        u[i] = m * m * d * d
        if slope:
            s = TWO * m * d * _power(h, e1 / TWO - ONE)
            ring = s * _power(w, e2 / e1 - ONE)
            gx[i] = math.copysign(ring * _power(ax, TWO / e2 - ONE) * ia, x[i])
            gy[i] = math.copysign(ring * _power(ay, TWO / e2 - ONE) * ib, y[i])
            gz[i] = math.copysign(s * _power(az, TWO / e1 - ONE) * ic, z[i])


@row
def supertoroid(p, x, y, z, u, gx, gy, gz, n, slope):
    """u of a supertoroid."""
    ia, ib, ic, alpha, e1, e2 = p[0], p[1], p[2], p[3], p[4], p[5]
    for i in range(n):
        ax, ay, az = abs(x[i]) * ia, abs(y[i]) * ib, abs(z[i]) * ic
        top = max(ax, ay)
        q = ZERO
        wx, wy = ZERO, ZERO
        if top > TINY:
            wx, wy = ax / top, ay / top
            inner = _power(wx, TWO / e2) + _power(wy, TWO / e2)
            q = top * _power(inner, e2 / TWO)
            rate = _power(inner, e2 / TWO - ONE)
            wx, wy = rate * _power(wx, TWO / e2 - ONE), rate * _power(wy, TWO / e2 - ONE)
        v = q - alpha
        m = max(abs(v), az)
        if m <= TINY or m >= FAR:
            u[i] = ZERO if m <= TINY else FAR
            if slope:
                gx[i], gy[i], gz[i] = ZERO, ZERO, ZERO
            continue
        av, az = abs(v) / m, az / m
        h = _power(av, TWO / e1) + _power(az, TWO / e1)
        d = _power(h, e1 / TWO)
        u[i] = m * m * d * d
        if slope:
            s = TWO * m * d * _power(h, e1 / TWO - ONE)
            ring = math.copysign(s * _power(av, TWO / e1 - ONE), v)
            gx[i] = math.copysign(ONE, x[i]) * ring * wx * ia
            gy[i] = math.copysign(ONE, y[i]) * ring * wy * ib
            gz[i] = math.copysign(s * _power(az, TWO / e1 - ONE) * ic, z[i])
