"""The way back: from a mesh to an implicit primitive, for the next round of modelling (Singh §3.2, §3.5)."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.implicit.checks import ShapeError, Vec3
from vistel.implicit.polygonise.mesh import SurfaceMesh, parts
from vistel.implicit.primitives.pointblob import Pointblob, PointSetblob
from vistel.implicit.primitives.polyhedron import Polyhedron

ROUNDS = 400
SLIVERS = 2e-3
"""Part of a surface's area that need not be seen."""


def pointblob_of(mesh: SurfaceMesh | Polyhedron, centre: Vec3 | None = None, **options: Any) -> Pointblob:
    """The pointblob whose surface is a mesh. centre: what sees all of it, found where not given (`seeing_point`).

    options: blend, threshold, weight, relaxed as for `Pointblob.of_surface`. Slivers of next to no area need not be
    seen. Raises ShapeError for a mesh of several parts and, unless relaxed, for one that no point sees all of;
    `pointset_of` takes several centres.
    """
    surface = _surface(mesh)
    if centre is None:
        centre = seeing_point(surface)
    if not options.get("relaxed", False):
        hidden = hidden_share(surface, centre)
        if hidden > SLIVERS:
            raise ShapeError(
                f"pointblob_of: {centre} does not see {100 * hidden:.2g} % of the mesh; what stands out hides it: "
                "give several centres (pointset_of) or pass relaxed=True"
            )
        options["relaxed"] = hidden > 0
    return Pointblob.of_surface(surface, centre, **options)


def hidden_share(surface: Polyhedron, centre: Vec3) -> float:
    """How much of a surface's area a point inside does not see, its faces looked at one by one."""
    area = _areas(surface)
    hidden = set(surface.hidden_faces(centre))
    if not hidden:
        return 0.0
    return float(area[np.isin(surface.triangle_face, list(hidden))].sum() / area.sum())


def pointset_of(mesh: SurfaceMesh | Polyhedron, centres: Sequence[Vec3], **options: Any) -> PointSetblob:
    """The point-setblob about several centres whose surface is a mesh; options as for `PointSetblob`."""
    return PointSetblob(_surface(mesh), np.asarray(centres, np.float64), **options)


def seeing_point(surface: Polyhedron) -> Vec3:
    """The point that is deepest below the planes of all faces but slivers, about: it sees most, if not all, of them.

    The smallest of the depths is concave; it is climbed by steps along the normal of the plane in the way.
    """
    area = _areas(surface)
    large = area > 0.02 * area.mean()
    normals, corners = surface.normals[large], surface.corners[large]
    level = np.einsum("ij,ij->i", normals, corners[:, 0])
    size = float(np.ptp(surface.vertices, axis=0).max())
    at = corners.mean(axis=(0, 1))
    best, depth = at, -np.inf
    for k in range(ROUNDS):
        depths = level - normals @ at
        worst = int(depths.argmin())
        if depths[worst] > depth:
            best, depth = at, float(depths[worst])
        at = at - 0.3 * size / (k + 2) * normals[worst]
    x, y, z = (float(v) for v in best)
    return x, y, z


def _areas(surface: Polyhedron) -> F64:
    a, b, c = surface.corners.transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def _surface(mesh: SurfaceMesh | Polyhedron) -> Polyhedron:
    if isinstance(mesh, Polyhedron):
        return mesh
    count = len(np.unique(parts(mesh.triangles, len(mesh.vertices))[mesh.triangles]))
    if count > 1:
        raise ShapeError(f"pointblob_of: the mesh has {count} parts, expected one connected surface")
    return mesh.polyhedron()
