"""Superquadric primitives about the axis z: ellipsoid and toroid (Singh §1.2.1; mathematics M1.7, M1.8)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from typing_extensions import override

from vistel.arrays import F64
from vistel.implicit.checks import ShapeError, Vec3, positive, vector, within
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.graph.primitive import Primitive
from vistel.implicit.graph.shape import Sample
from vistel.implicit.primitives.offset import influence_of

ROUND = 0.1
"""Least exponent: below it fields are too steep to evaluate."""
SHARP = 1.9
"""Largest exponent, for the same reason."""

LEAST_ALPHA = 0.5


def _power(base: F64, exponent: float) -> F64:
    """base^exponent for base >= 0, with 0 for a negative power of 0 (coordinate planes have no slope there)."""
    return np.power(base, exponent, out=np.zeros_like(base), where=base > 0)


def _checked(name: str, shape: Any) -> None:
    object.__setattr__(shape, "centre", vector(name, "centre", shape.centre))
    sizes = vector(name, "sizes", shape.sizes)
    for i, size in enumerate(sizes):
        positive(name, f"sizes[{i}]", size)
    object.__setattr__(shape, "sizes", sizes)
    for e in ("e1", "e2"):
        object.__setattr__(shape, e, within(name, e, getattr(shape, e), ROUND, SHARP))


@dataclass(frozen=True, repr=False)
class Superellipsoid(Primitive):
    """d = h^(e1/2), h = (|x/a1|^(2/e2) + |y/a2|^(2/e2))^(e2/e1) + |z/a3|^(2/e1), about a point.

    sizes: (a1, a2, a3), half axes of V; e1: squareness along z, e2: across it; 1 is round, towards 0 a box.
    """

    centre: Vec3
    sizes: Vec3
    e1: float = 1.0
    e2: float = 1.0
    kind = "superellipsoid"

    def __post_init__(self) -> None:
        super().__post_init__()
        _checked("Superellipsoid", self)

    @classmethod
    def of_surface(
        cls, centre: Vec3, sizes: Sequence[float], e1: float = 1.0, e2: float = 1.0, *, threshold: float = THRESHOLD, **options: Any
    ) -> Self:
        """The superellipsoid whose surface F = threshold has these half axes; options: weight, blend."""
        reach = influence_of("Superellipsoid", threshold, options)
        a, b, c = vector("Superellipsoid", "sizes", sizes)
        return cls(centre, (a * reach, b * reach, c * reach), e1, e2, **options)

    @property
    @override
    def bounds(self) -> F64:
        c, a = np.array(self.centre), np.array(self.sizes)
        return np.stack([c - a, c + a])

    @property
    @override
    def frame(self) -> F64:
        return np.column_stack([np.eye(3), self.centre])

    @override
    def closest(self, points: F64) -> F64:
        return np.broadcast_to(np.array(self.centre), points.shape).copy()

    @override
    def ratio(self, points: F64) -> Sample:
        a, e1, e2 = np.array(self.sizes), self.e1, self.e2
        p = points - np.array(self.centre)
        scaled = np.abs(p) / a
        # Scaled by the largest coordinate, so that no power overflows or vanishes: d has degree one.
        size = scaled.max(axis=1)
        q = np.divide(scaled, size[:, None], out=np.zeros_like(scaled), where=size[:, None] > 0)
        w = _power(q[:, 0], 2 / e2) + _power(q[:, 1], 2 / e2)
        h = _power(w, e2 / e1) + _power(q[:, 2], 2 / e1)
        d = _power(h, e1 / 2)
        steep = _power(h, e1 / 2 - 1)
        ring = steep * _power(w, e2 / e1 - 1)
        slope = np.stack(
            [ring * _power(q[:, 0], 2 / e2 - 1), ring * _power(q[:, 1], 2 / e2 - 1), steep * _power(q[:, 2], 2 / e1 - 1)], axis=1
        )
        return size * d, slope * np.sign(p) / a

    @property
    @override
    def parameters(self) -> F64:
        return np.array([*(1 / np.array(self.sizes)), self.e1, self.e2])


@dataclass(frozen=True, repr=False)
class Supertoroid(Primitive):
    """d = (|v|^(2/e1) + |z/a3|^(2/e1))^(e1/2), v = (|x/a1|^(2/e2) + |y/a2|^(2/e2))^(e2/2) - alpha.

    The skeleton is the ring v = z = 0, of radii alpha a1 and alpha a2; V reaches a1, a2 and a3 from it. For a1 = a2
    and e2 = 1 d is the ratio of Singh §3.1. Below alpha = 1 V meets itself on the axis, where the field has a kink.
    """

    centre: Vec3
    sizes: Vec3
    alpha: float
    e1: float = 1.0
    e2: float = 1.0
    kind = "supertoroid"

    def __post_init__(self) -> None:
        super().__post_init__()
        _checked("Supertoroid", self)
        if positive("Supertoroid", "alpha", self.alpha) < LEAST_ALPHA:
            raise ShapeError(f"Supertoroid: alpha is {self.alpha:g}, expected {LEAST_ALPHA:g} or more, and 1 for a smooth field")

    @classmethod
    def of_surface(
        cls,
        centre: Vec3,
        sizes: Sequence[float],
        alpha: float,
        e1: float = 1.0,
        e2: float = 1.0,
        *,
        threshold: float = THRESHOLD,
        **options: Any,
    ) -> Self:
        """The supertoroid whose surface has these tube radii about a ring of radii alpha a1, alpha a2.

        The ring stays and the tube grows to its influence radius.
        """
        reach = influence_of("Supertoroid", threshold, options)
        a, b, c = vector("Supertoroid", "sizes", sizes)
        if positive("Supertoroid", "alpha", alpha) < 1:
            raise ShapeError(f"Supertoroid: alpha is {alpha:g}, expected 1 or more (ring radius over tube radius)")
        return cls(centre, (a * reach, b * reach, c * reach), alpha / reach, e1, e2, **options)

    @property
    @override
    def bounds(self) -> F64:
        c, (a1, a2, a3) = np.array(self.centre), self.sizes
        reach = np.array([a1 * (1 + self.alpha), a2 * (1 + self.alpha), a3])
        return np.stack([c - reach, c + reach])

    @property
    @override
    def frame(self) -> F64:
        return np.column_stack([np.eye(3), self.centre])

    def _ring(self, p: F64) -> tuple[F64, F64]:
        """Ring coordinate q (n,) and its slopes (n, 2) by |x|/a1 and |y|/a2, of p (n, 3) about the centre."""
        scaled = np.abs(p[:, :2]) / np.array(self.sizes[:2])
        size = scaled.max(axis=1)
        unit = np.divide(scaled, size[:, None], out=np.zeros_like(scaled), where=size[:, None] > 0)
        w = _power(unit[:, 0], 2 / self.e2) + _power(unit[:, 1], 2 / self.e2)
        slope = _power(w, self.e2 / 2 - 1)[:, None] * np.stack([_power(unit[:, k], 2 / self.e2 - 1) for k in (0, 1)], axis=1)
        return size * _power(w, self.e2 / 2), slope

    @override
    def closest(self, points: F64) -> F64:
        p = points - np.array(self.centre)
        q, _ = self._ring(p)
        ring = np.zeros_like(p)
        ring[:, :2] = p[:, :2] * np.divide(self.alpha, q, out=np.zeros_like(q), where=q > 0)[:, None]
        ring[q == 0, 0] = self.alpha * self.sizes[0]
        return np.array(self.centre) + ring

    @override
    def ratio(self, points: F64) -> Sample:
        a, e1 = np.array(self.sizes), self.e1
        p = points - np.array(self.centre)
        q, ring = self._ring(p)
        v = q - self.alpha
        z = np.abs(p[:, 2]) / a[2]
        size = np.maximum(np.abs(v), z)
        safe = np.where(size > 0, size, 1.0)
        uv, uz = np.abs(v) / safe, z / safe
        h = _power(uv, 2 / e1) + _power(uz, 2 / e1)
        steep = _power(h, e1 / 2 - 1)
        by_v = steep * _power(uv, 2 / e1 - 1) * np.sign(v)
        slope = np.column_stack([by_v[:, None] * ring, steep * _power(uz, 2 / e1 - 1)])
        return size * _power(h, e1 / 2), slope * np.sign(p) / a

    @property
    @override
    def parameters(self) -> F64:
        return np.array([*(1 / np.array(self.sizes)), self.alpha, self.e1, self.e2])
