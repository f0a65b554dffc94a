"""The implicit surface a built-in person is cut from: offset primitives with selective blending.

Every primitive is <V, S, f> of Singh §3.1 with a *solid* skeleton S (a chain of cone-spheres, a flat-ended cone, a
superellipsoid or a loft of such sections, each shrunk by t*w) and an offset realm of depth w: with s the distance from
the primitive's own surface, the distance ratio is d = t + s/w and the field f(d) = (1 - d^2)^2, so that f = T = 1/2
exactly where s = 0. The `width` w says how far a primitive blends, independently of its size: a fingertip can be crisp
and a belly soft.

Selective blending (Singh §3.4): primitives of group 0 blend with everything, those of another group only with their own
group and group 0, so that fingers, lips and legs stay apart. `carve` subtracts softly, `cut` removes for good:

    F = min( sum(group 0) + max over groups(sum(group)) - sum(carve),  1 - max(cut) )
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from vistel.arrays import F64, I32, I64
from vistel.figure.people import field_kernels
from vistel.figure.people.field_kernels import (
    ADD,
    CAPPED,
    CARVE,
    CELL,
    CENTRE,
    COLUMNS,
    CONE,
    CUT,
    ELLIPSOID,
    GROUPS,
    HIGH,
    LEVELS,
    LOFT,
    LOW,
    MARGIN,
    MATRIX,
    PLANE,
    A,
    B,
)
from vistel.implicit.constants import SURFACE_RATIO, THRESHOLD

_kernels: Any = field_kernels

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
        tables = np.array(self._tables) if self._tables else np.zeros((1, LEVELS, 6))
        return Solid(rows, tables, *_index(rows))

    def limb(
        self,
        points: Sequence[ArrayLike],
        radii: Sequence[float],
        *,
        width: float,
        material: int,
        group: int = 0,
        mode: Mode = "add",
        weight: float = 1.0,
        flat: tuple[ArrayLike, float] | None = None,
        steps: int = 5,
    ) -> None:
        """One primitive along a smooth curve through `points`, its radius going smoothly through `radii`."""
        p, r = (_smooth(np.asarray(points, np.float64), steps), _smooth(np.asarray(radii, np.float64)[:, None], steps)[:, 0])
        part = self._part
        for i in range(len(p) - 1):
            self._part = part
            self.cone(
                p[i],
                p[i + 1],
                float(r[i]),
                float(r[i + 1]),
                width=width,
                material=material,
                group=group,
                mode=mode,
                weight=weight,
                flat=flat,
            )

    def cone(
        self,
        a: ArrayLike,
        b: ArrayLike,
        ra: float,
        rb: float,
        *,
        width: float,
        material: int,
        group: int = 0,
        mode: Mode = "add",
        weight: float = 1.0,
        flat: tuple[ArrayLike, float] | None = None,
        capped: bool = False,
    ) -> None:
        """A cone-sphere from a to b; `flat` = (axis, factor) scales its section along the axis; `capped` ends flat."""
        pa, pb = np.asarray(a, np.float64), np.asarray(b, np.float64)
        centre = 0.5 * (pa + pb)
        m = np.eye(3)
        stretch = 1.0
        if flat is not None:
            u = np.asarray(flat[0], np.float64)
            u = u / np.linalg.norm(u)
            m += (1.0 / flat[1] - 1.0) * np.outer(u, u)
            stretch = max(1.0, flat[1])
        reach = stretch * (max(ra, rb) * (1.5 if capped else 1.0)) + width * (1.0 - SURFACE_RATIO)
        low, high = np.minimum(pa, pb) - reach, np.maximum(pa, pb) + reach
        self._append(
            CAPPED if capped else CONE,
            mode,
            group,
            weight,
            width,
            material,
            ra,
            rb,
            2.0,
            centre,
            m,
            m @ (pa - centre),
            m @ (pb - centre),
            low,
            high,
        )

    def ellipsoid(
        self,
        centre: ArrayLike,
        radii: ArrayLike,
        *,
        width: float,
        material: int,
        group: int = 0,
        mode: Mode = "add",
        weight: float = 1.0,
        turn: F64 | None = None,
        exponent: float = 2.0,
    ) -> None:
        """A superellipsoid with half axes `radii` (exponent 2: ellipsoid, more: boxier); `turn` turns its axes."""
        c, r = np.asarray(centre, np.float64), np.asarray(radii, np.float64)
        q = np.eye(3) if turn is None else turn
        m = np.diag(1.0 / r) @ q.T
        reach = np.abs(q) @ r * 1.05 + 1.5 * width
        zero = np.zeros(3)
        self._append(ELLIPSOID, mode, group, weight, width, material, 1.0, 1.0, exponent, c, m, zero, zero, c - reach, c + reach)

    def loft(
        self,
        sections: Sequence[Section],
        *,
        width: float,
        material: int,
        rounding: float,
        shear: float = 0.0,
        shear_about: float = 0.0,
        group: int = 0,
    ) -> None:
        """A body through `sections` (from the lowest up), ends rounded by `rounding`.

        With `shear`, a section is not level: its height at z is y - shear * (z - shear_about).
        """
        ys = np.array([q.y for q in sections])
        values = np.array([(q.half_width, q.middle, q.front, q.back, *q.squareness) for q in sections])
        levels = np.linspace(float(ys[0]), float(ys[-1]), LEVELS)
        table = np.stack([_monotone(levels, ys, values[:, c]) for c in range(6)], axis=1)
        self._tables.append(table)
        zero = np.zeros(3)
        z0, z1 = float(table[:, 3].min()), float(table[:, 2].max())
        slope = max(abs(shear * (z0 - shear_about)), abs(shear * (z1 - shear_about)))
        half = float(table[:, 0].max())
        low = np.array((-half - width, ys[0] - slope - width, z0 - width))
        high = np.array((half + width, ys[-1] + slope + width, z1 + width))
        self._append(
            LOFT,
            "add",
            group,
            1.0,
            width,
            material,
            len(self._tables) - 1,
            rounding,
            2.0,
            np.array((0.0, 0.0, shear_about)),
            np.eye(3),
            np.array((ys[0], ys[-1], shear)),
            zero,
            low,
            high,
        )

    def plane(self, point: ArrayLike, normal: ArrayLike, *, width: float, low: ArrayLike, high: ArrayLike) -> None:
        """Cuts away everything on the side the normal points to, within the box low..high."""
        n = np.asarray(normal, np.float64)
        n = n / np.linalg.norm(n)
        zero = np.zeros(3)
        self._append(
            PLANE,
            "cut",
            0,
            1.0,
            width,
            0,
            0.0,
            0.0,
            2.0,
            np.asarray(point, np.float64),
            np.eye(3),
            n,
            zero,
            np.asarray(low, np.float64),
            np.asarray(high, np.float64),
        )

    def _append(
        self,
        kind: int,
        mode: Mode,
        group: int,
        weight: float,
        width: float,
        material: int,
        ra: float,
        rb: float,
        exponent: float,
        centre: F64,
        matrix: F64,
        a: F64,
        b: F64,
        low: F64,
        high: F64,
    ) -> None:
        if not 0 <= group < GROUPS:
            raise ValueError(f"group: expected 0 to {GROUPS - 1}, got {group}")
        row = np.empty(COLUMNS)
        row[:CENTRE] = (kind, _MODES[mode], group, weight, width, material, ra, rb, exponent, self._part)
        self._part = len(self._rows) + 1
        row[CENTRE:MATRIX], row[MATRIX:A] = centre, matrix.ravel()
        row[A:B], row[B:LOW], row[LOW:HIGH], row[HIGH:] = a, b, low, high
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
        return _kernels.fields_at(self.rows, self.tables, self.origin, self.shape, self.starts, self.items, points)

    def gradients(self, points: F64, step: float = 4e-4) -> F64:
        """(N, 3) gradient of the field at points (N, 3) by central differences over `step` metres."""
        return _kernels.gradients_at(self.rows, self.tables, self.origin, self.shape, self.starts, self.items, points, step)

    def materials(self, points: F64) -> tuple[I32, I32, F64]:
        """Material (N,) of the primitive whose own surface is nearest to (or farthest outside of) each point, the next
        other material (N,) and how much farther that one is (N,) [m]."""
        return _kernels.materials_at(self.rows, self.tables, self.origin, self.shape, self.starts, self.items, points)

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
        (1 + 2 * t) * (1 - t) ** 2 * y[i]
        + t * (1 - t) ** 2 * h[i] * m[i]
        + t**2 * (3 - 2 * t) * y[i + 1]
        + t**2 * (t - 1) * h[i] * m[i + 1]
    )


def boxes(rows: F64) -> tuple[F64, F64]:
    """Low and high corners (P, 3) of the boxes outside which the primitives' fields vanish."""
    return rows[:, LOW:HIGH], rows[:, HIGH:COLUMNS]


def _index(rows: F64) -> tuple[F64, I64, I64, I64]:
    """Grid origin (3,), shape (3,), start of each cell's list (C + 1,) and the rows in the lists, ascending."""
    low, high = boxes(rows)
    origin = low.min(axis=0) - CELL
    shape = (np.ceil((high.max(axis=0) - origin) / CELL) + 2).astype(np.int64)
    first = np.floor((low - origin - MARGIN) / CELL).astype(np.int64)
    last = np.floor((high - origin + MARGIN) / CELL).astype(np.int64)
    starts, items = _kernels.fill_index(shape, first, last)
    return origin, shape, starts, items
