"""Nodes of the graph that ghosts are composed of, each a small function of its operands' fields (mathematics M3, M4).

A body a under ghosts is `Ghosted(F_a, G, cuts...)` with G the smaller of the raised skins' sum and every deficit;
`vistel.implicit.ghosts.deformable` builds these graphs, and a FieldProgram evaluates them like any other.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from vistel.arrays import F64
from vistel.implicit.blend import QUARTIC
from vistel.implicit.checks import ShapeError, Vec3, finite, vector, within
from vistel.implicit.constants import GHOST_CAP, THRESHOLD
from vistel.implicit.graph.combine import Combination
from vistel.implicit.graph.ghost_terms import constraint_field, propagation
from vistel.implicit.graph.primitive import Primitive
from vistel.implicit.graph.shape import Sample, Shape


class _Silent(Combination):
    """A combination that takes over no attributes: what it makes is a ghost, not a thing of a colour."""

    def shares(self, fields: F64, value: F64, partial: F64) -> F64:
        return np.zeros_like(fields)


@dataclass(frozen=True)
class Raised(_Silent):
    """The part of a ghost outside its owner: (1 - s) p(y; zone) + s c(y) for y = T - F > 0, else 0.

    shapes: the owner's field F, and the reach s of its constraints where it has some. zone: ye of the propagation;
    hold: y' of the constraint.
    """

    zone: float = 0.0
    hold: float = 0.0
    threshold: float = THRESHOLD

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.shapes) > 2:
            raise ShapeError(f"Raised: shapes has {len(self.shapes)} shapes, expected a field and at most one reach")
        within("Raised", "zone", self.zone, 0.0, self.threshold)
        within("Raised", "hold", self.hold, 0.0, self.threshold * (1 - 1e-6))

    @override
    def combine(self, fields: F64) -> tuple[F64, F64]:
        y = self.threshold - fields[0]
        out = y > 0
        p = propagation(y, self.zone)
        u = np.clip(y / self.zone, 0, 1) if self.zone > 0 else np.ones_like(y)
        dp = (1 - u) * (1 - 3 * u)
        if len(fields) == 1:
            return p, np.where(out, -dp, 0.0)[None]
        s = np.clip(fields[1], 0, 1)
        h = self.threshold - self.hold
        c = constraint_field(y, self.hold, threshold=self.threshold)
        v = np.clip((y - self.hold) / h, 0, 1)
        dc = np.where(y <= self.hold, 1.0, (1 - v) / h * (h - 3 * v * (2 * self.hold + h)))
        value = (1 - s) * p + s * c
        by_s = np.where((fields[1] > 0) & (fields[1] < 1), c - p, 0.0)
        return np.where(out, value, 0.0), np.where(out, np.stack([-((1 - s) * dp + s * dc), by_s]), 0.0)


@dataclass(frozen=True)
class Deficit(_Silent):
    """y = T - F; inside the owner `share` of it (1: all of the collision, less: a dent that fades)."""

    share: float = 1.0
    threshold: float = THRESHOLD

    @override
    def combine(self, fields: F64) -> tuple[F64, F64]:
        y = self.threshold - fields[0]
        factor = np.where(y < 0, self.share, 1.0)
        return factor * y, -factor[None]


@dataclass(frozen=True)
class Plateau(_Silent):
    """A quartic sphylinder's field with a plateau: 1 up to `plateau` of the reach from the axis, then falling to 0."""

    plateau: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        within("Plateau", "plateau", self.plateau, 0.0, 0.95)

    @override
    def combine(self, fields: F64) -> tuple[F64, F64]:
        x = np.sqrt(np.maximum(0.0, 1 - np.sqrt(np.clip(fields[0], 0, 1))))
        far = np.maximum(0.0, (x - self.plateau) / (1 - self.plateau))
        slope = QUARTIC.derivative(x)
        rate = np.divide(QUARTIC.derivative(far), slope * (1 - self.plateau), out=np.zeros_like(x), where=slope < 0)
        return QUARTIC(far), rate[None]


@dataclass(frozen=True)
class Product(_Silent):
    """F_1 F_2 ...: a force field's ghost is the body's own field times a function of place (Singh §C.3)."""

    @override
    def combine(self, fields: F64) -> tuple[F64, F64]:
        partial = np.stack([np.prod(np.delete(fields, i, axis=0), axis=0) for i in range(len(fields))])
        return np.prod(fields, axis=0), partial


@dataclass(frozen=True)
class Ghosted(Combination):
    """F + min(G, cap) inside the realm F > 0, F itself outside, and no more than 2T - F_k of rigid bodies k.

    shapes: F, G, then the fields of rigid bodies whose surfaces cut this one.
    """

    cap: float = GHOST_CAP * THRESHOLD
    threshold: float = THRESHOLD

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.shapes) < 2:
            raise ShapeError(f"Ghosted: shapes has {len(self.shapes)} shapes, expected a field and its ghost")

    @override
    def combine(self, fields: F64) -> tuple[F64, F64]:
        own, ghost = fields[0], fields[1]
        acts = own > 0
        value: F64 = own + acts * np.minimum(ghost, self.cap)
        partial = np.zeros_like(fields)
        partial[0] = 1.0
        partial[1] = acts & (ghost <= self.cap)
        for k in range(2, len(fields)):
            wall = 2 * self.threshold - fields[k]
            cut: NDArray[np.bool_] = acts & (wall < value)
            value[cut] = wall[cut]
            partial[:, cut] = 0.0
            partial[k, cut] = -1.0
        return value, partial

    @override
    def shares(self, fields: F64, value: F64, partial: F64) -> F64:
        return np.concatenate([np.ones_like(fields[:1]), np.zeros_like(fields[1:])])

    @property
    @override
    def bounds(self) -> F64:
        return self.shapes[0].bounds


@dataclass(frozen=True, repr=False)
class Ramp(Primitive):
    """The linear function slope . P - offset within a box: what directional force fields are made of.

    It is no distance ratio; it only makes sense as a factor of fields that vanish outside the box.
    """

    slope: Vec3
    offset: float
    low: Vec3
    high: Vec3
    kind = "ramp"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("slope", "low", "high"):
            object.__setattr__(self, name, vector("Ramp", name, getattr(self, name)))
        object.__setattr__(self, "offset", finite("Ramp", "offset", self.offset))

    @classmethod
    def over(cls, shape: Shape, slope: Vec3, offset: float) -> "Ramp":
        """The ramp over all of a shape's realm."""
        low, high = shape.bounds
        return cls(slope, offset, vector("Ramp", "low", low), vector("Ramp", "high", high))

    @property
    @override
    def bounds(self) -> F64:
        return np.array([self.low, self.high])

    @property
    def largest(self) -> float:
        """Largest absolute value in the box."""
        low, high, slope = np.array(self.low), np.array(self.high), np.array(self.slope)
        middle, half = slope @ (low + high) / 2 - self.offset, np.abs(slope) @ (high - low) / 2
        return float(abs(middle) + half)

    @override
    def ratio(self, points: F64) -> Sample:
        return points @ np.array(self.slope) - self.offset, np.broadcast_to(np.array(self.slope), points.shape).copy()

    @override
    def closest(self, points: F64) -> F64:
        return points.copy()

    @property
    @override
    def parameters(self) -> F64:
        return np.array([*self.slope, self.offset])

    @override
    def sample(self, points: F64, memo: dict[int, Sample]) -> Sample:
        value, slope = self.ratio(points)
        return self.weight * value, self.weight * slope
