"""The way back: from a mesh to an implicit primitive, for the next round of modelling (Singh §3.2, §3.5)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.implicit.checks import ShapeError, Vec3
from vistel.implicit.pointblob import Pointblob, PointSetblob
from vistel.implicit.polygonise.mesh import SurfaceMesh, parts
from vistel.implicit.polyhedron import Polyhedron

F64 = NDArray[np.float64]

ROUNDS = 400


def pointblob_of(mesh: SurfaceMesh | Polyhedron, centre: Vec3 | None = None, **options: Any) -> Pointblob:
    """The pointblob whose surface is a mesh. centre: what sees all of it, found where not given (`seeing_point`).

    options: blend, threshold, weight, relaxed as for `Pointblob.of_surface`. Raises ShapeError for a mesh of several
    parts and, unless relaxed, for one that no point sees all of; `pointset_of` takes several centres.
    """
    surface = _surface(mesh)
    if centre is None:
        centre, clear = seeing_point(surface)
        if clear <= 0 and not options.get("relaxed", False):
            raise ShapeError(
                "pointblob_of: no point inside sees the whole mesh; give several centres (pointset_of) or pass relaxed=True"
            )
    return Pointblob.of_surface(surface, centre, **options)


def pointset_of(mesh: SurfaceMesh | Polyhedron, centres: Sequence[Vec3], **options: Any) -> PointSetblob:
    """The point-setblob about several centres whose surface is a mesh; options as for `PointSetblob`."""
    return PointSetblob(_surface(mesh), np.asarray(centres, np.float64), **options)


def seeing_point(surface: Polyhedron) -> tuple[Vec3, float]:
    """The point that is deepest below the planes of all faces, about, and how deep [m]; not above 0: it does not see all.

    The smallest of the depths is concave; it is climbed by steps along the normal of the plane in the way.
    """
    normals, level = surface.normals, np.einsum("ij,ij->i", surface.normals, surface.corners[:, 0])
    size = float(np.ptp(surface.vertices, axis=0).max())
    at = surface.corners.mean(axis=(0, 1))
    best, depth = at, -np.inf
    for k in range(ROUNDS):
        depths = level - normals @ at
        worst = int(depths.argmin())
        if depths[worst] > depth:
            best, depth = at, float(depths[worst])
        at = at - 0.3 * size / (k + 2) * normals[worst]
    x, y, z = (float(v) for v in best)
    return (x, y, z), depth


def _surface(mesh: SurfaceMesh | Polyhedron) -> Polyhedron:
    if isinstance(mesh, Polyhedron):
        return mesh
    count = len(np.unique(parts(mesh.triangles, len(mesh.vertices))[mesh.triangles]))
    if count > 1:
        raise ShapeError(f"pointblob_of: the mesh has {count} parts, expected one connected surface")
    return mesh.polyhedron()
