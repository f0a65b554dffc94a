"""What a surface looks like where a ray meets it: normal, colour and finish, of the implicit surface and of polygons."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from vistel.arrays import F64, I64
from vistel.implicit.evaluation.program import FieldProgram
from vistel.implicit.scene import Mesh
from vistel.implicit.scene.surface import Material

LIFT = 1e-3
"""Rays that leave the surface F = T start where F has fallen by about this much."""


@dataclass(frozen=True)
class SurfacePoints:
    """points, normals (n, 3), turned to the viewer; colour (n, 3); finish (n, 5); lift (n,): how far off the surface [m]
    rays that leave it begin. colour and finish have one row where they are the same everywhere."""

    points: F64
    normals: F64
    colour: F64
    finish: F64
    lift: F64

    def rows(self, which: Any) -> "SurfacePoints":
        """Some of the points."""
        one = slice(None)
        colour = self.colour[which if len(self.colour) > 1 else one]
        finish = self.finish[which if len(self.finish) > 1 else one]
        return SurfacePoints(self.points[which], self.normals[which], colour, finish, self.lift[which])


@dataclass(frozen=True, eq=False)
class ImplicitLook:
    """Looks of the surface of a program with the attributes colour, finish and perhaps bump."""

    program: FieldProgram

    @cached_property
    def size(self) -> float:
        """The longest edge of the box around the field [m]."""
        return float(np.ptp(self.program.bounds, axis=0).max())

    @cached_property
    def constants(self) -> dict[str, F64] | None:
        """The attributes (1, k) where all primitives have the same, else None."""
        rows = np.asarray(self.program.arrays["attribute"], np.float64)
        if self.program.layout.textures or not len(rows) or not (rows == rows[0]).all():
            return None
        return {name: rows[:1, a : a + k] / rows[0, a + k] for name, a, k in self.program.layout.names}

    def at(self, points: F64, directions: F64) -> SurfacePoints:
        """The looks at points (n, 3) of the surface seen along directions (n, 3)."""
        constants = self.constants
        found = self.program.evaluate(points, gradient=True, attributes=constants is None, threads=1)
        gradient = found.gradient
        assert gradient is not None
        steep = np.sqrt(np.einsum("ij,ij->i", gradient, gradient))
        facing = np.where(np.einsum("ij,ij->i", gradient, directions) > 0, -1.0, 1.0)
        normals = gradient * (facing / np.maximum(steep, 1e-30))[:, None]
        attributes: Any = constants or found.attributes
        lift = np.minimum(LIFT / np.maximum(steep, 1e-30), LIFT * self.size)
        if "bump" in attributes and (constants is None or np.any(attributes["bump"])):
            normals = self._bumped(points, normals, directions)
        return SurfacePoints(points, normals, attributes["colour"], attributes["finish"], lift)

    def _bumped(self, points: F64, normals: F64, directions: F64) -> F64:
        """Normals tilted by the slope of the bump, which is looked up at P' (mathematics M2.6)."""
        h = 1e-4 * self.size
        helper = np.where(np.abs(normals[:, :1]) < 0.6, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        u = np.cross(normals, helper)
        u /= np.linalg.norm(u, axis=1, keepdims=True)
        v = np.cross(normals, u)
        around = np.concatenate([points + h * u, points - h * u, points + h * v, points - h * v])
        height = self.program.attributes(around, threads=1)["bump"].reshape(4, -1)
        slope_u, slope_v = (height[0] - height[1]) / (2 * h), (height[2] - height[3]) / (2 * h)
        tilted = normals - slope_u[:, None] * u - slope_v[:, None] * v
        tilted /= np.linalg.norm(tilted, axis=1, keepdims=True)
        away = np.einsum("ij,ij->i", tilted, directions) > -1e-3
        return np.where(away[:, None], normals, tilted)


@dataclass(frozen=True, eq=False)
class MeshLook:
    """Looks of polygon objects; triangles are numbered through all of them."""

    meshes: tuple[Mesh, ...]

    @cached_property
    def corners(self) -> F64:
        """(m, 3, 3) corners of all triangles."""
        parts = [m.vertices[m.triangles] for m in self.meshes]
        return np.concatenate(parts) if parts else np.zeros((0, 3, 3))

    @cached_property
    def _owner(self) -> I64:
        return np.repeat(np.arange(len(self.meshes)), [len(m.triangles) for m in self.meshes])

    @cached_property
    def _flat(self) -> F64:
        a, b, c = (self.corners[:, k] for k in range(3))
        n = np.cross(b - a, c - a)
        length = np.linalg.norm(n, axis=1, keepdims=True)
        return np.divide(n, length, out=np.zeros_like(n), where=length > 0)

    @cached_property
    def _smooth(self) -> F64:
        """(m, 3, 3) normals at the corners."""
        parts = [m.vertex_normals[m.triangles] if m.smooth else np.zeros((len(m.triangles), 3, 3)) for m in self.meshes]
        smooth = np.concatenate(parts)
        flat = ~np.repeat([m.smooth for m in self.meshes], [len(m.triangles) for m in self.meshes])
        smooth[flat] = self._flat[flat][:, None]
        return smooth

    @cached_property
    def _colours(self) -> F64:
        return np.array([m.material.colour for m in self.meshes])

    @cached_property
    def _finishes(self) -> F64:
        return np.array([m.material.finish for m in self.meshes])

    def at(self, points: F64, triangles: I64, directions: F64) -> SurfacePoints:
        """The looks at points (n, 3) of triangles (n,) seen along directions (n, 3)."""
        flat, owner = self._flat[triangles], self._owner[triangles]
        normals = flat
        if any(m.smooth for m in self.meshes):
            share = barycentric(self.corners[triangles], points)
            normals = np.einsum("nk,nkc->nc", share, self._smooth[triangles])
            normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        turned = np.einsum("ij,ij->i", flat, directions) > 0
        normals = np.where(turned[:, None], -normals, normals)
        colour = self._colours[owner]
        for i, mesh in enumerate(self.meshes):
            mine = owner == i
            if not mine.any():
                continue
            if mesh.material.texture is not None:
                colour[mine] = mesh.material.texture(points[mine])
            if mesh.material.bump is not None:
                normals[mine] = _tilted(mesh.material, points[mine], normals[mine])
        lift = 1e-7 * (1 + np.abs(points).max(axis=1))
        return SurfacePoints(points, normals, colour, self._finishes[owner], lift)


def _tilted(material: Material, points: F64, normals: F64) -> F64:
    """Normals tilted by the slope of a material's bump."""
    assert material.bump is not None
    h = 1e-5 * (1 + float(np.abs(points).max()))
    slope = np.stack([(material.bump(points + h * e) - material.bump(points - h * e)) / (2 * h) for e in np.eye(3)], 1)
    slope -= np.einsum("ij,ij->i", slope, normals)[:, None] * normals
    tilted = normals - slope
    return tilted / np.linalg.norm(tilted, axis=1, keepdims=True)


def barycentric(corners: F64, points: F64) -> F64:
    """Shares (n, 3) of the corners (n, 3, 3) of triangles at points (n, 3) in them."""
    a, b, c = (corners[:, k] for k in range(3))
    n = np.cross(b - a, c - a)
    area = np.maximum(np.einsum("ij,ij->i", n, n), 1e-300)
    v = np.einsum("ij,ij->i", np.cross(points - a, c - a), n) / area
    w = np.einsum("ij,ij->i", np.cross(b - a, points - a), n) / area
    return np.stack([1 - v - w, v, w], axis=1)


def merged(n: int, parts: list[tuple[Any, SurfacePoints]]) -> SurfacePoints:
    """Looks of n points from parts (which points, their looks)."""
    if len(parts) == 1:
        return parts[0][1]
    out = SurfacePoints(np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 5)), np.zeros(n))
    for which, look in parts:
        for name in ("points", "normals", "colour", "finish", "lift"):
            getattr(out, name)[which] = getattr(look, name)
    return out
