"""Polyblob, the primitive that changes shape: a polyhedron about a polyhedral skeleton (Singh §3.1; mathematics M1.12)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from vistel.arrays import F64, I64
from vistel.implicit.checks import ShapeError
from vistel.implicit.graph.primitive import Primitive
from vistel.implicit.graph.shape import Sample
from vistel.implicit.primitives.polyhedron import Polyhedron, listed
from vistel.implicit.primitives.volume import PAIRS


@dataclass(frozen=True, eq=False, repr=False)
class Polyblob(Primitive):
    """d = |P - Q| / |P' - Q|: Q the closest point of the core S, P' where the ray from Q through P leaves the hull V.

    hull, core: polyhedra of any genus, the core inside the hull; inside the core d = 0. Its surfaces go from the core
    at T = 1 to the hull at T = 0.
    """

    hull: Polyhedron
    core: Polyhedron
    kind = "polyblob"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("hull", "core"):
            if not isinstance(getattr(self, name), Polyhedron):
                raise ShapeError(f"Polyblob: {name} is {getattr(self, name)!r}, expected a Polyhedron")
        outside = np.flatnonzero(~inside_polyhedron(self.hull, self.core.vertices))
        if len(outside):
            raise ShapeError(f"Polyblob: core vertices {listed([int(v) for v in outside])} are not inside the hull; scale it down")

    @cached_property
    def convex(self) -> bool:
        """Whether the hull is convex; then no search is needed for P'."""
        size = float(np.ptp(self.hull.vertices, axis=0).max())
        level = np.einsum("mc,mc->m", self.hull.normals, self.hull.corners[:, 0])
        return bool((self.hull.vertices @ self.hull.normals.T <= level + 1e-7 * size).all())

    @property
    @override
    def bounds(self) -> F64:
        return self.hull.bounds

    @cached_property
    def core_normals(self) -> F64:
        """(m, 7, 3) for each core triangle the normals that tell inside from outside at its face, edges, corners."""
        return feature_normals(self.core)

    @override
    def closest(self, points: F64) -> F64:
        q, which, feature = closest_on_triangles(self.core.corners, points)
        inside = np.einsum("nc,nc->n", points - q, self.core_normals[which, feature]) <= 0
        return np.where(inside[:, None], points, q)

    @override
    def ratio(self, points: F64) -> Sample:
        q, which, feature = closest_on_triangles(self.core.corners, points)
        offset = points - q
        inside = np.einsum("nc,nc->n", offset, self.core_normals[which, feature]) <= 0
        n, level = self.hull.normals, np.einsum("mc,mc->m", self.hull.normals, self.hull.corners[:, 0])
        hit = self._leaving(q, offset)
        normal = n[hit]
        reach = level[hit] - np.einsum("nc,nc->n", normal, q)
        d = np.einsum("nc,nc->n", normal, offset) / reach
        d = np.where(inside, 0.0, d)
        # grad d = (N - (1 - d) J N) / (N . (P' - Q)), J = dQ/dP projects on the skeleton feature (mathematics M1.3).
        turned = project(self.core.corners[which], self.core.normals[which], feature, normal)
        slope = (normal - (1 - d)[:, None] * turned) / reach[:, None]
        return d, np.where((d > 0)[:, None], slope, 0.0)

    def _leaving(self, q: F64, offset: F64) -> I64:
        """The hull triangle (n,) by which the ray q + t offset leaves."""
        n, level = self.hull.normals, np.einsum("mc,mc->m", self.hull.normals, self.hull.corners[:, 0])
        if self.convex:
            found = np.zeros(len(q), np.int64)
            step = max(1, PAIRS // len(n))
            for first in range(0, len(q), step):
                part = slice(first, first + step)
                found[part] = ((offset[part] @ n.T) / (level - q[part] @ n.T)).argmax(axis=1)
            return found
        return leaving_triangle(self.hull.corners, q, offset)

    @property
    @override
    def parameters(self) -> F64:
        core, hull = self.core, self.hull
        level = np.einsum("mc,mc->m", hull.normals, hull.corners[:, 0])
        core_rows = np.concatenate([core.corners.reshape(-1, 9), self.core_normals.reshape(-1, 21)], axis=1)
        hull_rows = np.concatenate([hull.normals, level[:, None], hull.corners.reshape(-1, 9)], axis=1)
        head = [len(core_rows), len(hull_rows), float(self.convex)]
        return np.concatenate([head, core_rows.ravel(), hull_rows.ravel()])


FACE = 0
EDGE_AB = 1
EDGE_BC = 2
EDGE_CA = 3
CORNER_A = 4
CORNER_B = 5
CORNER_C = 6


def closest_on_triangles(corners: F64, points: F64) -> tuple[F64, I64, I64]:
    """Closest points (n, 3) of triangles (m, 3, 3) to points (n, 3); the triangle (n,) and its feature 0-6 (n,)."""
    best, which, feature = np.zeros_like(points), np.zeros(len(points), np.int64), np.zeros(len(points), np.int64)
    step = max(1, PAIRS // (8 * len(corners)))
    for first in range(0, len(points), step):
        part = slice(first, first + step)
        q, f = _closest_pairs(corners, points[part])
        nearest = ((points[part, None] - q) ** 2).sum(axis=2).argmin(axis=1)
        rows = np.arange(len(nearest))
        best[part], which[part], feature[part] = q[rows, nearest], nearest, f[rows, nearest]
    return best, which, feature


def _closest_pairs(corners: F64, points: F64) -> tuple[F64, I64]:
    """Closest point (n, m, 3) and feature (n, m) of every triangle to every point (Ericson 2005, §5.1.5)."""
    a, b, c = corners.transpose(1, 0, 2)
    ab, ac = b - a, c - a
    ap, bp, cp = points[:, None] - a, points[:, None] - b, points[:, None] - c
    d1, d2 = (ap * ab).sum(axis=2), (ap * ac).sum(axis=2)
    d3, d4 = (bp * ab).sum(axis=2), (bp * ac).sum(axis=2)
    d5, d6 = (cp * ab).sum(axis=2), (cp * ac).sum(axis=2)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    with np.errstate(divide="ignore", invalid="ignore"):
        v_ab, v_ca = d1 / (d1 - d3), d2 / (d2 - d6)
        v_bc = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        total = va + vb + vc
        v_face, w_face = vb / total, vc / total
    feature = np.select(
        [
            (d1 <= 0) & (d2 <= 0),
            (d3 >= 0) & (d4 <= d3),
            (vc <= 0) & (d1 >= 0) & (d3 <= 0),
            (d6 >= 0) & (d5 <= d6),
            (vb <= 0) & (d2 >= 0) & (d6 <= 0),
            (va <= 0) & (d4 - d3 >= 0) & (d5 - d6 >= 0),
        ],
        [CORNER_A, CORNER_B, EDGE_AB, CORNER_C, EDGE_CA, EDGE_BC],
        FACE,
    )
    zero, one = np.zeros_like(d1), np.ones_like(d1)
    v = np.choose(feature, [v_face, v_ab, 1 - v_bc, zero, zero, one, zero])
    w = np.choose(feature, [w_face, zero, v_bc, v_ca, zero, zero, one])
    return a + v[..., None] * ab + w[..., None] * ac, feature


def project(corners: F64, normals: F64, feature: I64, vectors: F64) -> F64:
    """Vectors (n, 3) projected on the tangent space of a feature of each of n triangles: plane, line or point."""
    ends = np.array([(0, 0), (0, 1), (1, 2), (2, 0), (0, 0), (0, 0), (0, 0)])[feature]
    rows = np.arange(len(corners))
    edge = corners[rows, ends[:, 1]] - corners[rows, ends[:, 0]]
    length2 = (edge * edge).sum(axis=1)
    along = np.divide((edge * vectors).sum(axis=1), length2, out=np.zeros_like(length2), where=length2 > 0)
    flat = vectors - (normals * vectors).sum(axis=1)[:, None] * normals
    on_face = (feature == FACE).astype(np.float64)[:, None]
    return on_face * flat + (1 - on_face) * along[:, None] * edge


def feature_normals(shape: Polyhedron) -> F64:
    """(m, 7, 3) pseudonormals of the triangles' face, edges AB, BC, CA and corners (Baerentzen and Aanaes 2005)."""
    out = np.zeros((len(shape.triangles), 7, 3))
    out[:, FACE] = shape.normals
    across: dict[tuple[int, int], F64] = {}
    for triangle, normal in zip(shape.triangles, shape.normals, strict=True):
        for i in range(3):
            edge = (int(triangle[i]), int(triangle[(i + 1) % 3]))
            key = (min(edge), max(edge))
            across[key] = across.get(key, np.zeros(3)) + normal
    for row, triangle in enumerate(shape.triangles):
        for i in range(3):
            edge = (int(triangle[i]), int(triangle[(i + 1) % 3]))
            out[row, EDGE_AB + i] = across[min(edge), max(edge)]
    out[:, CORNER_A:] = shape.vertex_normals[shape.triangles]
    return out


def leaving_triangle(corners: F64, origin: F64, direction: F64) -> I64:
    """The first triangle (n,) of (m, 3, 3) that rays (n, 3) meet in front of them, or the one they miss least."""
    a, b, c = corners.transpose(1, 0, 2)
    e1, e2 = b - a, c - a
    found = np.zeros(len(origin), np.int64)
    step = max(1, PAIRS // (6 * len(corners)))
    for first in range(0, len(origin), step):
        part = slice(first, first + step)
        o, d = origin[part, None], direction[part, None]
        p = np.cross(d, e2)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1 / (p * e1).sum(axis=2)
            s = o - a
            u = (s * p).sum(axis=2) * scale
            r = np.cross(s, e1)
            v = (r * d).sum(axis=2) * scale
            t = (r * e2).sum(axis=2) * scale
            least = np.nan_to_num(np.minimum(np.minimum(u, v), 1 - u - v), nan=-np.inf)
        t = np.where((t > 0) & np.isfinite(t), t, np.inf)
        hit = np.where(least >= -1e-9, t, np.inf)
        missed = np.isinf(hit).all(axis=1)
        fallback = np.where(np.isfinite(t), least, -np.inf)
        found[part] = np.where(missed, fallback.argmax(axis=1), hit.argmin(axis=1))
    return found


def inside_polyhedron(shape: Polyhedron, points: F64) -> NDArray[np.bool_]:
    """Whether points (n, 3) are inside a polyhedron."""
    q, which, feature = closest_on_triangles(shape.corners, points)
    return np.einsum("nc,nc->n", points - q, feature_normals(shape)[which, feature]) < 0
