"""The primitive <V, S, f>: realm, skeleton and blend function of the distance ratio (Singh §3.1; mathematics M1.1)."""

# pyright: reportUnnecessaryIsInstance=false

from abc import abstractmethod
from dataclasses import dataclass, fields
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import override

from vistel.arrays import F64
from vistel.implicit.blend import QUARTIC, Blend
from vistel.implicit.checks import ShapeError, finite, query_points
from vistel.implicit.graph.shape import Sample, Shape


@dataclass(frozen=True, kw_only=True, repr=False)
class Primitive(Shape):
    """A leaf of the graph: F = weight * f(d), d the distance ratio, 0 on the skeleton and 1 on the boundary of V."""

    weight: float = 1.0
    blend: Blend = QUARTIC

    kind: ClassVar[str]
    """Name of the primitive's entry in `vistel.implicit.primitives.kinds.KINDS`."""

    def __post_init__(self) -> None:
        name = type(self).__name__
        object.__setattr__(self, "weight", finite(name, "weight", self.weight))
        if not isinstance(self.blend, Blend):
            raise ShapeError(f"{name}: blend is {self.blend!r}, expected a Blend such as QUARTIC")

    @property
    @override
    def operands(self) -> tuple[Shape, ...]:
        return ()

    @abstractmethod
    def ratio(self, points: F64) -> Sample:
        """Distance ratio d (n,), not clamped at 1, and its gradient (n, 3) at points (n, 3); zero slope on S."""

    @abstractmethod
    def closest(self, points: F64) -> F64:
        """The skeleton point Q (n, 3) that defines d at each of the points (n, 3)."""

    @property
    @abstractmethod
    def parameters(self) -> F64:
        """The numbers of the primitive in its own frame, laid out as its kind's kernel reads them."""

    @property
    def frame(self) -> F64 | None:
        """(3, 4) map from the frame of `parameters` to the shape's; None where they are the same."""
        return None

    @property
    def bounding_capsule(self) -> F64:
        """(7,) two points and a radius: a capsule that holds V, for quick rejection."""
        low, high = self.bounds
        middle = (low + high) / 2
        return np.array([*middle, *middle, np.linalg.norm(high - low) / 2], np.float64)

    def placed(self, matrix: F64, scale: float) -> "Primitive | None":
        """This primitive under a similarity (rotation, one scale, translation), or None: then the points move."""
        return None

    def distance_ratio(self, points: ArrayLike) -> F64:
        """d (...,) at points (..., 3): 0 on the skeleton, 1 on the boundary of V and outside it."""
        return np.minimum(self.ratio(query_points(points))[0], 1.0).reshape(np.shape(points)[:-1])

    def skeleton_point(self, points: ArrayLike) -> F64:
        """The skeleton point Q (..., 3) that defines the field at points (..., 3)."""
        return self.closest(query_points(points)).reshape(np.shape(points))

    def boundary_point(self, points: ArrayLike) -> F64:
        """P' (..., 3): where the ray from Q through P leaves V; Q itself for P = Q."""
        p = query_points(points)
        q, d = self.closest(p), self.ratio(p)[0][:, None]
        return (q + np.divide(p - q, d, out=np.zeros_like(p), where=d > 0)).reshape(np.shape(points))

    def surface_point(self, points: F64) -> F64:
        """(n, 3) where textures are looked up for points (n, 3): P', or for blobs of a surface W the point on W."""
        return self.boundary_point(points)

    def __repr__(self) -> str:
        words: list[str] = []
        for field in fields(self):
            value: Any = getattr(self, field.name)
            if field.kw_only and value == field.default:
                continue
            words.append(f"{field.name}={_brief(value)}" if field.kw_only else _brief(value))
        return f"{type(self).__name__}({', '.join(words)})"

    @override
    def sample(self, points: F64, memo: dict[int, Sample]) -> Sample:
        d, slope = self.ratio(points)
        return self.weight * self.blend(d), (self.weight * self.blend.derivative(d))[:, None] * slope


def _brief(value: Any) -> str:
    """A constructor's argument in few characters."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple):
        return f"({', '.join(map(_brief, cast('tuple[Any, ...]', value)))})"
    return f"<{len(value)} points>" if hasattr(value, "dtype") else repr(value)


def influence(name: str, blend: Blend, weight: float, threshold: float) -> float:
    """How many times its surface radius a primitive's influence reaches: 1 / f^-1(T / weight)."""
    if not 0 < threshold < weight:
        raise ShapeError(f"{name}: threshold is {threshold:g}, expected 0 < T < weight = {weight:g}")
    return 1.0 / float(blend.inverse(threshold / weight))


def unit_rows(rows: F64) -> F64:
    """Rows (n, 3) at unit length; zero rows stay zero."""
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.divide(rows, length, out=np.zeros_like(rows), where=length > 0)
