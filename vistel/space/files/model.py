"""Polymeshes that are drawn for things: triangles, texture coordinates, colours, pictures; and their mass properties."""

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vistel.arrays import F32, F64, I32
from vistel.figure.making.source import SourceMaterial


@dataclass(frozen=True, eq=False)
class Polymesh:
    """A polymesh in the frame of its thing. vertices: (V, 3) [m]; triangles: (F, 3), counter-clockwise from outside; uv: (T,
    2) origin bottom left; uv_triangles: (F, 3), -1 where a face has none; material: (F,) index into `materials`."""

    vertices: F32
    triangles: I32
    uv: F32
    uv_triangles: I32
    material: I32
    materials: tuple[SourceMaterial, ...]

    @cached_property
    def digest(self) -> str:
        """Its name: equal models have equal digests."""
        h = hashlib.sha256()
        for array in (self.vertices, self.triangles, self.uv, self.uv_triangles, self.material):
            h.update(f"{array.dtype.str}{array.shape}".encode())
            h.update(array.tobytes())
        for m in self.materials:
            h.update(f"{m.name!r}{m.colour}".encode())
            if m.finish is not None:
                h.update(f"{m.finish.roughness:.3f}{m.finish.metallic:.3f}".encode())
            if m.picture is not None:
                h.update(f"{m.picture.shape}".encode())
                h.update(m.picture.tobytes())
        return h.hexdigest()[:32]

    @cached_property
    def closed(self) -> bool:
        """Every edge has two faces, so that there is an inside."""
        ends = np.sort(np.concatenate([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]]), axis=1)
        _, uses = np.unique(ends.astype(np.int64) @ np.array([len(self.vertices), 1]), return_counts=True)
        return len(uses) > 0 and bool((uses % 2 == 0).all())

    def moved(self, offset: F64) -> "Polymesh":
        """The model with `offset` (3,) [m] added to its vertices."""
        vertices = (self.vertices.astype(np.float64) + offset).astype(np.float32)
        return Polymesh(vertices, self.triangles, self.uv, self.uv_triangles, self.material, self.materials)


@dataclass(frozen=True)
class Bulk:
    """The solid of a body. volume [m^3]; centre: (3,) of mass [m]; moments: (3, 3) mean of x x^T about it [m^2]."""

    volume: float
    centre: F64
    moments: F64

    @property
    def inertia(self) -> F64:
        """(3, 3) per kilogram about the centre of mass [m^2]."""
        return inertia_of(self.moments)


def inertia_of(moments: F64) -> F64:
    """(3, 3) inertia per kilogram of mean x x^T about the centre of mass."""
    return np.trace(moments) * np.eye(3) - moments


def bulk_of_mesh(vertices: F64, triangles: I32) -> Bulk:
    """Of a closed mesh, exactly: sums over the tetrahedra from the origin to each face (Eberly, "Polyhedral mass
    properties"). The volume is negative for a mesh that is inside out. Raises ValueError for one without volume."""
    reference = vertices.mean(axis=0)
    a, b, c = (vertices[triangles[:, k]] - reference for k in range(3))
    det = np.einsum("ni,ni->n", a, np.cross(b, c))
    volume = float(det.sum()) / 6.0
    if abs(volume) < 1e-12:
        raise ValueError("a mesh without volume")
    total = a + b + c
    centre = (det[:, None] * total).sum(axis=0) / (24.0 * volume)
    second = sum(np.einsum("n,ni,nj->ij", det, x, x) for x in (a, b, c, total)) / (120.0 * volume)
    return Bulk(volume, centre + reference, np.asarray(second) - np.outer(centre, centre))


def bulk_of_cells(points: F64, size: float) -> Bulk:
    """Of cubes of side `size` [m] about points (N, 3)."""
    centre = points.mean(axis=0)
    off = points - centre
    return Bulk(len(points) * size**3, centre, off.T @ off / len(points) + size * size / 12.0 * np.eye(3))
