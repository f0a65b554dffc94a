"""Force fields: wind, gravity, shear, compression, expansion as ghosts G = F A(P) (Singh §C.3; mathematics M5.4).

A ghost that is the body's own field times a function of place vanishes at the edge of its realm by itself. 1 + A stays
above 0.1 everywhere, however many forces act, so that the body stays in one piece.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from vistel.implicit.blend import Blend
from vistel.implicit.checks import ShapeError, Vec3, finite, positive, vector, within
from vistel.implicit.constants import GHOST_CAP, MOST_CHANGE, THRESHOLD
from vistel.implicit.ghosts.ghost_kind import Ghost
from vistel.implicit.graph.combine import Combination, Sum
from vistel.implicit.graph.ghost_nodes import Product, Ramp
from vistel.implicit.graph.primitive import unit_rows
from vistel.implicit.graph.shape import Shape
from vistel.implicit.primitives.offset import Sphere


class Field(Protocol):
    """A force field: what it multiplies a body's field with, and at most how much."""

    def factor(self, shape: Shape) -> tuple[Shape, float]:
        """A(P) over a shape's realm, and the largest |A| there may be."""
        ...


@dataclass(frozen=True)
class Directional:
    """A = c_1 u + c_2 u^2 + ..., u = P . N - d: pushes along N what lies ahead of a plane, draws it in behind.

    direction: N, any length; strength: c_1 [1/m], or all coefficients; plane: d [m], None: through the middle of the
    body. Surfaces move by about T c u / |grad F|.
    """

    direction: Vec3
    strength: float | tuple[float, ...] = 0.2
    plane: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _unit("Directional", self.direction))
        terms = self.strength if isinstance(self.strength, tuple) else (self.strength,)
        for i, c in enumerate(terms):
            finite("Directional", f"strength[{i}]", c)

    def factor(self, shape: Shape) -> tuple[Shape, float]:
        """As `Field.factor`."""
        middle = shape.bounds.mean(axis=0)
        offset = float(middle @ np.array(self.direction)) if self.plane is None else self.plane
        ramp = Ramp.over(shape, self.direction, offset)
        terms = self.strength if isinstance(self.strength, tuple) else (self.strength,)
        powers = tuple(ramp if n == 1 else Product((ramp,) * n) for n in range(1, len(terms) + 1))
        return Sum(powers, terms), sum(abs(c) * ramp.largest**n for n, c in enumerate(terms, 1))


def gravity(strength: float = 0.2) -> Directional:
    """Weight: sags along -Y."""
    return Directional((0.0, -1.0, 0.0), strength)


def wind(direction: Vec3, strength: float = 0.2) -> Directional:
    """Wind along a direction."""
    return Directional(direction, strength)


@dataclass(frozen=True)
class Shear:
    """A = c (u . (P - M)) (v . (P - M)): what is ahead along v moves along u, what is behind against it.

    along: u; across: v, at a right angle or any other; strength: c [1/m^2]; centre: M, None: the middle of the body.
    """

    along: Vec3
    across: Vec3
    strength: float = 0.5
    centre: Vec3 | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "along", _unit("Shear", self.along))
        object.__setattr__(self, "across", _unit("Shear", self.across))
        finite("Shear", "strength", self.strength)

    def factor(self, shape: Shape) -> tuple[Shape, float]:
        """As `Field.factor`."""
        middle = shape.bounds.mean(axis=0) if self.centre is None else np.array(self.centre)
        ramps = [Ramp.over(shape, v, float(middle @ np.array(v))) for v in (self.along, self.across)]
        most = abs(self.strength) * ramps[0].largest * ramps[1].largest
        return Sum((Product(tuple(ramps)),), (self.strength,)), most


@dataclass(frozen=True)
class Radial:
    """A = sign c f(|P - P'| / r): `compression` draws the surface towards an attractor P', `expansion` blows it up."""

    centre: Vec3
    radius: float
    strength: float
    blend: Blend = field(default_factory=lambda: Blend("quartic"))

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", vector("Radial", "centre", self.centre))
        positive("Radial", "radius", self.radius)
        finite("Radial", "strength", self.strength)

    def factor(self, shape: Shape) -> tuple[Shape, float]:
        """As `Field.factor`."""
        # Only what draws in can take the body away: a compression inside it stays below 1 - T (mathematics M5.7).
        c = self.strength
        if c < 0:
            inside = bool(shape.inside(np.array([self.centre]))[0])
            c = max(c, -GHOST_CAP * (1 - THRESHOLD) if inside else -MOST_CHANGE)
        return Sum((Sphere(self.centre, self.radius, blend=self.blend),), (c,)), abs(min(c, 0.0))


def compression(centre: Vec3, radius: float, strength: float = 0.3) -> Radial:
    """Pressure from outside towards a point; strength 0 to 1, held below 1 - T where the point lies inside."""
    return Radial(centre, radius, -within("compression", "strength", strength, 0.0, 1.0))


def expansion(centre: Vec3, radius: float, strength: float = 0.5) -> Radial:
    """Pressure from inside, like gas in a balloon; growth ends at the body's realm."""
    return Radial(centre, radius, within("expansion", "strength", strength, 0.0, 50.0))


@dataclass(frozen=True)
class Force(Ghost):
    """A force field on a body; the owner is whatever makes it."""

    field: Field = field(default_factory=gravity)


def force_ghost(realm: Shape, own: Shape, forces: Sequence[Force]) -> Shape:
    """G = F sum A_i of one body; `realm` gives the middle and extent, `own` the field. Strong forces are scaled down."""
    factors = [force.field.factor(realm) for force in forces]
    total = sum(most for _, most in factors)
    scale = min(1.0, MOST_CHANGE / total) if total > 0 else 1.0
    ghost: Combination = Sum(tuple(shape for shape, _ in factors), (scale,) * len(factors))
    return Product((own, ghost))


def limited(shape: Shape, fields: Sequence[Field]) -> bool:
    """Whether fields together are too strong for a shape and are scaled down."""
    return sum(f.factor(shape)[1] for f in fields) > MOST_CHANGE


def _unit(name: str, direction: Vec3) -> Vec3:
    v = np.array(vector(name, "direction", direction))
    if not np.linalg.norm(v) > 0:
        raise ShapeError(f"{name}: direction is zero, expected any other vector")
    x, y, z = unit_rows(v[None])[0]
    return float(x), float(y), float(z)
