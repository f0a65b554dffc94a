"""Primitives whose realm is an offset of the skeleton: sphere, sphylinder, cone-sphere, rounded polygon (mathematics M1.4, M1.5).

Radii are radii of influence (V), as in <V, S, f>; `of_surface` takes those of the surface F = T instead.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import override

from vistel.arrays import F64
from vistel.implicit.blend import QUARTIC, Blend
from vistel.implicit.checks import ShapeError, Vec3, point_rows, positive, vector
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.graph.primitive import Primitive, influence, unit_rows
from vistel.implicit.graph.shape import Sample

POINT = 1e-8
"""A segment shorter than this many radii is a point."""


def influence_of(name: str, threshold: float, options: dict[str, Any]) -> float:
    """How many times the surface radius the influence reaches, for a constructor's options."""
    weight: float = options.get("weight", 1.0)
    blend: Blend = options.get("blend", QUARTIC)
    return influence(name, blend, weight, threshold)


@dataclass(frozen=True, repr=False)
class Sphere(Primitive):
    """Offset of a point: d = |P - C| / r."""

    centre: Vec3
    radius: float
    kind = "sphere"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "centre", vector("Sphere", "centre", self.centre))
        object.__setattr__(self, "radius", positive("Sphere", "radius", self.radius))

    @classmethod
    def of_surface(cls, centre: Vec3, radius: float, *, threshold: float = THRESHOLD, **options: Any) -> Self:
        """The sphere whose surface F = threshold has this radius; options: weight, blend."""
        return cls(centre, radius * influence_of("Sphere", threshold, options), **options)

    @property
    @override
    def bounds(self) -> F64:
        c = np.array(self.centre)
        return np.stack([c - self.radius, c + self.radius])

    @override
    def closest(self, points: F64) -> F64:
        return np.broadcast_to(np.array(self.centre), points.shape).copy()

    @override
    def ratio(self, points: F64) -> Sample:
        offset = points - np.array(self.centre)
        return np.linalg.norm(offset, axis=1) / self.radius, unit_rows(offset) / self.radius

    @property
    @override
    def parameters(self) -> F64:
        return np.array([*self.centre, 1 / self.radius**2])

    @property
    @override
    def bounding_capsule(self) -> F64:
        return np.array([*self.centre, *self.centre, self.radius])

    @override
    def placed(self, matrix: F64, scale: float) -> "Sphere":
        return replace(self, centre=mapped(matrix, self.centre), radius=self.radius * scale)


@dataclass(frozen=True, repr=False)
class Sphylinder(Primitive):
    """Offset of a line segment (a capsule): d = |P - Q| / r, Q the segment's closest point to P."""

    start: Vec3
    end: Vec3
    radius: float
    kind = "sphylinder"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "start", vector("Sphylinder", "start", self.start))
        object.__setattr__(self, "end", vector("Sphylinder", "end", self.end))
        object.__setattr__(self, "radius", positive("Sphylinder", "radius", self.radius))

    @classmethod
    def of_surface(cls, start: Vec3, end: Vec3, radius: float, *, threshold: float = THRESHOLD, **options: Any) -> Self:
        """The sphylinder whose surface F = threshold has this radius; options: weight, blend."""
        return cls(start, end, radius * influence_of("Sphylinder", threshold, options), **options)

    @property
    @override
    def bounds(self) -> F64:
        ends = np.array([self.start, self.end])
        return np.stack([ends.min(axis=0) - self.radius, ends.max(axis=0) + self.radius])

    @override
    def closest(self, points: F64) -> F64:
        a = np.array(self.start)
        axis = np.array(self.end) - a
        scale = self._per_length2
        along = np.clip((points - a) @ axis * scale, 0, 1)
        return a + along[:, None] * axis

    @override
    def ratio(self, points: F64) -> Sample:
        offset = points - self.closest(points)
        return np.linalg.norm(offset, axis=1) / self.radius, unit_rows(offset) / self.radius

    @property
    @override
    def parameters(self) -> F64:
        axis = np.array(self.end) - np.array(self.start)
        return np.array([*self.start, *axis, self._per_length2, 1 / self.radius**2])

    @property
    def _per_length2(self) -> float:
        """One over the squared length; 0 for a length that is nothing beside the radius: then it is a sphere."""
        length = math.dist(self.start, self.end)
        return 1 / length**2 if length > POINT * self.radius else 0.0

    @property
    @override
    def bounding_capsule(self) -> F64:
        return np.array([*self.start, *self.end, self.radius])

    @override
    def placed(self, matrix: F64, scale: float) -> "Sphylinder":
        ends = {"start": mapped(matrix, self.start), "end": mapped(matrix, self.end)}
        return replace(self, **ends, radius=self.radius * scale)


@dataclass(frozen=True, repr=False)
class ConeSphere(Primitive):
    """The hull of two balls, with a radius that varies along the segment between their centres.

    d is the least ratio |P - C(s)| / r(s) over the segment, so the field is C1 off the axis and the definition holds
    for equal and for nested balls too. `printed=True` takes the ratio of Singh §A.3.1 instead, whose field is only C0
    where cone and caps meet; it needs two balls neither of which holds the other, of unequal radii.
    """

    start: Vec3
    end: Vec3
    radius_start: float
    radius_end: float
    printed: bool = False
    kind = "cone_sphere"

    def __post_init__(self) -> None:
        super().__post_init__()
        for end in ("start", "end"):
            object.__setattr__(self, end, vector("ConeSphere", end, getattr(self, end)))
            name = f"radius_{end}"
            object.__setattr__(self, name, positive("ConeSphere", name, getattr(self, name)))
        if self.printed:
            change = abs(self.radius_end - self.radius_start)
            if not 1e-4 * self.length < change < self.length:
                raise ShapeError(
                    f"ConeSphere: printed=True with radii differing by {change:g} over a length of {self.length:g}, "
                    "expected a difference between 1e-4 and 1 times the length; leave printed=False"
                )

    @classmethod
    def of_surface(
        cls, start: Vec3, end: Vec3, radius_start: float, radius_end: float, *, threshold: float = THRESHOLD, **options: Any
    ) -> Self:
        """The cone-sphere whose surface F = threshold has these radii; options: printed, weight, blend."""
        reach = influence_of("ConeSphere", threshold, options)
        return cls(start, end, radius_start * reach, radius_end * reach, **options)

    @property
    def length(self) -> float:
        """Distance between the two centres; 0 where it is nothing beside the radii."""
        length = math.dist(self.start, self.end)
        return length if length > POINT * max(self.radius_start, self.radius_end) else 0.0

    @property
    def axis(self) -> F64:
        """(3,) unit vector from start to end; zero when they coincide."""
        return unit_rows(np.array([self.end]) - np.array([self.start]))[0]

    @property
    def theta(self) -> float:
        """Angle between the cone's normal and minus the axis [rad] (Singh §A.3.1)."""
        return math.acos((self.radius_end - self.radius_start) / self.length)

    @property
    def apex(self) -> F64:
        """(3,) apex C0 of the cone (Singh §A.3.1); not defined for equal radii."""
        return np.array(self.start) - self.axis * self.radius_start / math.cos(self.theta)

    @property
    @override
    def bounds(self) -> F64:
        a, b = np.array(self.start), np.array(self.end)
        return np.stack(
            [np.minimum(a - self.radius_start, b - self.radius_end), np.maximum(a + self.radius_start, b + self.radius_end)]
        )

    def _along(self, points: F64) -> tuple[F64, F64]:
        """Position s (n,) along the axis of the defining centre, and its radius (n,)."""
        length = self.length
        if length == 0:
            return np.zeros(len(points)), np.full(len(points), max(self.radius_start, self.radius_end))
        k = (self.radius_end - self.radius_start) / length
        offset = points - np.array(self.start)
        x = offset @ self.axis
        rho2 = np.maximum(np.einsum("ij,ij->i", offset, offset) - x * x, 0)
        if self.printed:
            # t of A.3.1 measured from the start instead of the apex: P lies on the cone's normal line through s.
            s = np.clip(x + np.sqrt(rho2) / math.tan(self.theta), 0, length)
        else:
            radius = self.radius_start + k * x
            inside = x + k * np.divide(rho2, radius, out=np.zeros_like(rho2), where=radius > 0)
            s = np.clip(np.where(radius > 0, inside, length if k > 0 else 0.0), 0, length)
        return s, self.radius_start + k * s

    @override
    def closest(self, points: F64) -> F64:
        return np.array(self.start) + self._along(points)[0][:, None] * self.axis

    @override
    def ratio(self, points: F64) -> Sample:
        s, radius = self._along(points)
        offset = points - (np.array(self.start) + s[:, None] * self.axis)
        d, normal = np.linalg.norm(offset, axis=1) / radius, unit_rows(offset)
        if not self.printed:
            return d, normal / radius[:, None]
        c = math.cos(self.theta)
        on_cone = (s > 0) & (s < self.length)
        scale = radius * (1 - c * c)
        along = np.where(on_cone, c * (1 - d) / scale, 0.0)
        across = np.where(on_cone, (1 - d * c * c) / scale, 1 / radius)
        return d, across[:, None] * normal + along[:, None] * self.axis

    @property
    @override
    def parameters(self) -> F64:
        length = self.length
        start, r = self.radius_start, self.radius_start
        k = 0.0 if length == 0 else (self.radius_end - r) / length
        r = max(start, self.radius_end) if length == 0 else start
        return np.array([*self.start, *self.axis, length, r, k, float(self.printed)])

    @property
    @override
    def bounding_capsule(self) -> F64:
        return np.array([*self.start, *self.end, max(self.radius_start, self.radius_end)])

    @override
    def placed(self, matrix: F64, scale: float) -> "ConeSphere":
        ends = {"start": mapped(matrix, self.start), "end": mapped(matrix, self.end)}
        radii = {"radius_start": self.radius_start * scale, "radius_end": self.radius_end * scale}
        return replace(self, **ends, **radii)


@dataclass(frozen=True, eq=False, repr=False)
class RoundedPolygon(Primitive):
    """Offset of a filled planar polygon, convex or not: d = |P - Q| / r, Q the polygon's closest point to P."""

    vertices: F64
    radius: float
    kind = "rounded_polygon"

    def __post_init__(self) -> None:
        super().__post_init__()
        corners = point_rows("RoundedPolygon", "vertices", self.vertices)
        corners.setflags(write=False)
        object.__setattr__(self, "vertices", corners)
        object.__setattr__(self, "radius", positive("RoundedPolygon", "radius", self.radius))
        if len(corners) < 3:
            raise ShapeError(f"RoundedPolygon: vertices has {len(corners)} rows, expected three or more")
        crossing = _self_crossing(self.plane[2])
        if crossing is not None:
            raise ShapeError(f"RoundedPolygon: edges {crossing[0]} and {crossing[1]} cross, expected a simple polygon")

    @classmethod
    def of_surface(cls, vertices: ArrayLike, radius: float, *, threshold: float = THRESHOLD, **options: Any) -> Self:
        """The rounded polygon whose surface F = threshold has this radius; options: weight, blend."""
        return cls(np.asarray(vertices, np.float64), radius * influence_of("RoundedPolygon", threshold, options), **options)

    @cached_property
    def plane(self) -> tuple[F64, F64, F64]:
        """Origin (3,), rows of the frame (3, 3) with the normal last, and the vertices (n, 2) in it."""
        return plane_of("RoundedPolygon", self.vertices)

    @property
    @override
    def bounds(self) -> F64:
        return np.stack([self.vertices.min(axis=0) - self.radius, self.vertices.max(axis=0) + self.radius])

    @override
    def closest(self, points: F64) -> F64:
        origin, frame, flat = self.plane
        local = (points - origin) @ frame.T
        q = closest_in_polygon(local[:, :2], flat)
        return origin + q @ frame[:2]

    @override
    def ratio(self, points: F64) -> Sample:
        offset = points - self.closest(points)
        return np.linalg.norm(offset, axis=1) / self.radius, unit_rows(offset) / self.radius

    @property
    @override
    def parameters(self) -> F64:
        flat = self.plane[2]
        return np.concatenate([[1 / self.radius**2, len(flat)], flat.ravel()])

    @property
    @override
    def frame(self) -> F64:
        origin, frame, _ = self.plane
        return np.column_stack([frame.T, origin])


def mapped(matrix: F64, point: Vec3) -> Vec3:
    """An affine (3, 4) matrix applied to a point."""
    x, y, z = matrix[:, :3] @ np.array(point) + matrix[:, 3]
    return float(x), float(y), float(z)


def plane_of(name: str, corners: F64) -> tuple[F64, F64, F64]:
    """Origin (3,), frame (3, 3) with the normal as last row, and plane coordinates (n, 2) of a planar polygon.

    Raises ShapeError where the polygon has no area or is not planar.
    """
    size = float(np.ptp(corners, axis=0).max())
    origin = corners.mean(axis=0)
    centred = corners - origin
    area2 = np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)
    if np.linalg.norm(area2) <= 1e-9 * size * size:
        raise ShapeError(f"{name}: vertices enclose no area, expected a polygon; for a segment use a Sphylinder")
    normal = area2 / np.linalg.norm(area2)
    far = centred[np.argmax(np.linalg.norm(centred, axis=1))]
    x_axis = far - normal * (far @ normal)
    x_axis /= np.linalg.norm(x_axis)
    frame = np.stack([x_axis, np.cross(normal, x_axis), normal])
    local = centred @ frame.T
    worst = int(np.argmax(np.abs(local[:, 2])))
    if abs(local[worst, 2]) > 1e-5 * size:
        raise ShapeError(
            f"{name}: vertices are not in one plane (row {worst} is {abs(local[worst, 2]):.3g} off), "
            "expected a planar polygon; split it into triangles"
        )
    return origin, frame, local[:, :2]


def closest_in_polygon(points: F64, corners: F64) -> F64:
    """The closest point (n, 2) of the filled simple polygon with corners (m, 2) to points (n, 2)."""
    following = np.roll(corners, -1, axis=0)
    best, best2 = np.zeros_like(points), np.full(len(points), np.inf)
    inside = np.zeros(len(points), bool)
    for a, b in zip(corners, following, strict=True):
        edge = b - a
        along = np.clip((points - a) @ edge / (edge @ edge), 0, 1)
        q = a + along[:, None] * edge
        distance2 = ((points - q) ** 2).sum(axis=1)
        nearer = distance2 < best2
        best[nearer], best2[nearer] = q[nearer], distance2[nearer]
        # Even-odd rule: count edges crossed by the ray towards +x.
        spans = (a[1] > points[:, 1]) != (b[1] > points[:, 1])
        if edge[1] != 0:
            inside ^= spans & (points[:, 0] < a[0] + edge[0] * (points[:, 1] - a[1]) / edge[1])
    return np.where(inside[:, None], points, best)


def _self_crossing(corners: F64) -> tuple[int, int] | None:
    """The first pair of edges of a closed polygon (m, 2) that cross properly, or None."""

    def side(a: F64, b: F64, c: F64) -> float:
        return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))

    m = len(corners)
    for i in range(m):
        a, b = corners[i], corners[(i + 1) % m]
        if np.array_equal(a, b):
            raise ShapeError(f"RoundedPolygon: vertices rows {i} and {(i + 1) % m} are equal, expected distinct ones")
        for j in range(i + 2, m if i else m - 1):
            c, d = corners[j], corners[(j + 1) % m]
            if side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0:
                return i, j
    return None
