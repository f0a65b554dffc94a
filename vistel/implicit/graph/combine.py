"""Inner nodes of the graph: how fields make new fields (Singh §3.3, Ricci 1973; mathematics M2), and how shapes are placed.

Every node knows its value and, by the chain rule, its exact gradient. Nodes that take powers see negative fields as 0.
"""

# pyright: reportUnnecessaryIsInstance=false

import math
from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import override

from vistel.arrays import F64
from vistel.implicit.checks import ShapeError, finite, positive, vector
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.graph.shape import Sample, Shape


@dataclass(frozen=True)
class Combination(Shape):
    """A field made of the fields of its operands alone: F = c(F_1, ..., F_n)."""

    shapes: tuple[Shape, ...]

    def __post_init__(self) -> None:
        name = type(self).__name__
        object.__setattr__(self, "shapes", tuple(self.shapes))
        if not self.shapes:
            raise ShapeError(f"{name}: shapes is empty, expected at least one shape")
        for i, shape in enumerate(self.shapes):
            if not isinstance(shape, Shape):
                raise ShapeError(f"{name}: shapes[{i}] is {shape!r}, expected a shape")

    @abstractmethod
    def combine(self, fields: F64) -> tuple[F64, F64]:
        """Value (n,) and partial derivatives (m, n) of the combination at operand fields (m, n)."""

    def shares(self, fields: F64, value: F64, partial: F64) -> F64:
        """(m, n) how much of each operand's attributes the combination takes over."""
        return np.maximum(partial, 0.0)

    @property
    @override
    def operands(self) -> tuple[Shape, ...]:
        return self.shapes

    @property
    @override
    def bounds(self) -> F64:
        boxes = np.array([shape.bounds for shape in self.shapes])
        return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    @override
    def sample(self, points: F64, memo: dict[int, Sample]) -> Sample:
        samples = [shape._sampled(points, memo) for shape in self.shapes]
        value, partial = self.combine(np.stack([s[0] for s in samples]))
        slope = np.zeros_like(points)
        for weight, (_, gradient) in zip(partial, samples, strict=True):
            slope += weight[:, None] * gradient
        return value, slope


@dataclass(frozen=True)
class Sum(Combination):
    """F = sum of weights * F_i: the blend."""

    weights: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        weights = tuple(self.weights) or (1.0,) * len(self.shapes)
        if len(weights) != len(self.shapes):
            raise ShapeError(f"Sum: weights has {len(weights)} numbers for {len(self.shapes)} shapes")
        object.__setattr__(self, "weights", tuple(finite("Sum", f"weights[{i}]", w) for i, w in enumerate(weights)))

    @override
    def combine(self, fields: F64) -> tuple[F64, F64]:
        weights = np.array(self.weights)[:, None]
        return (weights * fields).sum(axis=0), np.broadcast_to(weights, fields.shape)

    def __repr__(self) -> str:
        terms = [repr(s) if w == 1 else f"{w:g} * {s!r}" for s, w in zip(self.shapes, self.weights, strict=True)]
        return f"({' + '.join(terms)})"


@dataclass(frozen=True)
class Extremum(Combination):
    """The largest field (union) or the smallest (intersection); the first of equals gives the gradient."""

    largest: bool = True

    @override
    def combine(self, fields: F64) -> tuple[F64, F64]:
        which = fields.argmax(axis=0) if self.largest else fields.argmin(axis=0)
        partial = (np.arange(len(fields))[:, None] == which).astype(np.float64)
        return np.take_along_axis(fields, which[None], axis=0)[0], partial

    @override
    def shares(self, fields: F64, value: F64, partial: F64) -> F64:
        return (np.abs(fields - value) <= TIE).astype(np.float64)

    def __repr__(self) -> str:
        return f"({' | '.join(map(repr, self.shapes))})" if self.largest else f"({' & '.join(map(repr, self.shapes))})"


TIE = 1e-6
"""Fields this close to the extremum give their attributes in equal parts (Singh §3.3.2)."""


@dataclass(frozen=True)
class Ricci(Combination):
    """(sum F_i^p)^(1/p) for a union, with -p for an intersection; p = 1 blends fully, p -> inf is max or min."""

    power: float = 2.0
    largest: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1 <= finite("Ricci", "power", self.power) <= 64:
            raise ShapeError(f"Ricci: power is {self.power:g}, expected 1 to 64; for more use power=math.inf")

    @override
    def combine(self, fields: F64) -> tuple[F64, F64]:
        f = np.maximum(fields, 0.0)
        extreme = f.max(axis=0) if self.largest else f.min(axis=0)
        # Relative to the extreme no power overflows; where it is 0 the combination is 0, with slope 0.
        some = extreme > 0
        safe = np.where(some, extreme, 1.0)
        if self.largest:
            relative = f / safe
            root = np.where(some, (relative**self.power).sum(axis=0), 1.0) ** (1 / self.power)
            return extreme * root, np.where(some, (relative / root) ** (self.power - 1), 0.0)
        relative = np.divide(safe, f, out=np.zeros_like(f), where=some & (f > 0))
        root = np.where(some, (relative**self.power).sum(axis=0), 1.0) ** (-1 / self.power)
        return extreme * root, np.where(some, (relative * root) ** (self.power + 1), 0.0)

    def __repr__(self) -> str:
        name = "union" if self.largest else "intersection"
        return f"{name}({', '.join(map(repr, self.shapes))}, power={self.power:g})"


@dataclass(frozen=True, init=False)
class Complement(Combination):
    """2T - F: what is inside becomes outside, the surface F = T stays."""

    threshold: float = THRESHOLD

    def __init__(self, shape: Shape, threshold: float = THRESHOLD) -> None:
        object.__setattr__(self, "shapes", (shape,))
        object.__setattr__(self, "threshold", finite("Complement", "threshold", threshold))
        super().__post_init__()

    @override
    def combine(self, fields: F64) -> tuple[F64, F64]:
        return 2 * self.threshold - fields[0], np.full_like(fields, -1.0)

    @override
    def shares(self, fields: F64, value: F64, partial: F64) -> F64:
        return np.ones_like(fields)

    def __repr__(self) -> str:
        return f"~{self.shapes[0]!r}"


@dataclass(frozen=True)
class Diff(Combination):
    """|F_1^n - F_2^n|^(1/n), the crease of a joint (Singh §2.4); eps > 0 rounds its singular slope at F_1 = F_2."""

    power: float = 2.0
    eps: float = 0.05

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.shapes) != 2:
            raise ShapeError(f"Diff: shapes has {len(self.shapes)} shapes, expected two")
        positive("Diff", "power", self.power)
        if finite("Diff", "eps", self.eps) < 0:
            raise ShapeError(f"Diff: eps is {self.eps:g}, expected 0 or more")

    @override
    def combine(self, fields: F64) -> tuple[F64, F64]:
        value, slope_a, slope_b = diff(fields[0], fields[1], self.power, self.eps)
        return value, np.stack([slope_a, slope_b])

    @override
    def shares(self, fields: F64, value: F64, partial: F64) -> F64:
        return np.ones_like(fields)

    def __repr__(self) -> str:
        return f"Diff({self.shapes[0]!r}, {self.shapes[1]!r}, power={self.power:g}, eps={self.eps:g})"


MAX_SLOPE = 1e6
"""Partial derivatives of Diff are cut off here: with eps = 0 they have no bound at F_1 = F_2."""


def diff(a: ArrayLike, b: ArrayLike, power: float, eps: float = 0.0) -> tuple[F64, F64, F64]:
    """DIFF(a, b) and its partial derivatives by a and b, for a, b >= 0 of one form (Singh §2.4, regularised)."""
    a, b = np.maximum(np.asarray(a, np.float64), 0), np.maximum(np.asarray(b, np.float64), 0)
    s = a**power - b**power
    square = s * s + eps * eps
    value = square ** (0.5 / power) - eps ** (1 / power)
    if power == 1 and eps == 0:
        slope = np.sign(s)
    else:
        slope = s * np.power(square, 0.5 / power - 1, out=np.zeros_like(s), where=square > 0)
    with np.errstate(divide="ignore"):
        by_a = slope * np.where(slope != 0, a ** (power - 1), 0.0)
        by_b = -slope * np.where(slope != 0, b ** (power - 1), 0.0)
    return value, np.clip(by_a, -MAX_SLOPE, MAX_SLOPE), np.clip(by_b, -MAX_SLOPE, MAX_SLOPE)


@dataclass(frozen=True, eq=False)
class Placed(Shape):
    """A shape seen through an affine map: F(P) = F_shape(M^-1 P). Distance ratios are kept by every affine map."""

    shape: Shape
    matrix: F64
    """(3, 4) map from the shape's frame to the outer one, for column vectors."""

    @classmethod
    def affine(cls, shape: Shape, matrix: ArrayLike) -> "Placed":
        """`shape` under a (3, 4) or (4, 4) matrix; raises ShapeError where the matrix cannot be inverted."""
        m = np.array(matrix, np.float64)
        if m.shape == (4, 4) and np.allclose(m[3], (0, 0, 0, 1)):
            m = m[:3].copy()
        if m.shape != (3, 4) or not np.isfinite(m).all():
            raise ShapeError(f"Placed: matrix has the form {m.shape}, expected finite (3, 4), or (4, 4) with a last row 0 0 0 1")
        scale = np.linalg.norm(m[:, :3])
        if abs(np.linalg.det(m[:, :3])) <= 1e-9 * scale**3:
            raise ShapeError("Placed: matrix flattens space, expected one that can be inverted")
        m.setflags(write=False)
        return cls(shape, m)

    @classmethod
    def rigid(cls, shape: Shape, translation: ArrayLike, rotation: ArrayLike | None) -> "Placed":
        """`shape` rotated by a quaternion (x, y, z, w), then translated."""
        m = np.zeros((3, 4))
        m[:, 3] = vector("Placed", "translation", np.asarray(translation, np.float64).ravel())
        m[:, :3] = np.eye(3) if rotation is None else rotation_matrix(rotation)
        return cls.affine(shape, m)

    @classmethod
    def scale(cls, shape: Shape, factor: ArrayLike, about: ArrayLike) -> "Placed":
        """`shape` scaled by one factor or three, about a point."""
        factors = np.broadcast_to(np.asarray(factor, np.float64), (3,))
        for i, f in enumerate(factors):
            positive("Placed", f"factor[{i}]", float(f))
        centre = np.array(vector("Placed", "about", np.asarray(about, np.float64).ravel()))
        return cls.affine(shape, np.column_stack([np.diag(factors), centre - factors * centre]))

    @cached_property
    def inverse(self) -> F64:
        """(3, 4) map from the outer frame to the shape's."""
        linear: F64 = np.linalg.inv(self.matrix[:, :3]).astype(np.float64)
        return np.column_stack([linear, -linear @ self.matrix[:, 3]])

    @property
    @override
    def operands(self) -> tuple[Shape, ...]:
        return (self.shape,)

    @property
    @override
    def bounds(self) -> F64:
        return placed_box(self.matrix, self.shape.bounds)

    @override
    def sample(self, points: F64, memo: dict[int, Sample]) -> Sample:
        linear, offset = self.inverse[:, :3], self.inverse[:, 3]
        value, slope = self.shape._sampled(points @ linear.T + offset, {})
        return value, slope @ linear

    def __repr__(self) -> str:
        where = ", ".join(f"{v:g}" for v in self.matrix[:, 3])
        rigid = np.allclose(self.matrix[:, :3], np.eye(3))
        return f"{self.shape!r}.moved(({where}))" if rigid else f"{self.shape!r}.transformed(... at ({where}))"


def placed_box(matrix: F64, box: F64) -> F64:
    """The box (2, 3) around an affinely mapped box (2, 3)."""
    centre, half = box.mean(axis=0), np.ptp(box, axis=0) / 2
    middle = matrix[:, :3] @ centre + matrix[:, 3]
    reach = np.abs(matrix[:, :3]) @ half
    return np.stack([middle - reach, middle + reach])


def rotation_matrix(quaternion: ArrayLike) -> F64:
    """(3, 3) matrix of a quaternion (x, y, z, w), normalised here; ShapeError where it is zero."""
    q = np.asarray(quaternion, np.float64).ravel()
    if q.shape != (4,) or not np.isfinite(q).all() or not np.linalg.norm(q) > 0:
        raise ShapeError(f"rotation is {quaternion!r}, expected a quaternion (x, y, z, w) that is not zero")
    x, y, z, w = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def total(*shapes: Shape) -> Sum:
    """The blend F = sum F_i; sums of sums become one."""
    flat: list[Shape] = []
    weights: list[float] = []
    for shape in shapes:
        if isinstance(shape, Sum):
            flat += shape.shapes
            weights += shape.weights
        else:
            flat.append(shape)
            weights.append(1.0)
    return Sum(tuple(flat), tuple(weights))


def union(*shapes: Shape, power: float = math.inf) -> Combination:
    """The union: the largest field, or the smooth Ricci union of a finite `power` >= 1 (lower is smoother)."""
    return _extreme(shapes, power, largest=True)


def intersection(*shapes: Shape, power: float = math.inf) -> Combination:
    """The intersection: the smallest field, or the smooth Ricci intersection of a finite `power` >= 1."""
    return _extreme(shapes, power, largest=False)


def _extreme(shapes: Sequence[Shape], power: float, *, largest: bool) -> Combination:
    flat: list[Shape] = []
    for shape in shapes:
        same = isinstance(shape, Extremum) and shape.largest == largest and power == math.inf
        flat += shape.operands if same else [shape]
    return Extremum(tuple(flat), largest) if power == math.inf else Ricci(tuple(flat), power, largest)


def difference(a: Shape, b: Shape, *, threshold: float = THRESHOLD, power: float = math.inf) -> Combination:
    """a without b at the level T: min(a, 2T - b), or its smooth Ricci form."""
    return intersection(a, Complement(b, threshold), power=power)


def subtract(a: Shape, b: Shape) -> Sum:
    """The algebraic difference F_a - F_b: b pushes the surface of a away, with a blend."""
    return total(Sum((a,)), Sum((b,), (-1.0,)))


def selective(shapes: Iterable[Shape], blends: Iterable[tuple[int, int]]) -> Shape:
    """Shapes of which only some pairs blend: `blends` lists those pairs as indices.

    The field is the largest of the sums over every maximal set of shapes that all blend with each other, so an upper
    arm may blend with the forearm and the forearm with the hand without the hand blending with the upper arm.
    """
    parts = tuple(shapes)
    near: list[set[int]] = [set() for _ in parts]
    for i, j in blends:
        if not (0 <= i < len(parts) and 0 <= j < len(parts)) or i == j:
            raise ShapeError(f"selective: blends has the pair ({i}, {j}), expected two different indices below {len(parts)}")
        near[i].add(j)
        near[j].add(i)
    groups = [total(*(parts[i] for i in sorted(group))) for group in _cliques(near)]
    return groups[0] if len(groups) == 1 else Extremum(tuple(groups))


def _cliques(near: list[set[int]]) -> list[set[int]]:
    """Every maximal clique of a graph given as neighbour sets (Bron and Kerbosch, with pivot)."""
    found: list[set[int]] = []
    stack: list[tuple[set[int], set[int], set[int]]] = [(set(), set(range(len(near))), set())]
    while stack:
        chosen, candidates, excluded = stack.pop()
        if not candidates and not excluded:
            found.append(chosen)
            continue
        pivot = max(candidates | excluded, key=lambda v: len(candidates & near[v]))
        for v in sorted(candidates - near[pivot]):
            stack.append((chosen | {v}, candidates & near[v], excluded & near[v]))
            candidates = candidates - {v}
            excluded = excluded | {v}
    return sorted(found, key=sorted)
