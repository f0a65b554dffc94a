"""What every shape can do: be evaluated in double precision, and be combined with others by operators.

A shape is an immutable value standing for a field F: R^3 -> R; its surface is F = T, its inside F > T. Shapes form a
directed acyclic graph with primitives at the leaves (Singh §3.3). Evaluating a shape directly is the readable
reference; `vistel.implicit.compile` makes the fast program for many points.
"""

# pyright: reportUnnecessaryIsInstance=false

# `shape`, `combine`, `attributes` and `primitive` import each other: combinations are shapes, and the operators of every shape
# make combinations. It is the only import circle (docs/architecture.md).

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vistel.arrays import F64
from vistel.implicit.checks import query_points
from vistel.implicit.constants import THRESHOLD

if TYPE_CHECKING:
    from vistel.implicit.graph.attributes import Attributed
    from vistel.implicit.graph.combine import Placed

Sample = tuple[F64, F64]
"""Values (n,) and gradients (n, 3) of a field at n points."""


class Shape(ABC):
    """A field in space, made of primitives.

    `a + b` blends, `a | b` is the union, `a & b` the intersection, `a - b` the difference (level T = 1/2),
    `~a` the complement, `2 * a` weighs. The functions of the same meaning take more arguments.
    """

    @property
    @abstractmethod
    def operands(self) -> tuple[Shape, ...]:
        """The shapes this one is made of; none for a primitive."""

    @property
    @abstractmethod
    def bounds(self) -> F64:
        """(2, 3) corners of a box outside which the field has its far value."""

    @abstractmethod
    def sample(self, points: F64, memo: dict[int, Sample]) -> Sample:
        """Field (n,) and gradient (n, 3) at points (n, 3); shared operands are looked up in `memo`."""

    def _sampled(self, points: F64, memo: dict[int, Sample]) -> Sample:
        if id(self) not in memo:
            memo[id(self)] = self.sample(points, memo)
        return memo[id(self)]

    def field_and_gradient(self, points: ArrayLike) -> Sample:
        """Field (...,) and its exact gradient (..., 3) [1/m] at points (..., 3) [m], in double precision."""
        form = np.shape(points)
        value, slope = self._sampled(query_points(points), {})
        return value.reshape(form[:-1]), slope.reshape(form)

    def field(self, points: ArrayLike) -> F64:
        """Field (...,) at points (..., 3)."""
        return self.field_and_gradient(points)[0]

    def gradient(self, points: ArrayLike) -> F64:
        """Gradient (..., 3) of the field at points (..., 3); it points inwards, for the field falls outwards."""
        return self.field_and_gradient(points)[1]

    def normal(self, points: ArrayLike) -> F64:
        """Outward unit normal (..., 3), minus the direction of the gradient; zero where the gradient is."""
        slope = self.gradient(points)
        length = np.linalg.norm(slope, axis=-1, keepdims=True)
        return -np.divide(slope, length, out=np.zeros_like(slope), where=length > 0)

    def attributes(self, points: ArrayLike) -> dict[str, F64]:
        """Every attribute (..., k) at points (..., 3), combined from the primitives' own (Singh §3.3.2)."""
        from vistel.implicit.graph.attributes import blended_attributes

        return blended_attributes(self, points)

    def inside(self, points: ArrayLike, threshold: float = THRESHOLD) -> NDArray[np.bool_]:
        """Whether points (..., 3) lie in the object F >= threshold."""
        return self.field(points) >= threshold

    def walk(self) -> Iterator[Shape]:
        """Every shape of the graph once, operands before what is made of them."""
        seen: set[int] = set()
        stack: list[tuple[Shape, bool]] = [(self, False)]
        while stack:
            shape, ready = stack.pop()
            if ready:
                yield shape
            elif id(shape) not in seen:
                seen.add(id(shape))
                stack.append((shape, True))
                stack.extend((operand, False) for operand in reversed(shape.operands))

    def __add__(self, other: Shape) -> Shape:
        from vistel.implicit.graph.combine import total

        return total(self, other) if isinstance(other, Shape) else NotImplemented

    def __radd__(self, other: object) -> Shape:
        return self if isinstance(other, int) and other == 0 else NotImplemented  # so that sum(shapes) works

    def __or__(self, other: Shape) -> Shape:
        from vistel.implicit.graph.combine import union

        return union(self, other) if isinstance(other, Shape) else NotImplemented

    def __and__(self, other: Shape) -> Shape:
        from vistel.implicit.graph.combine import intersection

        return intersection(self, other) if isinstance(other, Shape) else NotImplemented

    def __sub__(self, other: Shape) -> Shape:
        from vistel.implicit.graph.combine import difference

        return difference(self, other) if isinstance(other, Shape) else NotImplemented

    def __invert__(self) -> Shape:
        from vistel.implicit.graph.combine import Complement

        return Complement(self)

    def __mul__(self, weight: float) -> Shape:
        from vistel.implicit.graph.combine import Sum

        return Sum((self,), (weight,)) if isinstance(weight, int | float) else NotImplemented

    __rmul__ = __mul__

    def with_attributes(self, weights: Mapping[str, float] | None = None, **attributes: ArrayLike) -> Attributed:
        """This shape carrying attributes, e.g. `colour=(1, 0, 0)`; primitives below keep those of their own.

        weights: how strongly each attribute of this shape counts in a blend (1 where not given).
        """
        from vistel.implicit.graph.attributes import Attributed

        return Attributed.of(self, attributes, weights or {})

    def moved(self, translation: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike | None = None) -> Placed:
        """This shape rotated about the origin by a quaternion (x, y, z, w), then translated [m]."""
        from vistel.implicit.graph.combine import Placed

        return Placed.rigid(self, translation, rotation)

    def scaled(self, factor: ArrayLike, about: ArrayLike = (0.0, 0.0, 0.0)) -> Placed:
        """This shape scaled by one factor or by one for each axis, about a point."""
        from vistel.implicit.graph.combine import Placed

        return Placed.scale(self, factor, about)

    def transformed(self, matrix: ArrayLike) -> Placed:
        """This shape under an affine map, a (3, 4) or (4, 4) matrix for column vectors."""
        from vistel.implicit.graph.combine import Placed

        return Placed.affine(self, matrix)
