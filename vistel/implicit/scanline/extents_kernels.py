"""Extents of primitives in the picture: rows (Y), columns of a row (X), depths of a pixel (Z). Singh appendix A.

Eye space: +Z along the line of sight, a pixel's ray is (x, y, 1) z under perspective and (x, y, z) without it; x and y
are *slopes* (x/z) or lengths accordingly. An extent is (low, high), empty where low > high, infinite where it opens to
the picture's edge. The X-extents are those of the tangent method, for the rules printed in A.2.3 and A.3.3 are wrong.

A tapered primitive is the hull of two balls: start a, unit axis u, length l, radius r at the start and its growth k
for each metre: a sphere has l = 0, a sphylinder k = 0. All functions are compiled and take float64.
"""

# pyright: basic, reportCallIssue=false

import math
from collections.abc import Callable
from typing import Any

from vistel.jit.kernel_jit import compiled

INF = math.inf


def scalar(function: Callable[..., Any]) -> Any:
    """A function of single numbers, kept compiled on disk."""
    return compiled(nogil=True, error_model="numpy", fastmath={"contract"})(function)


@scalar
def circle_slopes(u, z, r):
    """Slopes u/z between the two tangents from the origin to a circle, of its part before the eye (z > 0)."""
    m2 = u * u + z * z
    if m2 <= r * r:
        return -INF, INF
    k = r / math.sqrt(m2 - r * r)
    low_z, high_z = z + k * u, z - k * u
    if low_z <= 0.0 and high_z <= 0.0:
        return INF, -INF
    low = (u - k * z) / low_z if low_z > 0.0 else -INF
    high = (u + k * z) / high_z if high_z > 0.0 else INF
    return low, high


@scalar
def sphere_y(cy, cz, r, perspective):
    """Y-extent of a sphere (A.1.2, with m = |C_yz|)."""
    if perspective:
        return circle_slopes(cy, cz, r)
    return cy - r, cy + r


@scalar
def sphere_x(cx, cy, cz, r, y, perspective):
    """X-extent of a sphere in the row y (A.1.3)."""
    if not perspective:
        across = r * r - (y - cy) * (y - cy)
        if across < 0.0:
            return INF, -INF
        half = math.sqrt(across)
        return cx - half, cx + half
    scale = math.sqrt(1.0 + y * y)
    s = (cy - y * cz) / scale
    across = r * r - s * s
    if across < 0.0:
        return INF, -INF
    low, high = circle_slopes(cx, (cy * y + cz) / scale, math.sqrt(across))
    return low * scale, high * scale


@scalar
def sphere_rows(cx, cy, cz, r):
    """What the X-extents of a sphere before the eye have in common for all rows under perspective; see `sphere_row`."""
    m = cx * cx + cy * cy + cz * cz - r * r
    return m, cx * cx - m, 1.0 / (cx * cx - m)


@scalar
def sphere_row(cx, cy, cz, y, m, a, over):
    """`sphere_x` under perspective for a sphere all of which is before the eye: the rays (x, y, 1) whose angle with C
    is that of the tangents, (C.D)^2 = (|C|^2 - r^2) |D|^2, solved for x."""
    b = cy * y + cz
    root = m * (b * b + a * (1.0 + y * y))
    if root < 0.0:
        return INF, -INF
    root = math.sqrt(root)
    return (-cx * b + root) * over, (-cx * b - root) * over


@scalar
def sphere_z(ox, oy, oz, dx, dy, dz, cx, cy, cz, r):
    """Z-extent of a sphere along the ray O + t D (A.1.4): the two t."""
    fx, fy, fz = cx - ox, cy - oy, cz - oz
    d2 = dx * dx + dy * dy + dz * dz
    b = (fx * dx + fy * dy + fz * dz) / d2
    fx, fy, fz = fx - b * dx, fy - b * dy, fz - b * dz
    m2 = (r * r - (fx * fx + fy * fy + fz * fz)) / d2
    if m2 < 0.0:
        return INF, -INF
    m = math.sqrt(m2)
    return b - m, b + m


@scalar
def _union(a, b):
    return min(a[0], b[0]), max(a[1], b[1])


@scalar
def nested(length, r, k):
    """Whether one ball of a tapered primitive holds the other: 1 the first, 2 the second, 0 neither."""
    if abs(k) * length < length:
        return 0
    return 1 if k <= 0.0 or length == 0.0 else 2


@scalar
def tapered_y(ax, ay, az, ux, uy, uz, length, r, k, perspective):
    """Y-extent of a sphylinder or cone-sphere: that of its two balls (A.2.2, A.3.2)."""
    first = sphere_y(ay, az, r, perspective)
    if length == 0.0:
        return first
    by, bz = ay + length * uy, az + length * uz
    if perspective and (az - r <= 0.0 or bz - r - k * length <= 0.0):
        return (-INF, INF) if max(az + r, bz + r + k * length) > 0.0 else (INF, -INF)
    return _union(first, sphere_y(by, bz, r + k * length, perspective))


@scalar
def tapered_x(ax, ay, az, ux, uy, uz, length, r, k, y, perspective):
    """X-extent of a sphylinder or cone-sphere in the row y: of its balls, and where the row's rays touch the surface
    between them (corrected A.2.3, A.3.3).

    Reaching behind the eye it is the whole row.
    """
    first = sphere_x(ax, ay, az, r, y, perspective)
    which = nested(length, r, k)
    if which == 1:
        return first
    bx, by, bz, rb = ax + length * ux, ay + length * uy, az + length * uz, r + k * length
    if which == 2:
        return sphere_x(bx, by, bz, rb, y, perspective)
    if perspective and (az - r <= 0.0 or bz - rb <= 0.0):
        return (-INF, INF) if max(az + r, bz + rb) > 0.0 else (INF, -INF)
    low, high = _union(first, sphere_x(bx, by, bz, rb, y, perspective))
    # The surface between: with W = X - A and x = W.u its points have x^2 - g |W|^2 + 2 r k x + r^2 = 0. (About the apex
    # the cone's equation is shorter, but the apex of one that hardly tapers is far away.)
    g, rk = 1.0 - k * k, r * k
    # A row's ray is w + x e: (x, y, 1) t under perspective, (x, y, t) without. Tangent where its discriminant is 0.
    if perspective:
        along = ux * ax + uy * ay + uz * az
        bx_, by_, bz_ = (along - rk) * ux - g * ax, (along - rk) * uy - g * ay, (along - rk) * uz - g * az
        c = along * along - g * (ax * ax + ay * ay + az * az) - 2.0 * rk * along + r * r
        eb, wb = bx_, y * by_ + bz_
        eu, wu = ux, y * uy + uz
        a2 = eb * eb - c * (eu * eu - g)
        a1 = eb * wb - c * eu * wu
        a0 = wb * wb - c * (wu * wu - g * (y * y + 1.0))
    else:
        m = uz * uz - g
        vy, vz = y - ay, -az
        eu, wu = ux, uy * vy + uz * vz - ux * ax
        e1, w1 = uz * eu, uz * (wu + rk) - g * vz
        a2 = e1 * e1 - m * (eu * eu - g)
        a1 = e1 * w1 - m * (eu * (wu + rk) + g * ax)
        a0 = w1 * w1 - m * (wu * wu - g * (ax * ax + vy * vy + vz * vz) + 2.0 * rk * wu + r * r)
    root = a1 * a1 - a2 * a0
    if a2 == 0.0 or root < 0.0:
        return low, high
    root = math.sqrt(root)
    # The root without cancellation, then the other from their product.
    far = -a1 - root if a1 > 0.0 else -a1 + root
    for which in range(2):
        if which == 0:
            x = far / a2
        elif far != 0.0:
            x = a0 / far
        else:
            continue
        if perspective:
            dm = (eu * x + wu) * (eu * x + wu) - g * (x * x + y * y + 1.0)
            if dm == 0.0:
                continue
            t = (eb * x + wb) / dm
            if t <= 0.0:
                continue
            gx, gy, gz = t * x - ax, t * y - ay, t - az
        else:
            if m == 0.0:
                continue
            t = -(e1 * x + w1) / m
            gx, gy, gz = x - ax, y - ay, t - az
        s = gx * ux + gy * uy + gz * uz
        radius = r + k * s
        if radius <= 0.0:
            continue
        s += k * max(gx * gx + gy * gy + gz * gz - s * s, 0.0) / radius
        if 0.0 <= s <= length:
            low, high = min(low, x), max(high, x)
    return low, high


@scalar
def tapered_z(ox, oy, oz, dx, dy, dz, ax, ay, az, ux, uy, uz, length, r, k):
    """Z-extent of a sphylinder or cone-sphere along O + t D: of its balls, and of the surface between them where the
    foot of the hit is on the axis."""
    which = nested(length, r, k)
    found = INF, -INF
    if which != 2:
        found = sphere_z(ox, oy, oz, dx, dy, dz, ax, ay, az, r)
        if which == 1:
            return found
    bx, by, bz = ax + length * ux, ay + length * uy, az + length * uz
    found = _union(found, sphere_z(ox, oy, oz, dx, dy, dz, bx, by, bz, r + k * length))
    if which == 2:
        return found
    # With x along the axis: |P - A|^2 - x^2 = (r + k x)^2 / (1 - k^2).
    fx, fy, fz = ox - ax, oy - ay, oz - az
    x0, x1 = fx * ux + fy * uy + fz * uz, dx * ux + dy * uy + dz * uz
    g = 1.0 / (1.0 - k * k)
    d0, d1 = r + k * x0, k * x1
    a2 = dx * dx + dy * dy + dz * dz - x1 * x1 - g * d1 * d1
    a1 = fx * dx + fy * dy + fz * dz - x0 * x1 - g * d0 * d1
    a0 = fx * fx + fy * fy + fz * fz - x0 * x0 - g * d0 * d0
    root = a1 * a1 - a2 * a0
    if a2 == 0.0 or root < 0.0:
        return found
    root = math.sqrt(root)
    far = -a1 - root if a1 > 0.0 else -a1 + root
    for which in range(2):
        if which == 0:
            t = far / a2
        elif far != 0.0:
            t = a0 / far
        else:
            continue
        x, radius = x0 + t * x1, d0 + t * d1
        if radius <= 0.0:
            continue
        s = x + k * radius * g
        if 0.0 <= s <= length:
            found = min(found[0], t), max(found[1], t)
    return found


@scalar
def edges_y(points, first, count, r, perspective):
    """Y-extent of balls of radius r about corners (n, 3) and what lies between them: rounded polygons, polyhedra."""
    found = INF, -INF
    for i in range(first, first + count):
        if perspective and points[i, 2] - r <= 0.0:
            return -INF, INF
        found = _union(found, sphere_y(points[i, 1], points[i, 2], r, perspective))
    return found


@scalar
def polygon_x(points, first, count, r, y, perspective):
    """X-extent of a rounded polygon: of the sphylinders about its edges (A.4)."""
    found = INF, -INF
    for i in range(count):
        a, b = first + i, first + (i + 1) % count
        ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        length = math.sqrt(ux * ux + uy * uy + uz * uz)
        over = 1.0 / length if length > 0.0 else 0.0
        one = tapered_x(points[a, 0], points[a, 1], points[a, 2], ux * over, uy * over, uz * over, length, r, 0.0, y, perspective)
        found = _union(found, one)
    return found


@scalar
def polygon_z(ox, oy, oz, dx, dy, dz, points, first, count, nx, ny, nz, r):
    """Z-extent of a rounded polygon: of the sphylinders about its edges and of its two faces at r (A.4)."""
    found = INF, -INF
    for i in range(count):
        a, b = first + i, first + (i + 1) % count
        ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        length = math.sqrt(ux * ux + uy * uy + uz * uz)
        over = 1.0 / length if length > 0.0 else 0.0
        one = tapered_z(
            ox, oy, oz, dx, dy, dz, points[a, 0], points[a, 1], points[a, 2], ux * over, uy * over, uz * over, length, r, 0.0
        )
        found = _union(found, one)
    down = dx * nx + dy * ny + dz * nz
    if down == 0.0:
        return found
    height = (points[first, 0] - ox) * nx + (points[first, 1] - oy) * ny + (points[first, 2] - oz) * nz
    for side in (-1.0, 1.0):
        t = (height + side * r) / down
        if in_polygon(ox + t * dx, oy + t * dy, oz + t * dz, points, first, count, nx, ny, nz):
            found = min(found[0], t), max(found[1], t)
    return found


@scalar
def in_polygon(x, y, z, points, first, count, nx, ny, nz):
    """Whether a point projects along N into a polygon, convex or not (even-odd rule in the plane N is largest in)."""
    ax, ay, az = abs(nx), abs(ny), abs(nz)
    i, j = (1, 2) if ax >= ay and ax >= az else ((2, 0) if ay >= az else (0, 1))
    # Move along N into the polygon's plane first.
    off = (points[first, 0] - x) * nx + (points[first, 1] - y) * ny + (points[first, 2] - z) * nz
    p = (x + off * nx, y + off * ny, z + off * nz)
    u, v = p[i], p[j]
    inside = False
    for a in range(first, first + count):
        b = a + 1 if a + 1 < first + count else first
        if (points[a, j] > v) != (points[b, j] > v):
            at = points[a, i] + (points[b, i] - points[a, i]) * (v - points[a, j]) / (points[b, j] - points[a, j])
            if u < at:
                inside = not inside
    return inside


@scalar
def mesh_x(points, edges, first, count, y, perspective):
    """X-extent of a polyhedron: of its edges cut by the row's plane. edges: (m, 2) rows of points."""
    low, high = INF, -INF
    for e in range(first, first + count):
        a, b = edges[e, 0], edges[e, 1]
        if perspective:
            if points[a, 2] <= 0.0 or points[b, 2] <= 0.0:
                return -INF, INF
            ha, hb = points[a, 1] - y * points[a, 2], points[b, 1] - y * points[b, 2]
        else:
            ha, hb = points[a, 1] - y, points[b, 1] - y
        if ha * hb > 0.0:
            continue
        f = ha / (ha - hb) if ha != hb else 0.0
        for g in (f, 1.0) if ha == hb else (f, f):
            x = points[a, 0] + g * (points[b, 0] - points[a, 0])
            z = points[a, 2] + g * (points[b, 2] - points[a, 2])
            x = x / z if perspective else x
            low, high = min(low, x), max(high, x)
    return low, high


@scalar
def mesh_z(ox, oy, oz, dx, dy, dz, points, triangles, first, count):
    """Z-extent of a polyhedron: the first and last of its triangles along O + t D. triangles: (m, 3) rows."""
    low, high = INF, -INF
    for f in range(first, first + count):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        e1x, e1y, e1z = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        e2x, e2y, e2z = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
        px, py, pz = dy * e2z - dz * e2y, dz * e2x - dx * e2z, dx * e2y - dy * e2x
        det = e1x * px + e1y * py + e1z * pz
        if det == 0.0:
            continue
        sx, sy, sz = ox - points[a, 0], oy - points[a, 1], oz - points[a, 2]
        u = (sx * px + sy * py + sz * pz) / det
        qx, qy, qz = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
        v = (dx * qx + dy * qy + dz * qz) / det
        if u < 0.0 or v < 0.0 or u + v > 1.0:
            continue
        t = (e2x * qx + e2y * qy + e2z * qz) / det
        low, high = min(low, t), max(high, t)
    return low, high
