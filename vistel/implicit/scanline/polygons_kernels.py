"""Polygons beside the implicit surface: triangles drawn row by row into a z-buffer, and depths of z-spans."""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.implicit.scanline.along_kernels import scan_inner
from vistel.implicit.scanline.eye_kernels import DX, DY, OZ, PERSPECTIVE, X0, Y0, z_extent
from vistel.implicit.scanline.sweep_kernels import kernel

NEAR = 1e-6
"""Triangles are cut off this close before the eye [m]."""


@scan_inner
def _clipped(corners, out):
    """The part of a triangle (3, 3) beyond NEAR, as a polygon in out (4, 3); its number of corners."""
    count = 0
    for i in range(3):
        a, b = corners[i], corners[(i + 1) % 3]
        if a[2] > NEAR:
            out[count] = a
            count += 1
        if (a[2] > NEAR) != (b[2] > NEAR):
            f = (NEAR - a[2]) / (b[2] - a[2])
            for k in range(2):
                out[count, k] = a[k] + f * (b[k] - a[k])
            out[count, 2] = NEAR
            count += 1
    return count


@kernel
def draw_triangles(corners, view, width, depth, owner):
    """Triangles (m, 3, 3) of eye space into depth (height, columns), from the program's origin, LARGE where there is
    none, and owner (height, columns): which triangle is nearest, -1 for none. Only what lies beyond the eye is drawn."""
    height = depth.shape[0]
    perspective = view[PERSPECTIVE] != 0.0
    part, u, v = np.empty((4, 3)), np.empty(4), np.empty(4)
    for t in range(corners.shape[0]):
        c = corners[t]
        nx = (c[1, 1] - c[0, 1]) * (c[2, 2] - c[0, 2]) - (c[1, 2] - c[0, 2]) * (c[2, 1] - c[0, 1])
        ny = (c[1, 2] - c[0, 2]) * (c[2, 0] - c[0, 0]) - (c[1, 0] - c[0, 0]) * (c[2, 2] - c[0, 2])
        nz = (c[1, 0] - c[0, 0]) * (c[2, 1] - c[0, 1]) - (c[1, 1] - c[0, 1]) * (c[2, 0] - c[0, 0])
        level = nx * c[0, 0] + ny * c[0, 1] + nz * c[0, 2]
        count = _clipped(c, part)
        if count < 3:
            continue
        low, high = math.inf, -math.inf
        for k in range(count):
            scale = part[k, 2] if perspective else 1.0
            u[k], v[k] = (part[k, 0] / scale - view[X0]) / view[DX], (part[k, 1] / scale - view[Y0]) / view[DY]
            low, high = min(low, v[k]), max(high, v[k])
        if not (low < height and high >= 0.0):
            continue
        first, last = math.ceil(max(low, 0.0)), math.ceil(min(high, float(height))) - 1
        for y in range(first, last + 1):
            a, b = math.inf, -math.inf
            for k in range(count):
                j = k + 1 if k + 1 < count else 0
                if (v[k] <= y) != (v[j] <= y):
                    # From the same end whichever way the edge runs, so that neighbours share it exactly.
                    p, q = (k, j) if v[k] < v[j] else (j, k)
                    x = u[p] + (y - v[p]) * (u[q] - u[p]) / (v[q] - v[p])
                    a, b = min(a, x), max(b, x)
            if not (a < width and b > -1.0):
                continue
            ey = view[Y0] + y * view[DY]
            for x in range(math.ceil(max(a, 0.0)), math.ceil(min(b, float(width)))):
                ex = view[X0] + x * view[DX]
                if perspective:
                    along = nx * ex + ny * ey + nz
                    z = level / along if along != 0.0 else -1.0
                else:
                    z = (level - nx * ex - ny * ey) / nz if nz != 0.0 else -1.0
                s = np.float32(z - view[OZ])
                if z > 0.0 and s < depth[y, x]:
                    depth[y, x], owner[y, x] = s, t


@kernel
def cover_depths(forms, points, triangles, rows, span_at, spans, view, wanted, near, far):
    """The z-span of each wanted pixel (height, width): from the first primitive's realm to where the last ends [m]."""
    perspective = view[PERSPECTIVE] != 0.0
    near[:] = math.inf
    far[:] = -math.inf
    for i in range(forms.shape[0]):
        for y in range(rows[i, 0], rows[i, 1] + 1):
            span = span_at[i] + y - rows[i, 0]
            ey = view[Y0] + y * view[DY]
            for x in range(spans[span, 0], spans[span, 1] + 1):
                if not wanted[y, x]:
                    continue
                ex = view[X0] + x * view[DX]
                if perspective:
                    a, b = z_extent(forms[i], points, triangles, 0.0, 0.0, 0.0, ex, ey, 1.0)
                else:
                    a, b = z_extent(forms[i], points, triangles, ex, ey, 0.0, 0.0, 0.0, 1.0)
                near[y, x], far[y, x] = min(near[y, x], a), max(far[y, x], b)


@kernel
def keep_nearer(depth, normal, other_depth, other_normal, dirty):
    """Take over, in dirty groups, pixels of another surface that lie before this one's (depths as of `sweep`)."""
    height, groups = dirty.shape
    for y in range(height):
        for g in range(groups):
            if dirty[y, g]:
                for x in range(16 * g, 16 * g + 16):
                    if other_depth[y + 2, x] < depth[y + 2, x]:
                        depth[y + 2, x] = other_depth[y + 2, x]
                        for k in range(3):
                            normal[k, y, x] = other_normal[k, y, x]
