"""Change of shape, of any genus, by weights or by the threshold (Singh Appendix B; mathematics M2.7, M2.8).

film = vi.WeightChange(a, b)                       film.at(0.4) is the shape 40 % of the way
film = vi.ThresholdChange.between(torus, cube)     from the first polyhedron to the second
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from vistel.geometry.smoothstep import ease
from vistel.implicit.blend import QUARTIC, Blend
from vistel.implicit.checks import ShapeError, Vec3, within
from vistel.implicit.graph.combine import Placed, Sum
from vistel.implicit.graph.shape import Shape
from vistel.implicit.primitives.polyblob import Polyblob, inside_polyhedron
from vistel.implicit.primitives.polyhedron import Polyhedron

ENDS = 1e-3
"""Thresholds keep this far from 0 and 1, where the surface is the hull or the core itself and F is flat there."""


def eased(progress: float) -> float:
    """3 s^2 - 2 s^3: slow at both ends."""
    return ease(progress)


def uniform_threshold(progress: float, blend: Blend = QUARTIC) -> float:
    """The threshold at which a polyblob's surface is the fraction `progress` of the way from core to hull."""
    return float(blend(progress))


def core_scale(core: float, threshold: float) -> float:
    """(1/sc - 1) threshold + 1: enlargement that gives a core shrunk by `core` its own size back at threshold 1."""
    return (1 / core - 1) * threshold + 1


@dataclass(frozen=True)
class WeightChange:
    """F = (1 - a) F_A + a F_B at a fixed threshold: any two shapes that lie over each other."""

    first: Shape
    second: Shape

    def at(self, progress: float, *, ease: bool = True) -> Shape:
        """The shape at `progress` from 0 (the first) to 1 (the second)."""
        s = within("WeightChange", "progress", progress, 0, 1)
        a = eased(s) if ease else s
        return Sum((self.first, self.second), (1 - a, a))


@dataclass(frozen=True, eq=False)
class ThresholdChange:
    """A polyblob's surfaces from its core (threshold 1) to its hull (threshold 0).

    core_scale: how much the core was shrunk to lie in the hull, about `centre`; the whole is enlarged in step, so
    that the film begins with the core at its own size.
    """

    blob: Polyblob
    core_scale: float = 1.0
    centre: Vec3 = (0.0, 0.0, 0.0)

    @classmethod
    def between(
        cls, core: Polyhedron, hull: Polyhedron, *, centre: Vec3 | None = None, blend: Blend = QUARTIC, margin: float = 0.7
    ) -> Self:
        """From `core` to `hull`; the core is shrunk about `centre` (the hull's middle) to `margin` of what fits."""
        middle = hull.bounds.mean(axis=0) if centre is None else np.asarray(centre, np.float64)
        at = (float(middle[0]), float(middle[1]), float(middle[2]))
        if not inside_polyhedron(hull, middle[None])[0]:
            raise ShapeError(f"ThresholdChange: centre {at} is not inside the hull, expected a point inside")
        low, high = 0.0, 1.0
        if inside_polyhedron(hull, core.scaled(1 / margin, at).vertices).all():
            return cls(Polyblob(hull, core, blend=blend), 1.0, at)
        for _ in range(40):
            half = 0.5 * (low + high)
            fits = bool(inside_polyhedron(hull, core.scaled(half, at).vertices).all())
            low, high = (half, high) if fits else (low, half)
        scale = margin * low
        return cls(Polyblob(hull, core.scaled(scale, at), blend=blend), scale, at)

    @cached_property
    def thresholds(self) -> tuple[float, float]:
        """The thresholds at the two ends of the film."""
        return 1 - ENDS, ENDS

    def threshold(self, progress: float, *, ease: bool = True) -> float:
        """The threshold at `progress`: even speed of the surface, or eased at both ends (mathematics M2.8)."""
        s = within("ThresholdChange", "progress", progress, 0, 1)
        return float(np.clip(uniform_threshold(eased(s) if ease else s, self.blob.blend), ENDS, 1 - ENDS))

    def at(self, progress: float, *, ease: bool = True) -> tuple[Shape, float]:
        """The shape at `progress` from 0 (the core) to 1 (the hull), and the threshold of its surface."""
        threshold = self.threshold(progress, ease=ease)
        return Placed.scale(self.blob, core_scale(self.core_scale, threshold), self.centre), threshold

    def solid(self, progress: float) -> Polyhedron | None:
        """The exact polyhedron at an end of the film (0 or 1), None between."""
        if progress == 0:
            return self.blob.core.scaled(1 / self.core_scale, self.centre)
        return self.blob.hull if progress == 1 else None
