"""The implicit surface a built-in person is cut from: offset primitives with selective blending.

Every primitive is <V, S, f> of Singh §3.1 with a *solid* skeleton S (a chain of cone-spheres, a flat-ended cone, a
superellipsoid or a loft of such sections, each shrunk by t*w) and an offset realm of depth w: with s the distance from the primitive's own surface, the distance ratio
is d = t + s/w and the field f(d) = (1 - d^2)^2, so that f = T = 1/2 exactly where s = 0. The `width` w says how far a
primitive blends, independently of its size: a fingertip can be crisp and a belly soft.

Selective blending (Singh §3.4): primitives of group 0 blend with everything, those of another group only with their own
group and group 0, so that fingers, lips and legs stay apart. `carve` subtracts softly, `cut` removes for good:

    F = min( sum(group 0) + max over groups(sum(group)) - sum(carve),  1 - max(cut) )
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numba as nb
import numpy as np
from numpy.typing import ArrayLike, NDArray

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
I32 = NDArray[np.int32]

THRESHOLD = 0.5
RATIO_AT_SURFACE = math.sqrt(1.0 - math.sqrt(THRESHOLD))
GROUPS = 28

CONE, CAPPED, ELLIPSOID, PLANE, LOFT = range(5)
ADD, CARVE, CUT = range(3)
# Columns of a primitive's row.
_KIND, _MODE, _GROUP, _WEIGHT, _WIDTH, _MATERIAL, _RA, _RB, _EXPONENT, _PART = range(10)
_CENTRE, _MATRIX, _A, _B, _LOW, _HIGH, _COLUMNS = 10, 13, 22, 25, 28, 31, 34
_LEVELS = 96  # of a loft's table
_CELL = 0.03  # of the grid that finds the primitives near a point [m]
_MARGIN = 0.002  # how far beyond its cell a point may look [m]

_MODES: dict[str, int] = {"add": ADD, "carve": CARVE, "cut": CUT}
Mode = Literal["add", "carve", "cut"]


@dataclass(frozen=True)
class Section:
    """One level of a loft: a superellipse across y, wider than deep or not, with its own front and back.

    y: level; half_width: along x, reached at z = `middle`; front, back: z of the foremost and hindmost point [m];
    squareness: exponents of the front and the back half (2: ellipse, more: boxier).
    """

    y: float
    half_width: float
    front: float
    back: float
    middle: float = 0.0
    squareness: tuple[float, float] = (2.0, 2.0)


@dataclass
class Sculpture:
    """Collects primitives; `solid` is what the kernels walk. Lengths in metres, model frame."""

    _rows: list[F64] = field(default_factory=list[F64])
    _tables: list[F64] = field(default_factory=list[F64])
    _part: int = 0

    def solid(self) -> Solid:
        """All primitives, ready to be evaluated."""
        rows = np.array(self._rows)
        tables = np.array(self._tables) if self._tables else np.zeros((1, _LEVELS, 6))
        return Solid(rows, tables, *_index(rows))

    def limb(
        self, points: Sequence[ArrayLike], radii: Sequence[float], *, width: float, material: int, group: int = 0,
        mode: Mode = "add", weight: float = 1.0, flat: tuple[ArrayLike, float] | None = None, steps: int = 5,
    ) -> None:  # fmt: skip
        """One primitive along a smooth curve through `points`, its radius going smoothly through `radii`."""
        p, r = _smooth(np.asarray(points, np.float64), steps), _smooth(np.asarray(radii, np.float64)[:, None], steps)[:, 0]
        part = self._part
        for i in range(len(p) - 1):
            self._part = part
            self.cone(p[i], p[i + 1], float(r[i]), float(r[i + 1]), width=width, material=material, group=group, mode=mode,
                      weight=weight, flat=flat)  # fmt: skip

    def cone(
        self, a: ArrayLike, b: ArrayLike, ra: float, rb: float, *, width: float, material: int, group: int = 0,
        mode: Mode = "add", weight: float = 1.0, flat: tuple[ArrayLike, float] | None = None, capped: bool = False,
    ) -> None:  # fmt: skip
        """A cone-sphere from a to b; `flat` = (axis, factor) scales its cross-section along the axis; `capped` ends flat."""
        pa, pb = np.asarray(a, np.float64), np.asarray(b, np.float64)
        # One centre for all cones of a chain would not matter: the stretch is about the chord.
        centre = 0.5 * (pa + pb)
        m = np.eye(3)
        stretch = 1.0
        if flat is not None:
            u = np.asarray(flat[0], np.float64)
            u = u / np.linalg.norm(u)
            m += (1.0 / flat[1] - 1.0) * np.outer(u, u)
            stretch = max(1.0, flat[1])
        reach = stretch * (max(ra, rb) * (1.5 if capped else 1.0)) + width * (1.0 - RATIO_AT_SURFACE)
        low, high = np.minimum(pa, pb) - reach, np.maximum(pa, pb) + reach
        self._append(CAPPED if capped else CONE, mode, group, weight, width, material, ra, rb, 2.0, centre, m,
                     m @ (pa - centre), m @ (pb - centre), low, high)  # fmt: skip

    def ellipsoid(
        self, centre: ArrayLike, radii: ArrayLike, *, width: float, material: int, group: int = 0, mode: Mode = "add",
        weight: float = 1.0, turn: F64 | None = None, exponent: float = 2.0,
    ) -> None:  # fmt: skip
        """A superellipsoid with half axes `radii` (exponent 2: ellipsoid, more: boxier); `turn` turns its axes."""
        c, r = np.asarray(centre, np.float64), np.asarray(radii, np.float64)
        q = np.eye(3) if turn is None else turn
        m = np.diag(1.0 / r) @ q.T
        reach = np.abs(q) @ r * 1.05 + 1.5 * width
        zero = np.zeros(3)
        self._append(ELLIPSOID, mode, group, weight, width, material, 1.0, 1.0, exponent, c, m, zero, zero,
                     c - reach, c + reach)  # fmt: skip

    def loft(
        self, sections: Sequence[Section], *, width: float, material: int, rounding: float, shear: float = 0.0,
        shear_about: float = 0.0, group: int = 0,
    ) -> None:  # fmt: skip
        """A body through `sections` (from the lowest up), ends rounded by `rounding`.

        With `shear`, a section is not level: its height at z is y - shear * (z - shear_about).
        """
        ys = np.array([q.y for q in sections])
        values = np.array([(q.half_width, q.middle, q.front, q.back, *q.squareness) for q in sections])
        levels = np.linspace(ys[0], ys[-1], _LEVELS)
        table = np.stack([_monotone(levels, ys, values[:, c]) for c in range(6)], axis=1)
        self._tables.append(table)
        zero = np.zeros(3)
        z0, z1 = float(table[:, 3].min()), float(table[:, 2].max())
        slope = max(abs(shear * (z0 - shear_about)), abs(shear * (z1 - shear_about)))
        half = float(table[:, 0].max())
        low = np.array((-half - width, ys[0] - slope - width, z0 - width))
        high = np.array((half + width, ys[-1] + slope + width, z1 + width))
        self._append(LOFT, "add", group, 1.0, width, material, len(self._tables) - 1, rounding, 2.0,
                     np.array((0.0, 0.0, shear_about)), np.eye(3), np.array((ys[0], ys[-1], shear)), zero, low, high)  # fmt: skip

    def plane(self, point: ArrayLike, normal: ArrayLike, *, width: float, low: ArrayLike, high: ArrayLike) -> None:
        """Cuts away everything on the side the normal points to, within the box low..high."""
        n = np.asarray(normal, np.float64)
        n = n / np.linalg.norm(n)
        zero = np.zeros(3)
        self._append(PLANE, "cut", 0, 1.0, width, 0, 0.0, 0.0, 2.0, np.asarray(point, np.float64), np.eye(3), n, zero,
                     np.asarray(low, np.float64), np.asarray(high, np.float64))  # fmt: skip

    def _append(
        self, kind: int, mode: Mode, group: int, weight: float, width: float, material: int, ra: float, rb: float,
        exponent: float, centre: F64, matrix: F64, a: F64, b: F64, low: F64, high: F64,
    ) -> None:  # fmt: skip
        if not 0 <= group < GROUPS:
            raise ValueError(f"group: expected 0 to {GROUPS - 1}, got {group}")
        row = np.empty(_COLUMNS)
        row[:_CENTRE] = (kind, _MODES[mode], group, weight, width, material, ra, rb, exponent, self._part)
        self._part = len(self._rows) + 1
        row[_CENTRE:_MATRIX], row[_MATRIX:_A] = centre, matrix.ravel()
        row[_A:_B], row[_B:_LOW], row[_LOW:_HIGH], row[_HIGH:] = a, b, low, high
        self._rows.append(row)


@dataclass(frozen=True)
class Solid:
    """Primitives and the grid that finds them: rows (P, 34), loft tables (L, 96, 6), grid origin, shape and lists."""

    rows: F64
    tables: F64
    origin: F64
    shape: I64
    starts: I64
    items: I64

    def fields(self, points: F64) -> F64:
        """(N,) field at points (N, 3)."""
        return _fields(self.rows, self.tables, self.origin, self.shape, self.starts, self.items, points)

    def gradients(self, points: F64, step: float = 4e-4) -> F64:
        """(N, 3) gradient of the field at points (N, 3) by central differences over `step` metres."""
        return _gradients(self.rows, self.tables, self.origin, self.shape, self.starts, self.items, points, step)

    def materials(self, points: F64) -> tuple[I32, I32, F64]:
        """Material (N,) of the primitive whose own surface is nearest to (or farthest outside of) each point, the next
        other material (N,) and how much farther that one is (N,) [m]."""
        return _materials(self.rows, self.tables, self.origin, self.shape, self.starts, self.items, points)

    def project(self, points: F64, *, steps: int = 6, longest: float = 0.003) -> F64:
        """The points (N, 3) moved onto the surface F = T by Newton steps along the gradient, none over `longest`."""
        p = points.copy()
        for _ in range(steps):
            g = self.gradients(p)
            g2 = np.einsum("ij,ij->i", g, g)
            move = ((THRESHOLD - self.fields(p)) / np.maximum(g2, 1e-6))[:, None] * g
            size = np.linalg.norm(move, axis=1, keepdims=True)
            p += move * np.minimum(1.0, longest / np.maximum(size, 1e-12))
        return p

    def normals(self, points: F64) -> F64:
        """(N, 3) outward unit normals at points on the surface."""
        g = -self.gradients(points)
        return g / np.maximum(np.linalg.norm(g, axis=1, keepdims=True), 1e-12)


def _smooth(values: F64, steps: int) -> F64:
    """(K, C) control values to ((K - 1) * steps + 1, C) on the Catmull-Rom curve through them."""
    ends = np.concatenate([2 * values[:1] - values[1:2], values, 2 * values[-1:] - values[-2:-1]])
    t = np.arange(steps)[:, None] / steps
    out: list[F64] = []
    for i in range(len(values) - 1):
        a, b, c, d = ends[i : i + 4]
        out.append(0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3))
    return np.concatenate([*out, values[-1:]])


def _monotone(at: F64, x: F64, y: F64) -> F64:
    """Shape-preserving cubic (Fritsch and Carlson 1980) through (x, y)."""
    h, slope = np.diff(x), np.diff(y) / np.diff(x)
    m = np.concatenate([slope[:1], 0.5 * (slope[1:] + slope[:-1]), slope[-1:]])
    flat = slope[1:] * slope[:-1] <= 0.0
    m[1:-1][flat] = 0.0
    for i in range(len(h)):
        if slope[i] == 0.0:
            m[i] = m[i + 1] = 0.0
            continue
        s = math.hypot(m[i] / slope[i], m[i + 1] / slope[i])
        if s > 3.0:
            m[i], m[i + 1] = m[i] * 3.0 / s, m[i + 1] * 3.0 / s
    i = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(h) - 1)
    t = (at - x[i]) / h[i]
    return (
        (1 + 2 * t) * (1 - t) ** 2 * y[i] + t * (1 - t) ** 2 * h[i] * m[i]
        + t**2 * (3 - 2 * t) * y[i + 1] + t**2 * (t - 1) * h[i] * m[i + 1]
    )  # fmt: skip


def boxes(rows: F64) -> tuple[F64, F64]:
    """Low and high corners (P, 3) of the boxes outside which the primitives' fields vanish."""
    return rows[:, _LOW:_HIGH], rows[:, _HIGH:_COLUMNS]


def _index(rows: F64) -> tuple[F64, I64, I64, I64]:
    """Grid origin (3,), shape (3,), start of each cell's list (C + 1,) and the rows in the lists, ascending."""
    low, high = boxes(rows)
    origin = low.min(axis=0) - _CELL
    shape = (np.ceil((high.max(axis=0) - origin) / _CELL) + 2).astype(np.int64)
    first = np.floor((low - origin - _MARGIN) / _CELL).astype(np.int64)
    last = np.floor((high - origin + _MARGIN) / _CELL).astype(np.int64)
    starts, items = _fill_index(shape, first, last)
    return origin, shape, starts, items


@nb.njit(cache=True)
def _fill_index(shape, first, last):
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


@nb.njit(cache=True, fastmath=True)
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


@nb.njit(cache=True, fastmath=True)
def _loft(row, tables, x: float, y: float, z: float) -> float:
    table = tables[int(row[_RA])]
    y0, y1, shear, rounding = row[_A], row[_A + 1], row[_A + 2], row[_RB]
    level = y + shear * (z - row[_CENTRE + 2])
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


@nb.njit(cache=True, fastmath=True)
def _distance(row, tables, x: float, y: float, z: float) -> float:
    """Distance from the primitive's surface, negative inside (first order where the primitive is stretched)."""
    kind = int(row[_KIND])
    if kind == LOFT:
        return _loft(row, tables, x, y, z)
    px, py, pz = x - row[_CENTRE], y - row[_CENTRE + 1], z - row[_CENTRE + 2]
    if kind == PLANE:
        return -(px * row[_A] + py * row[_A + 1] + pz * row[_A + 2])
    m = row[_MATRIX:_A]
    qx = m[0] * px + m[1] * py + m[2] * pz
    qy = m[3] * px + m[4] * py + m[5] * pz
    qz = m[6] * px + m[7] * py + m[8] * pz
    if kind == ELLIPSOID:
        n = row[_EXPONENT]
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
        dx, dy, dz = row[_B] - row[_A], row[_B + 1] - row[_A + 1], row[_B + 2] - row[_A + 2]
        length2 = dx * dx + dy * dy + dz * dz
        ex, ey, ez = qx - row[_A], qy - row[_A + 1], qz - row[_A + 2]
        u = (ex * dx + ey * dy + ez * dz) / max(length2, 1e-12)
        v = min(1.0, max(0.0, u))
        along = u if kind == CAPPED else v
        gx, gy, gz = ex - along * dx, ey - along * dy, ez - along * dz
        k = math.sqrt(gx * gx + gy * gy + gz * gz)
        s = k - (row[_RA] + v * (row[_RB] - row[_RA]))
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


@nb.njit(cache=True, fastmath=True)
def _blend(row, s: float) -> float:
    d = RATIO_AT_SURFACE + s / row[_WIDTH]
    if d >= 1.0:
        return 0.0
    if d <= 0.0:
        return 1.0
    u = 1.0 - d * d
    return u * u


@nb.njit(cache=True, fastmath=True)
def _field(rows, tables, active, x: float, y: float, z: float, sums) -> float:
    """Field at a point; `active` lists the rows that may reach it, ascending (the rows of a chain follow each other)."""
    common = 0.0
    carved = 0.0
    cut = 0.0
    top = 0
    i = 0
    while i < len(active):
        row = rows[active[i]]
        s = _distance(row, tables, x, y, z)
        i += 1
        while i < len(active) and rows[active[i], _PART] == row[_PART]:
            s = min(s, _distance(rows[active[i]], tables, x, y, z))
            i += 1
        f = _blend(row, s)
        if f == 0.0:
            continue
        mode = int(row[_MODE])
        if mode == CUT:
            cut = max(cut, f)
        elif mode == CARVE:
            carved += row[_WEIGHT] * f
        else:
            group = int(row[_GROUP])
            if group == 0:
                common += row[_WEIGHT] * f
            else:
                if top == 0:
                    sums[:] = 0.0
                sums[group] += row[_WEIGHT] * f
                top = 1
    if top == 1:
        common += sums.max()
    return min(common - carved, 1.0 - cut)


@nb.njit(cache=True, fastmath=True)
def field_block(
    rows: F64, tables: F64, active: I64, xs: F64, ys: F64, zs: F64, out: NDArray[np.float32]
) -> bool:
    """Fields of the rows `active` at the grid xs x ys x zs into out; says whether both sides of T occur."""
    sums = np.empty(GROUPS)
    low, high = np.inf, -np.inf
    for i in range(len(xs)):
        for j in range(len(ys)):
            for k in range(len(zs)):
                f = _field(rows, tables, active, xs[i], ys[j], zs[k], sums)
                out[i, j, k] = f
                low, high = min(low, f), max(high, f)
    return low < THRESHOLD <= high


@nb.njit(cache=True, fastmath=True)
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
        s, w = _distance(row, tables, c[0], c[1], c[2]), row[_WIDTH]
        if s - reach > (1.0 - RATIO_AT_SURFACE) * w:
            continue
        kept[count] = i
        count += 1
        if int(row[_MODE]) != ADD:
            carved = True
        elif row[_GROUP] == 0.0 and row[_WEIGHT] >= 1.0 and s + reach < -RATIO_AT_SURFACE * w:
            solid = True
    if solid and not carved:
        count = 0
    return kept[:count]


@nb.njit(cache=True)
def _near(origin, shape, starts, items, x, y, z):
    i, j, k = int((x - origin[0]) / _CELL), int((y - origin[1]) / _CELL), int((z - origin[2]) / _CELL)
    if not (0 <= i < shape[0] and 0 <= j < shape[1] and 0 <= k < shape[2]):
        return items[:0]
    cell = (i * shape[1] + j) * shape[2] + k
    return items[starts[cell] : starts[cell + 1]]


@nb.njit(cache=True, fastmath=True)
def _fields(rows, tables, origin, shape, starts, items, points):
    out = np.empty(len(points))
    sums = np.empty(GROUPS)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        out[i] = _field(rows, tables, _near(origin, shape, starts, items, x, y, z), x, y, z, sums)
    return out


@nb.njit(cache=True, fastmath=True)
def _gradients(rows, tables, origin, shape, starts, items, points, step):
    out = np.empty((len(points), 3))
    sums = np.empty(GROUPS)
    h = 0.5 / step
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        near = _near(origin, shape, starts, items, x, y, z)
        out[i, 0] = h * (
            _field(rows, tables, near, x + step, y, z, sums) - _field(rows, tables, near, x - step, y, z, sums)
        )
        out[i, 1] = h * (
            _field(rows, tables, near, x, y + step, z, sums) - _field(rows, tables, near, x, y - step, z, sums)
        )
        out[i, 2] = h * (
            _field(rows, tables, near, x, y, z + step, sums) - _field(rows, tables, near, x, y, z - step, sums)
        )
    return out


@nb.njit(cache=True, fastmath=True)
def _materials(rows, tables, origin, shape, starts, items, points):
    first = np.zeros(len(points), np.int32)
    second = np.zeros(len(points), np.int32)
    margin = np.empty(len(points))
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        best = 1.0
        other = 1.0
        for r in _near(origin, shape, starts, items, x, y, z):
            row = rows[r]
            if int(row[_MODE]) != ADD:
                continue
            s, m = _distance(row, tables, x, y, z), int(row[_MATERIAL])
            if s < best:
                if m != first[i]:
                    second[i], other = first[i], best
                first[i], best = m, s
            elif m != first[i] and s < other:
                second[i], other = m, s
        margin[i] = other - best
    return first, second, margin
