"""Kernels of the field of `vistel.figure.people.field`: distances, blends, and lists of the primitives near a point."""

# pyright: basic

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.implicit.constants import SURFACE_RATIO, THRESHOLD
from vistel.jit.kernel_jit import compiled, inner

GROUPS = 28

# Kinds of primitives.
CONE = 0  # cone-sphere
CAPPED = 1  # cone with flat ends
ELLIPSOID = 2  # or superellipsoid
PLANE = 3
LOFT = 4  # superellipses stacked along y

# What a primitive does to the field.
ADD = 0
CARVE = 1  # subtracts softly
CUT = 2  # removes for good

# Columns of a primitive's row.
KIND = 0
MODE = 1
GROUP = 2  # of selective blending
WEIGHT = 3
WIDTH = 4  # of the blend [m]
MATERIAL = 5
RA = 6  # radius at A [m]; of a loft: number of its table
RB = 7  # radius at B [m]; of a loft: rounding of its ends [m]
EXPONENT = 8  # of a superellipsoid
PART = 9  # equal in primitives of one chain, of which the nearest counts
CENTRE = 10  # 3 columns [m]
MATRIX = 13  # 9 columns: to the primitive's own frame, by rows
A = 22  # 3 columns: the axis' beginning in that frame [m]; a plane's normal; of a loft lowest and highest y [m] and shear
B = 25  # 3 columns: the axis' end in that frame [m]
LOW = 28  # 3 columns: lower corner of its bounds [m]
HIGH = 31  # 3 columns: upper corner [m]
COLUMNS = 34
LEVELS = 96  # of a loft's table
CELL = 0.03  # of the grid that finds the primitives near a point [m]
MARGIN = 0.002  # how far beyond its cell a point may look [m]
_CELLS = 5
"""Cells along each side of the parts of a block that are looked at or left out."""
_UNKNOWN = -1e9
"""Less than any field."""


@compiled
def fill_index(shape, first, last):
    """Which primitives are near each cell of a grid of `shape` (3,): starts (cells + 1,) and items. first, last: (N, 3) cells that
    each primitive's bounds reach."""
    counts = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int64)
    items = np.empty(0, np.int64)
    for turn in range(2):
        for r in range(len(first)):
            for i in range(first[r, 0], last[r, 0] + 1):
                for j in range(first[r, 1], last[r, 1] + 1):
                    for k in range(first[r, 2], last[r, 2] + 1):
                        cell = (i * shape[1] + j) * shape[2] + k
                        if turn == 0:
                            counts[cell + 1] += 1
                        else:
                            items[counts[cell]] = r
                            counts[cell] += 1
        if turn == 0:
            counts = np.cumsum(counts)
            items = np.empty(counts[-1], np.int64)
    starts = np.empty_like(counts)
    starts[0] = 0
    starts[1:] = counts[:-1]
    return starts, items


@compiled(fastmath=True)
def _section(table, at: float, x: float, z: float):
    """Superellipse ratio k at level `at` of a loft and its x and z derivatives."""
    level = min(len(table) - 1.000001, max(0.0, at))
    i = int(level)
    u = level - i
    a = table[i, 0] + u * (table[i + 1, 0] - table[i, 0])
    dz = z - (table[i, 1] + u * (table[i + 1, 1] - table[i, 1]))
    c = 2 if dz > 0.0 else 3
    b = abs(table[i, c] + u * (table[i + 1, c] - table[i, c]) - (z - dz))
    c += 2
    n = table[i, c] + u * (table[i + 1, c] - table[i, c])
    qx, qz = abs(x) / a, abs(dz) / b
    k = (qx**n + qz**n) ** (1.0 / n)
    if k < 1e-6:
        return 1e-6, 0.0, 1.0 / b
    return k, math.copysign((qx / k) ** (n - 1.0), x) / a, math.copysign((qz / k) ** (n - 1.0), dz) / b


@compiled(fastmath=True)
def _loft(row, tables, x: float, y: float, z: float) -> float:
    table = tables[int(row[RA])]
    y0, y1, shear, rounding = row[A], row[A + 1], row[A + 2], row[RB]
    level = y + shear * (z - row[CENTRE + 2])
    per_metre = (len(table) - 1) / (y1 - y0)
    at = (level - y0) * per_metre
    k, kx, kz = _section(table, at, x, z)
    above, _, _ = _section(table, at + 0.5, x, z)
    below, _, _ = _section(table, at - 0.5, x, z)
    ky = (above - below) * per_metre
    kz += shear * ky
    side = (k - 1.0) / math.sqrt(kx * kx + ky * ky + kz * kz)
    end = max(y0 - level, level - y1) / math.sqrt(1.0 + shear * shear)
    u, v = side + rounding, end + rounding
    if u > 0.0 and v > 0.0:
        return math.sqrt(u * u + v * v) - rounding
    return max(side, end)


@compiled(fastmath=True)
def _distance(row, tables, x: float, y: float, z: float) -> float:
    """Distance from the primitive's surface, negative inside (first order where the primitive is stretched)."""
    kind = int(row[KIND])
    if kind == LOFT:
        return _loft(row, tables, x, y, z)
    px, py, pz = x - row[CENTRE], y - row[CENTRE + 1], z - row[CENTRE + 2]
    if kind == PLANE:
        return -(px * row[A] + py * row[A + 1] + pz * row[A + 2])
    m = row[MATRIX:A]
    qx = m[0] * px + m[1] * py + m[2] * pz
    qy = m[3] * px + m[4] * py + m[5] * pz
    qz = m[6] * px + m[7] * py + m[8] * pz
    if kind == ELLIPSOID:
        n = row[EXPONENT]
        if n == 2.0:
            k = math.sqrt(qx * qx + qy * qy + qz * qz)
            if k < 1e-9:
                return -1.0
            gx, gy, gz = qx / k, qy / k, qz / k
        else:
            ax, ay, az = abs(qx), abs(qy), abs(qz)
            k = (ax**n + ay**n + az**n) ** (1.0 / n)
            if k < 1e-9:
                return -1.0
            gx = math.copysign((ax / k) ** (n - 1.0), qx)
            gy = math.copysign((ay / k) ** (n - 1.0), qy)
            gz = math.copysign((az / k) ** (n - 1.0), qz)
        s = k - 1.0
    else:
        dx, dy, dz = row[B] - row[A], row[B + 1] - row[A + 1], row[B + 2] - row[A + 2]
        length2 = dx * dx + dy * dy + dz * dz
        ex, ey, ez = qx - row[A], qy - row[A + 1], qz - row[A + 2]
        u = (ex * dx + ey * dy + ez * dz) / max(length2, 1e-12)
        v = min(1.0, max(0.0, u))
        along = u if kind == CAPPED else v
        gx, gy, gz = ex - along * dx, ey - along * dy, ez - along * dz
        k = math.sqrt(gx * gx + gy * gy + gz * gz)
        s = k - (row[RA] + v * (row[RB] - row[RA]))
        if k > 1e-9:
            gx, gy, gz = gx / k, gy / k, gz / k
        if kind == CAPPED:
            # The flat ends are planes across the axis; where they are farther than the side, they rule.
            length = math.sqrt(length2)
            end = max(-u, u - 1.0) * length
            if end > s:
                s = end
                gx, gy, gz = dx / length, dy / length, dz / length
    # |grad s| in the model frame = |M^T g|.
    hx = m[0] * gx + m[3] * gy + m[6] * gz
    hy = m[1] * gx + m[4] * gy + m[7] * gz
    hz = m[2] * gx + m[5] * gy + m[8] * gz
    return s / max(1e-9, math.sqrt(hx * hx + hy * hy + hz * hz))


@compiled(fastmath=True)
def _blend(row, s: float) -> float:
    d = SURFACE_RATIO + s / row[WIDTH]
    if d >= 1.0:
        return 0.0
    if d <= 0.0:
        return 1.0
    u = 1.0 - d * d
    return u * u


@compiled(fastmath=True)
def _field(rows, tables, active, x: float, y: float, z: float, sums) -> float:
    """Field at a point; `active` lists the rows that may reach it, ascending (the rows of a chain are neighbours)."""
    common = 0.0
    carved = 0.0
    cut = 0.0
    top = 0
    i = 0
    while i < len(active):
        row = rows[active[i]]
        s = _distance(row, tables, x, y, z)
        i += 1
        while i < len(active) and rows[active[i], PART] == row[PART]:
            s = min(s, _distance(rows[active[i]], tables, x, y, z))
            i += 1
        f = _blend(row, s)
        if f == 0.0:
            continue
        mode = int(row[MODE])
        if mode == CUT:
            cut = max(cut, f)
        elif mode == CARVE:
            carved += row[WEIGHT] * f
        else:
            group = int(row[GROUP])
            if group == 0:
                common += row[WEIGHT] * f
            else:
                if top == 0:
                    sums[:] = 0.0
                sums[group] += row[WEIGHT] * f
                top = 1
    if top == 1:
        common += sums.max()
    return min(common - carved, 1.0 - cut)


@compiled(fastmath=True)
def field_block_rows(rows: F64, tables: F64, active: I64, low: F64, high: F64) -> I64:
    """Which of the rows `active` can shape the surface inside the box low..high; none where it cannot be there."""
    c = 0.5 * (low + high)
    # The distances are of first order: half as much again is a safe reach for their growth over the box.
    reach = 0.75 * math.sqrt(((high - low) ** 2).sum())
    kept = np.empty(len(active), np.int64)
    count = 0
    solid = False
    carved = False
    for i in active:
        row = rows[i]
        s, w = _distance(row, tables, c[0], c[1], c[2]), row[WIDTH]
        if s - reach > (1.0 - SURFACE_RATIO) * w:
            continue
        kept[count] = i
        count += 1
        if int(row[MODE]) != ADD:
            carved = True
        elif row[GROUP] == 0.0 and row[WEIGHT] >= 1.0 and s + reach < -SURFACE_RATIO * w:
            solid = True
    if solid and not carved:
        count = 0
    return kept[:count]


@compiled(fastmath=True)
def field_block(rows: F64, tables: F64, active: I64, xs: F64, ys: F64, zs: F64, out: NDArray[np.float32]) -> bool:
    """Fields of the rows `active` at the grid xs x ys x zs into out; says whether both sides of T occur.

    In cells where the surface cannot be, only the side of T is as it should.
    """
    sums = np.empty(GROUPS)
    low, high = np.inf, -np.inf
    out[:] = _UNKNOWN
    for i in range(0, len(xs) - 1, _CELLS):
        for j in range(0, len(ys) - 1, _CELLS):
            for k in range(0, len(zs) - 1, _CELLS):
                x, y, z = xs[i : i + _CELLS + 1], ys[j : j + _CELLS + 1], zs[k : k + _CELLS + 1]
                near = field_block_rows(rows, tables, active, np.array((x[0], y[0], z[0])), np.array((x[-1], y[-1], z[-1])))
                if len(near) == 0:
                    continue
                for a in range(len(x)):
                    for b in range(len(y)):
                        for c in range(len(z)):
                            if out[i + a, j + b, k + c] == _UNKNOWN:
                                f = _field(rows, tables, near, x[a], y[b], z[c], sums)
                                out[i + a, j + b, k + c] = f
                                low, high = min(low, f), max(high, f)
    if not low < THRESHOLD <= high:
        return False
    for i in range(len(xs)):
        for j in range(len(ys)):
            for k in range(len(zs)):
                if out[i, j, k] == _UNKNOWN:
                    # No cell that has this sample has the surface: its neighbours are on the same side.
                    if k > 0:
                        out[i, j, k] = out[i, j, k - 1]
                    elif j > 0:
                        out[i, j, k] = out[i, j - 1, k]
                    elif i > 0:
                        out[i, j, k] = out[i - 1, j, k]
                    else:
                        out[i, j, k] = _field(rows, tables, active, xs[i], ys[j], zs[k], sums)
    return True


@inner
def _near(origin, shape, starts, items, x, y, z):
    i, j, k = int((x - origin[0]) / CELL), int((y - origin[1]) / CELL), int((z - origin[2]) / CELL)
    if not (0 <= i < shape[0] and 0 <= j < shape[1] and 0 <= k < shape[2]):
        return items[:0]
    cell = (i * shape[1] + j) * shape[2] + k
    return items[starts[cell] : starts[cell + 1]]


@compiled(fastmath=True)
def fields_at(rows, tables, origin, shape, starts, items, points):
    """(N,) field at points (N, 3) [m]."""
    out = np.empty(len(points))
    sums = np.empty(GROUPS)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        out[i] = _field(rows, tables, _near(origin, shape, starts, items, x, y, z), x, y, z, sums)
    return out


@compiled(fastmath=True)
def gradients_at(rows, tables, origin, shape, starts, items, points, step):
    """(N, 3) gradient of the field at points (N, 3) [1/m], by central differences over `step` [m]."""
    out = np.empty((len(points), 3))
    sums = np.empty(GROUPS)
    h = 0.5 / step
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        near = _near(origin, shape, starts, items, x, y, z)
        out[i, 0] = h * (_field(rows, tables, near, x + step, y, z, sums) - _field(rows, tables, near, x - step, y, z, sums))
        out[i, 1] = h * (_field(rows, tables, near, x, y + step, z, sums) - _field(rows, tables, near, x, y - step, z, sums))
        out[i, 2] = h * (_field(rows, tables, near, x, y, z + step, sums) - _field(rows, tables, near, x, y, z - step, sums))
    return out


@compiled(fastmath=True)
def materials_at(rows, tables, origin, shape, starts, items, points):
    """(N,) first and second material at points (N, 3), and by how much the first is ahead."""
    first = np.zeros(len(points), np.int32)
    second = np.zeros(len(points), np.int32)
    margin = np.empty(len(points))
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        best = 1.0
        other = 1.0
        for r in _near(origin, shape, starts, items, x, y, z):
            row = rows[r]
            if int(row[MODE]) != ADD:
                continue
            s, m = _distance(row, tables, x, y, z), int(row[MATERIAL])
            if s < best:
                if m != first[i]:
                    second[i], other = first[i], best
                first[i], best = m, s
            elif m != first[i] and s < other:
                second[i], other = m, s
        margin[i] = other - best
    return first, second, margin
