"""How a straight thing is bent and twisted: each cross-section moves as a whole with the bent axis."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_rotvec


@dataclass(frozen=True, eq=False)
class Arc:
    """along, side: unit vectors (3,), the axis and towards where it is bent; low, high: where the thing begins and ends
    on the axis [m]; bend, twist: angles from end to end [rad]; centre (3,): what becomes the origin."""

    along: F64
    side: F64
    low: float
    high: float
    bend: float
    twist: float
    centre: F64

    @cached_property
    def _frame(self) -> F64:
        """(3, 3), columns along, side, and across both."""
        return np.stack([self.along, self.side, np.cross(self.along, self.side)], axis=1)

    def scaled(self, factor: float) -> "Arc":
        """The same of a thing `factor` times as large."""
        return replace(self, low=factor * self.low, high=factor * self.high, centre=factor * self.centre)

    def _share(self, s: float) -> float:
        return (s - 0.5 * (self.low + self.high)) / (self.high - self.low)

    def point(self, s: float) -> F64:
        """(3,) where the axis goes that was at s."""
        share, length = self._share(s), self.high - self.low
        angle = self.bend * share
        if abs(self.bend) < 1e-9:
            x, y = share * length, 0.0
        else:
            x, y = length / self.bend * math.sin(angle), length / self.bend * (1.0 - math.cos(angle))
        return self._frame @ np.array([x + 0.5 * (self.low + self.high), y, 0.0]) - self.centre

    def turn(self, s: float) -> F64:
        """(3, 3) by which the cross-section at s turns."""
        share = self._share(s)
        bent = matrix_from_rotvec(np.ascontiguousarray(self._frame[:, 2] * self.bend * share))
        return bent @ matrix_from_rotvec(np.ascontiguousarray(self.along * self.twist * share))

    def moved(self, point: F64) -> F64:
        """(3,) where a point of the straight thing goes."""
        s = float(point @ self.along)
        return self.point(s) + self.turn(s) @ (point - s * self.along)

    def surface(self, points: F64, normals: F64) -> tuple[F64, F64]:
        """Points (n, 3) of the straight surface and its unit normals, bent."""
        out, turned = np.empty_like(points), np.empty_like(normals)
        for i, (p, n) in enumerate(zip(points, normals, strict=True)):
            s = float(p @ self.along)
            r = self.turn(s)
            out[i] = self.point(s) + r @ (p - s * self.along)
            # Moving on along the axis goes further on the outside of the bend than inside, and round with the twist.
            off = r @ (p - s * self.along)
            per = 1.0 / (self.high - self.low)
            spin = per * (self.bend * self._frame[:, 2] + self.twist * (r @ self.along))
            forward = r @ self.along + np.cross(spin, off)
            sides = r @ self._frame[:, 1], r @ self._frame[:, 2]
            jacobian = np.stack([forward, *sides], axis=1) @ self._frame.T
            cofactor = np.stack(
                [
                    np.cross(jacobian[:, 1], jacobian[:, 2]),
                    np.cross(jacobian[:, 2], jacobian[:, 0]),
                    np.cross(jacobian[:, 0], jacobian[:, 1]),
                ],
                axis=1,
            )
            m = cofactor @ n
            turned[i] = m / max(1e-12, float(np.sqrt(m @ m)))
        return out, turned
