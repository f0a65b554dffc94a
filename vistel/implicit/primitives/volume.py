"""Distance ratios about a point: how far along the ray from a skeletal point S a volume ends (Singh §3.1, §3.2.1)."""

# pyright: reportUnnecessaryIsInstance=false

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vistel.arrays import F64, I64
from vistel.implicit.checks import ShapeError, Vec3, vector
from vistel.implicit.graph.primitive import Primitive, unit_rows
from vistel.implicit.primitives.polyhedron import Polyhedron, listed

Volume = Polyhedron | Primitive
PAIRS = 2_000_000
"""Point-triangle pairs looked at in one go."""


@dataclass(frozen=True, eq=False)
class Fan:
    """A polyhedron seen from a centre: the cones from it over every triangle.

    For g = M (P - S) in the cone of triangle ABC the sum s of g is the ratio to the polyhedron and g / s the
    barycentric coordinates of the point where the ray meets the triangle.
    """

    shape: Polyhedron
    centre: Vec3

    @cached_property
    def inverse(self) -> F64:
        """(m, 3, 3) matrices M = [A - S, B - S, C - S]^-1; zero for triangles seen edge-on."""
        columns = (self.shape.corners - np.array(self.centre)).transpose(0, 2, 1)
        volume = np.linalg.det(columns)
        usable = np.abs(volume) > 1e-12 * np.abs(volume).max()
        inverse = np.zeros_like(columns)
        inverse[usable] = np.linalg.inv(columns[usable])
        inverse[volume < 0] = 0.0  # turned away from the centre: never the triangle the ray leaves by
        return inverse

    @cached_property
    def sum_gradient(self) -> F64:
        """(m, 3) gradient N / (N . (A - S)) of the ratio in each cone."""
        return self.inverse.sum(axis=1)

    def find(self, points: F64) -> tuple[I64, F64]:
        """The triangle (n,) whose cone holds each of the points (n, 3), the first to be met, and g (n, 3)."""
        p = points - np.array(self.centre)
        which = np.zeros(len(p), np.int64)
        g = np.zeros((len(p), 3))
        step = max(1, PAIRS // len(self.inverse))
        for first in range(0, len(p), step):
            part = slice(first, first + step)
            every = np.einsum("mij,nj->nmi", self.inverse, p[part])
            size = np.abs(every).max(axis=2)
            least = np.where(size > 0, every.min(axis=2) / np.where(size > 0, size, 1.0), -1.0)
            crossing = np.where(least >= -1e-12, every.sum(axis=2), 0.0)
            which[part] = np.where(crossing.any(axis=1), crossing.argmax(axis=1), least.argmax(axis=1))
            g[part] = every[np.arange(len(every)), which[part]]
        return which, g


def checked_centre(name: str, volume: Volume, centre: Vec3, relaxed: bool) -> Vec3:
    """`centre` as floats; ShapeError unless the volume is star-shaped about it (not asked of it where `relaxed`)."""
    at = vector(name, "centre", centre)
    if isinstance(volume, Polyhedron):
        hidden = volume.hidden_faces(at)
        if hidden and not relaxed:
            raise ShapeError(
                f"{name}: the polyhedron is not star-shaped about {at}: it does not see faces {listed(hidden)}; "
                "move the centre, use more centres, or pass relaxed=True"
            )
    elif isinstance(volume, Primitive):
        if not float(volume.ratio(np.array([at]))[0][0]) < 1:
            raise ShapeError(f"{name}: centre {at} lies outside the volume, expected a point inside")
    else:
        raise ShapeError(f"{name}: volume is {volume!r}, expected a Polyhedron or a primitive")
    return at


def ray_ratio(volume: Primitive, centre: Vec3, points: F64) -> tuple[F64, F64]:
    """Ratio (n,) of an analytic volume about a point inside it, and its gradient (n, 3).

    The ray S + k (P - S) leaves V where the volume's own ratio is 1, at k = 1 / d; the slope follows from the normal
    there (Singh §3.1 with J = 0). The root is bracketed and found by the Illinois rule.
    """
    s = np.array(centre)
    offset = points - s
    distance = np.linalg.norm(offset, axis=1)
    away = unit_rows(offset)
    away[distance == 0] = (1.0, 0.0, 0.0)
    low = np.zeros(len(points))
    high = np.full(len(points), farthest(volume, centre))
    f_low = volume.ratio(np.broadcast_to(s, points.shape))[0] - 1
    f_high = volume.ratio(s + high[:, None] * away)[0] - 1
    for k in range(80):
        middle = 0.5 * (low + high) if k % 4 == 3 else (low * f_high - high * f_low) / (f_high - f_low)
        f = volume.ratio(s + middle[:, None] * away)[0] - 1
        beyond = f >= 0
        f_low = np.where(beyond, f_low * 0.5, f)
        f_high = np.where(beyond, f, f_high * 0.5)
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        if np.all(high - low <= 1e-15 * high):
            break
    edge = 0.5 * (low + high)
    slope = volume.ratio(s + edge[:, None] * away)[1]
    along = np.einsum("ij,ij->i", slope, away) * edge
    gradient = np.divide(slope, along[:, None], out=np.zeros_like(slope), where=along[:, None] > 0)
    gradient[distance == 0] = 0.0
    return distance / edge, gradient


def farthest(volume: Primitive, centre: Vec3) -> float:
    """A distance from the centre beyond which there is nothing of the volume."""
    low, high = volume.bounds
    return 1.01 * float(np.linalg.norm(np.maximum(np.abs(low - centre), np.abs(high - centre))))
