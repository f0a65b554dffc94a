"""The implicit surface a built-in person is cut from: offset primitives with selective blending.

Every primitive is <V, S, f> of Singh §3.1 with a *solid* skeleton S (a cone-sphere, flat-ended cone or superellipsoid
shrunk by t*w) and an offset realm of depth w: with s the distance from the primitive's own surface, the distance ratio
is d = t + s/w and the field f(d) = (1 - d^2)^2, so that f = T = 1/2 exactly where s = 0. The `width` w says how far a
primitive blends, independently of its size: a fingertip can be crisp and a belly soft.

Selective blending (Singh §3.4): primitives of group 0 blend with everything, those of another group only with their own
group and group 0, so that fingers, lips and legs stay apart. `carve` subtracts softly, `cut` removes for good:

    F = min( sum(group 0) + max over groups(sum(group)) - sum(carve),  1 - max(cut) )
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numba as nb
import numpy as np
from numpy.typing import ArrayLike, NDArray

F64 = NDArray[np.float64]

THRESHOLD = 0.5
RATIO_AT_SURFACE = math.sqrt(1.0 - math.sqrt(THRESHOLD))
GROUPS = 32

CONE, CAPPED, ELLIPSOID, PLANE = range(4)
ADD, CARVE, CUT = range(3)
# Columns of a primitive's row.
_KIND, _MODE, _GROUP, _WEIGHT, _WIDTH, _MATERIAL, _RA, _RB, _EXPONENT = range(9)
_CENTRE, _MATRIX, _A, _B, _LOW, _HIGH, _COLUMNS = 9, 12, 21, 24, 27, 30, 33

_MODES: dict[str, int] = {"add": ADD, "carve": CARVE, "cut": CUT}
Mode = Literal["add", "carve", "cut"]


@dataclass
class Sculpture:
    """Collects primitives; `rows` is what the kernels walk. Lengths in metres, model frame."""

    _rows: list[F64] = field(default_factory=list[F64])

    def rows(self) -> F64:
        """(P, 33) all primitives."""
        return np.array(self._rows)

    def cone(
        self, a: ArrayLike, b: ArrayLike, ra: float, rb: float, *, width: float, material: int, group: int = 0,
        mode: Mode = "add", weight: float = 1.0, flat: tuple[ArrayLike, float] | None = None, capped: bool = False,
    ) -> None:  # fmt: skip
        """A cone-sphere from a to b; `flat` = (axis, factor) scales its cross-section along the axis; `capped` ends flat."""
        pa, pb = np.asarray(a, np.float64), np.asarray(b, np.float64)
        centre = 0.5 * (pa + pb)
        m = np.eye(3)
        stretch = 1.0
        if flat is not None:
            u = np.asarray(flat[0], np.float64)
            u = u / np.linalg.norm(u)
            m += (1.0 / flat[1] - 1.0) * np.outer(u, u)
            stretch = max(1.0, flat[1])
        reach = stretch * (max(ra, rb) * (1.5 if capped else 1.0)) + width
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
        reach = np.abs(q) @ r * (1.25 if exponent > 2.0 else 1.0) + width
        zero = np.zeros(3)
        self._append(ELLIPSOID, mode, group, weight, width, material, 1.0, 1.0, exponent, c, m, zero, zero,
                     c - reach, c + reach)  # fmt: skip

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
        row[:_CENTRE] = (kind, _MODES[mode], group, weight, width, material, ra, rb, exponent)
        row[_CENTRE:_MATRIX], row[_MATRIX:_A] = centre, matrix.ravel()
        row[_A:_B], row[_B:_LOW], row[_LOW:_HIGH], row[_HIGH:] = a, b, low, high
        self._rows.append(row)


def boxes(rows: F64) -> tuple[F64, F64]:
    """Low and high corners (P, 3) of the boxes outside which the primitives' fields vanish."""
    return rows[:, _LOW:_HIGH], rows[:, _HIGH:_COLUMNS]


@nb.njit(cache=True, fastmath=True)
def _distance(row, x: float, y: float, z: float) -> float:
    """Distance from the primitive's surface, negative inside (first order where the primitive is stretched)."""
    kind = int(row[_KIND])
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
def _field(rows, active, count: int, x: float, y: float, z: float, sums) -> float:
    common = 0.0
    carved = 0.0
    cut = 0.0
    sums[:] = 0.0
    for i in range(count):
        row = rows[active[i]]
        f = _blend(row, _distance(row, x, y, z))
        if f == 0.0:
            continue
        mode = int(row[_MODE])
        if mode == CUT:
            cut = max(cut, f)
        elif mode == CARVE:
            carved += row[_WEIGHT] * f
        elif row[_GROUP] == 0.0:
            common += row[_WEIGHT] * f
        else:
            sums[int(row[_GROUP])] += row[_WEIGHT] * f
    best = 0.0
    for g in range(1, GROUPS):
        best = max(best, sums[g])
    return min(common + best - carved, 1.0 - cut)


@nb.njit(cache=True, fastmath=True)
def _touching(rows, lx, ly, lz, hx, hy, hz, active) -> int:
    count = 0
    for i in range(len(rows)):
        r = rows[i]
        if (
            r[_LOW] <= hx and r[_HIGH] >= lx and r[_LOW + 1] <= hy and r[_HIGH + 1] >= ly
            and r[_LOW + 2] <= hz and r[_HIGH + 2] >= lz
        ):  # fmt: skip
            active[count] = i
            count += 1
    return count


@nb.njit(cache=True, fastmath=True)
def field_block(rows: F64, xs: F64, ys: F64, zs: F64, out: NDArray[np.float32]) -> bool:
    """Fields at the grid xs x ys x zs into out (len(xs), len(ys), len(zs)); says whether both sides of T occur."""
    active = np.empty(len(rows), np.int64)
    sums = np.empty(GROUPS)
    count = _touching(rows, xs[0], ys[0], zs[0], xs[-1], ys[-1], zs[-1], active)
    if count == 0:
        return False
    low, high = np.inf, -np.inf
    for i in range(len(xs)):
        for j in range(len(ys)):
            for k in range(len(zs)):
                f = _field(rows, active, count, xs[i], ys[j], zs[k], sums)
                out[i, j, k] = f
                low, high = min(low, f), max(high, f)
    return low < THRESHOLD <= high


@nb.njit(cache=True, fastmath=True)
def fields(rows: F64, points: F64) -> F64:
    """(N,) field at points (N, 3)."""
    out = np.empty(len(points))
    active = np.empty(len(rows), np.int64)
    sums = np.empty(GROUPS)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        count = _touching(rows, x, y, z, x, y, z, active)
        out[i] = _field(rows, active, count, x, y, z, sums)
    return out


@nb.njit(cache=True, fastmath=True)
def gradients(rows: F64, points: F64, step: float) -> F64:
    """(N, 3) gradient of the field by central differences over `step` metres."""
    out = np.empty((len(points), 3))
    active = np.empty(len(rows), np.int64)
    sums = np.empty(GROUPS)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        count = _touching(rows, x - step, y - step, z - step, x + step, y + step, z + step, active)
        h = 0.5 / step
        out[i, 0] = h * (
            _field(rows, active, count, x + step, y, z, sums) - _field(rows, active, count, x - step, y, z, sums)
        )
        out[i, 1] = h * (
            _field(rows, active, count, x, y + step, z, sums) - _field(rows, active, count, x, y - step, z, sums)
        )
        out[i, 2] = h * (
            _field(rows, active, count, x, y, z + step, sums) - _field(rows, active, count, x, y, z - step, sums)
        )
    return out


@nb.njit(cache=True, fastmath=True)
def materials(rows: F64, points: F64) -> NDArray[np.int32]:
    """(N,) material of the primitive whose own surface is nearest outside-most (smallest distance in its widths)."""
    out = np.zeros(len(points), np.int32)
    active = np.empty(len(rows), np.int64)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        count = _touching(rows, x, y, z, x, y, z, active)
        best = np.inf
        for c in range(count):
            row = rows[active[c]]
            if int(row[_MODE]) != ADD:
                continue
            s = _distance(row, x, y, z)
            if s < best:
                best = s
                out[i] = int(row[_MATERIAL])
    return out


def project(rows: F64, points: F64, *, steps: int = 6, step: float = 4e-4, longest: float = 0.004) -> F64:
    """The points (N, 3) moved onto the surface F = T by Newton steps along the gradient, none longer than `longest`."""
    p = points.copy()
    for _ in range(steps):
        g = gradients(rows, p, step)
        g2 = np.einsum("ij,ij->i", g, g)
        move = ((THRESHOLD - fields(rows, p)) / np.maximum(g2, 1e-6))[:, None] * g
        size = np.linalg.norm(move, axis=1, keepdims=True)
        p += move * np.minimum(1.0, longest / np.maximum(size, 1e-12))
    return p
