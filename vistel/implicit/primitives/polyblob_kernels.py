"""Kernel of polyblobs: closest point of the core, then where the ray through the point leaves the hull.

Numbers: core triangles n, hull triangles m, 1 for a convex hull; n rows of 30 (corners 9, normals of the features 21);
m rows of 13 (normal 3, level, corners 9).
"""

# pyright: basic, reportCallIssue=false

from vistel.implicit.rows.row_kernels import F32, row
from vistel.jit.numbers import ONE, TWO, ZERO
from vistel.jit.pointers import at

LARGE = F32(3e38)
CORE_WORDS = 30
"""Numbers of a triangle of the core."""
HULL_WORDS = 13
"""Numbers of a triangle of the hull."""
SLACK = F32(-1e-5)


@row
def closest_on_triangle(t, x, y, z):
    """Barycentric v, w of the closest point A + v AB + w AC of a triangle, and its feature (see `polyblob`)."""
    abx, aby, abz = t[3] - t[0], t[4] - t[1], t[5] - t[2]
    acx, acy, acz = t[6] - t[0], t[7] - t[1], t[8] - t[2]
    px, py, pz = x - t[0], y - t[1], z - t[2]
    d1, d2 = abx * px + aby * py + abz * pz, acx * px + acy * py + acz * pz
    if d1 <= ZERO and d2 <= ZERO:
        return ZERO, ZERO, 4
    px, py, pz = x - t[3], y - t[4], z - t[5]
    d3, d4 = abx * px + aby * py + abz * pz, acx * px + acy * py + acz * pz
    if d3 >= ZERO and d4 <= d3:
        return ONE, ZERO, 5
    vc = d1 * d4 - d3 * d2
    if vc <= ZERO and d1 >= ZERO and d3 <= ZERO:
        return d1 / (d1 - d3), ZERO, 1
    px, py, pz = x - t[6], y - t[7], z - t[8]
    d5, d6 = abx * px + aby * py + abz * pz, acx * px + acy * py + acz * pz
    if d6 >= ZERO and d5 <= d6:
        return ZERO, ONE, 6
    vb = d5 * d2 - d1 * d6
    if vb <= ZERO and d2 >= ZERO and d6 <= ZERO:
        return ZERO, d2 / (d2 - d6), 3
    va = d3 * d6 - d5 * d4
    if va <= ZERO and d4 - d3 >= ZERO and d5 - d6 >= ZERO:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return ONE - w, w, 2
    total = va + vb + vc
    return vb / total, vc / total, 0


@row
def _leaving(hull, m, convex, qx, qy, qz, dx, dy, dz):
    """The hull triangle by which the ray q + t d leaves, and t; among those it misses the one it misses least."""
    found, best = 0, ZERO if convex else LARGE
    nearest, miss = 0, -LARGE
    for k in range(m):
        h = at(hull, HULL_WORDS * k)
        along = h[0] * dx + h[1] * dy + h[2] * dz
        reach = h[3] - (h[0] * qx + h[1] * qy + h[2] * qz)
        if convex:
            v = along / reach
            if v > best:
                found, best = k, v
            continue
        if along == ZERO:
            continue
        t = reach / along
        if t <= ZERO:
            continue
        # Where the ray meets the plane, by signed areas against the normal.
        hx, hy, hz = qx + t * dx, qy + t * dy, qz + t * dz
        least = LARGE
        area = ZERO
        for i in range(3):
            a, b = 4 + 3 * i, 4 + 3 * ((i + 1) % 3)
            ux, uy, uz = h[b] - h[a], h[b + 1] - h[a + 1], h[b + 2] - h[a + 2]
            vx, vy, vz = hx - h[a], hy - h[a + 1], hz - h[a + 2]
            s = h[0] * (uy * vz - uz * vy) + h[1] * (uz * vx - ux * vz) + h[2] * (ux * vy - uy * vx)
            least = min(least, s)
            area += s
        least /= area
        if least >= SLACK and t < best:
            found, best = k, t
        if least > miss:
            nearest, miss = k, least
    if not convex and best == LARGE:
        found = nearest
    return found


@row
def polyblob(p, x, y, z, u, gx, gy, gz, n, slope):
    """u of a polyblob."""
    count, m, convex = int(p[0]), int(p[1]), p[2] != ZERO
    core = at(p, 3)
    hull = at(p, 3 + CORE_WORDS * count)
    for i in range(n):
        px, py, pz = x[i], y[i], z[i]
        nearest, which, feature = LARGE, 0, 0
        qx, qy, qz = px, py, pz
        for k in range(count):
            t = at(core, CORE_WORDS * k)
            v, w, f = closest_on_triangle(t, px, py, pz)
            cx = t[0] + v * (t[3] - t[0]) + w * (t[6] - t[0])
            cy = t[1] + v * (t[4] - t[1]) + w * (t[7] - t[1])
            cz = t[2] + v * (t[5] - t[2]) + w * (t[8] - t[2])
            d2 = (px - cx) * (px - cx) + (py - cy) * (py - cy) + (pz - cz) * (pz - cz)
            if d2 < nearest:
                nearest, which, feature, qx, qy, qz = d2, k, f, cx, cy, cz
        t = at(core, CORE_WORDS * which)
        normal = at(t, 9 + 3 * feature)
        dx, dy, dz = px - qx, py - qy, pz - qz
        u[i] = ZERO
        if slope:
            gx[i], gy[i], gz[i] = ZERO, ZERO, ZERO
        if normal[0] * dx + normal[1] * dy + normal[2] * dz <= ZERO:
            continue
        h = at(hull, HULL_WORDS * _leaving(hull, m, convex, qx, qy, qz, dx, dy, dz))
        nx, ny, nz = h[0], h[1], h[2]
        reach = h[3] - (nx * qx + ny * qy + nz * qz)
        d = (nx * dx + ny * dy + nz * dz) / reach
        u[i] = d * d
        if not slope:
            continue
        # J N: the hull's normal projected on the tangent space of the core's feature.
        jx, jy, jz = ZERO, ZERO, ZERO
        if feature == 0:
            s = normal[0] * nx + normal[1] * ny + normal[2] * nz
            jx, jy, jz = nx - s * normal[0], ny - s * normal[1], nz - s * normal[2]
        elif feature < 4:
            a, b = 3 * (feature - 1), 3 * (feature % 3)
            ex, ey, ez = t[b] - t[a], t[b + 1] - t[a + 1], t[b + 2] - t[a + 2]
            s = (ex * nx + ey * ny + ez * nz) / (ex * ex + ey * ey + ez * ez)
            jx, jy, jz = s * ex, s * ey, s * ez
        s = TWO * d / reach
        gx[i] = s * (nx - (ONE - d) * jx)
        gy[i] = s * (ny - (ONE - d) * jy)
        gz[i] = s * (nz - (ONE - d) * jz)
