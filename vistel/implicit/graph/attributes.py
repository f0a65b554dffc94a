"""Attributes of a blended shape: colours, textures, anything numeric (Singh §3.3.2; mathematics M2.5).

    c = sum(F_i w_i c_i) / sum(F_i w_i)

with w_i the attribute's own weight on primitive i. Sums add both sums; max and min keep those of the operands within
1e-6 of the extremum; Ricci forms scale them by dF/dF_i, which lies between the two. A field below 0 gives nothing.
An attribute that nothing in reach carries is zero.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import override

from vistel.arrays import F64
from vistel.implicit.checks import ShapeError, finite, query_points
from vistel.implicit.graph.combine import Combination, Placed
from vistel.implicit.graph.primitive import Primitive
from vistel.implicit.graph.shape import Sample, Shape

Texture = Callable[[F64], Any]

Masses = dict[str, tuple[F64, F64]]
"""Name -> (sum of F w c (n, k), sum of F w (n,))."""


@dataclass(frozen=True, eq=False)
class Attributed(Shape):
    """A shape whose primitives carry attributes, unless they have some of the same name further down.

    values: name -> (k,) numbers, or a function from boundary points P' (n, 3) to (n, k) numbers (a texture).
    weights: name -> how strongly the attribute counts in a blend; 1 where missing.
    """

    shape: Shape
    values: Mapping[str, object]
    weights: Mapping[str, float]

    @classmethod
    def of(cls, shape: Shape, values: Mapping[str, object], weights: Mapping[str, float]) -> "Attributed":
        """`shape` with checked attributes."""
        checked: dict[str, object] = {}
        for name, value in values.items():
            if callable(value):
                checked[name] = value
                continue
            numbers = np.atleast_1d(np.array(value, np.float64))
            if numbers.ndim != 1 or not np.isfinite(numbers).all():
                raise ShapeError(f"with_attributes: {name} is {value!r}, expected finite numbers or a function of points")
            numbers.setflags(write=False)
            checked[name] = numbers
        for name, weight in weights.items():
            if name not in checked:
                raise ShapeError(f"with_attributes: weights names {name!r}, expected one of {sorted(checked)}")
            if finite("with_attributes", f"weights[{name!r}]", weight) < 0:
                raise ShapeError(f"with_attributes: weights[{name!r}] is {weight:g}, expected 0 or more")
        return cls(shape, checked, dict(weights))

    @property
    @override
    def operands(self) -> tuple[Shape, ...]:
        return (self.shape,)

    @property
    @override
    def bounds(self) -> F64:
        return self.shape.bounds

    @override
    def sample(self, points: F64, memo: dict[int, Sample]) -> Sample:
        return self.shape._sampled(points, memo)

    def __repr__(self) -> str:
        return f"{self.shape!r}.with_attributes({', '.join(sorted(self.values))})"


def blended_attributes(shape: Shape, points: ArrayLike) -> dict[str, F64]:
    """Every attribute (..., k) of `shape` at points (..., 3), in double precision."""
    form = np.shape(points)[:-1]
    found = _masses(shape, query_points(points), {}, {})
    return {
        name: np.divide(total, mass[:, None], out=np.zeros_like(total), where=mass[:, None] > 0).reshape(*form, -1)
        for name, (total, mass) in found.items()
    }


def texture_values(texture: Texture, primitive: Primitive, points: F64) -> F64:
    """A texture (n, k) of `primitive` at points (n, 3) in its frame: looked up at its surface point."""
    values = np.asarray(texture(primitive.surface_point(points)), np.float64)
    values = values[:, None] if values.ndim == 1 else values
    if values.ndim != 2 or len(values) != len(points):
        raise ShapeError(f"attributes: a texture gave the form {values.shape} for {len(points)} points, expected (n, k)")
    return values


def _masses(shape: Shape, points: F64, values: Mapping[str, Any], weights: Mapping[str, float]) -> Masses:
    if isinstance(shape, Placed):
        inverse = shape.inverse
        return _masses(shape.shape, points @ inverse[:, :3].T + inverse[:, 3], values, weights)
    if isinstance(shape, Attributed):
        own = {k: shape.weights.get(k, 1.0) for k in shape.values}
        return _masses(shape.shape, points, {**values, **shape.values}, {**weights, **own})
    if isinstance(shape, Primitive):
        field = np.maximum(shape.field(points), 0.0)
        found: Masses = {}
        for name, value in values.items():
            rows = texture_values(value, shape, points) if callable(value) else np.broadcast_to(value, (len(points), len(value)))
            mass = field * weights.get(name, 1.0)
            found[name] = (mass[:, None] * rows, mass)
        return found
    if not isinstance(shape, Combination):
        raise ShapeError(f"attributes: {type(shape).__name__} is neither a primitive nor a combination of shapes")
    fields = np.stack([operand.field(points) for operand in shape.operands])
    value, partial = shape.combine(fields)
    shares = shape.shares(fields, value, partial)
    total: Masses = {}
    for share, operand in zip(shares, shape.operands, strict=True):
        for name, (rows, mass) in _masses(operand, points, values, weights).items():
            add = share[:, None] * rows, share * mass
            total[name] = (total[name][0] + add[0], total[name][1] + add[1]) if name in total else add
    return total
