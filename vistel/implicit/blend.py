"""Blend functions f: [0, 1] -> [0, 1] of the distance ratio (Singh §3.3.1, Figure 22; mathematics M1.2), and their Moebius warps.

Every f has f(0) = 1, f(1) = 0, f'(0) = f'(1) = 0 and falls monotonically; beyond 1 it is 0.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from vistel.arrays import F64
from vistel.geometry.smoothstep import ease
from vistel.implicit.checks import ShapeError, positive
from vistel.implicit.constants import THRESHOLD


def _hermite(x: F64) -> tuple[F64, F64, F64]:
    return 1 - ease(x), -6 * x * (1 - x), -6 + 12 * x


def _wyvill(x: F64) -> tuple[F64, F64, F64]:
    u = x * x
    return ((1 - u) ** 2 * (1 - 4 * u / 9), -(4 / 9) * x * (1 - u) * (11 - 6 * u), -44 / 9 + (68 / 3) * u - (40 / 3) * u * u)


def _quartic(x: F64) -> tuple[F64, F64, F64]:
    u = x * x
    return (1 - u) ** 2, -4 * x * (1 - u), -4 + 12 * u


def _quad2(x: F64) -> tuple[F64, F64, F64]:
    near = x <= 0.5
    return (np.where(near, 1 - 2 * x * x, 2 * (1 - x) ** 2), np.where(near, -4 * x, -4 * (1 - x)), np.where(near, -4.0, 4.0))


def _hermite_inverse(t: F64) -> F64:
    return 0.5 - np.sin(np.arcsin(2 * t - 1) / 3)


def _wyvill_inverse(t: F64) -> F64:
    # v = u - 17/12 solves v^3 - (25/48) v + (9T/4 - 125/864) = 0; the cosine form holds up to T = 125/972.
    c = 1944 * t / 125 - 1
    low = (5 / 6) * np.cos(np.arccos(np.clip(-c, -1, 1)) / 3 + 2 * math.pi / 3)
    high = -(5 / 6) * np.cosh(np.arccosh(np.maximum(c, 1)) / 3)
    return np.sqrt(np.maximum(np.where(t <= 125 / 972, low, high) + 17 / 12, 0))


def _quartic_inverse(t: F64) -> F64:
    return np.sqrt(1 - np.sqrt(t))


def _quad2_inverse(t: F64) -> F64:
    return np.where(t >= 0.5, np.sqrt((1 - t) / 2), 1 - np.sqrt(t / 2))


_FORMULA = {"hermite": _hermite, "wyvill": _wyvill, "quartic": _quartic, "quad2": _quad2}
_INVERSE = {"hermite": _hermite_inverse, "wyvill": _wyvill_inverse, "quartic": _quartic_inverse, "quad2": _quad2_inverse}


@dataclass(frozen=True)
class Blend:
    """A blend function: one of the four families, seen through the warp y = x / (x + warp (1 - x)).

    warp 1 is the family itself; above 1 the surface bulges outwards, below 1 it shrinks (Singh §4.2: a muscle acts
    by changing the shape of its blend function). Every warp keeps f(0) = 1, f(1) = 0 and zero slopes at both ends.
    """

    family: str
    warp: float = 1.0

    families: ClassVar[tuple[str, ...]] = tuple(_FORMULA)

    def __post_init__(self) -> None:
        if self.family not in _FORMULA:
            raise ShapeError(f"Blend: family is {self.family!r}, expected one of {', '.join(_FORMULA)}")
        object.__setattr__(self, "warp", positive("Blend", "warp", self.warp))

    @property
    def code(self) -> int:
        """The family's number in a FieldProgram."""
        return self.families.index(self.family)

    def _warped(self, x: ArrayLike) -> tuple[F64, F64, F64]:
        """y(x), y'(x) and y''(x) of the warp, with x clamped to [0, 1]."""
        x = np.clip(np.asarray(x, np.float64), 0.0, 1.0)
        b = self.warp
        s = x + b * (1 - x)
        return x / s, b / s**2, -2 * b * (1 - b) / s**3

    def __call__(self, x: ArrayLike) -> F64:
        """f(x) of distance ratios x of any shape; 0 beyond 1."""
        return _FORMULA[self.family](self._warped(x)[0])[0]

    def derivative(self, x: ArrayLike) -> F64:
        """f'(x); 0 beyond 1."""
        y, dy, _ = self._warped(x)
        return _FORMULA[self.family](y)[1] * dy

    def second_derivative(self, x: ArrayLike) -> F64:
        """f''(x) inside [0, 1]; 0 beyond 1, where it jumps."""
        y, dy, ddy = self._warped(x)
        _, df, ddf = _FORMULA[self.family](y)
        return np.where(np.asarray(x) > 1, 0.0, ddf * dy * dy + df * ddy)

    def inverse(self, value: ArrayLike) -> F64:
        """The distance ratio at which f reaches `value`, 0 <= value <= 1.

        Raises ShapeError where a value lies outside [0, 1].
        """
        t = np.asarray(value, np.float64)
        if not np.all((t >= 0) & (t <= 1)):
            raise ShapeError(f"{self!r}.inverse: value is {value!r}, expected numbers from 0 to 1")
        y = _INVERSE[self.family](t)
        return self.warp * y / (1 - y + self.warp * y)

    def actuated(self, surface_ratio: float, threshold: float = THRESHOLD) -> "Blend":
        """This family warped so that its surface at `threshold` lies at the distance ratio `surface_ratio`.

        Singh §4.2 in the closed form b = x*(1 - t) / (t (1 - x*)) with t the rest position of the surface.
        """
        if not 0 < surface_ratio < 1:
            raise ShapeError(f"{self!r}.actuated: surface_ratio is {surface_ratio!r}, expected 0 < x < 1")
        if not 0 < threshold < 1:
            raise ShapeError(f"{self!r}.actuated: threshold is {threshold!r}, expected 0 < T < 1")
        t = float(Blend(self.family).inverse(threshold))
        return Blend(self.family, surface_ratio * (1 - t) / (t * (1 - surface_ratio)))

    def __repr__(self) -> str:
        return self.family if self.warp == 1.0 else f"{self.family}(warp={self.warp:.4g})"


HERMITE = Blend("hermite")
WYVILL = Blend("wyvill")
QUARTIC = Blend("quartic")
QUAD2 = Blend("quad2")
