"""A scene as immutable values; `vistel.implicit.scene.file` reads them from TOML."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vistel.arrays import F64, I64
from vistel.implicit.checks import Vec3
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.evaluation.program import FieldProgram, compile
from vistel.implicit.graph.attributes import Attributed
from vistel.implicit.graph.shape import Shape
from vistel.implicit.primitives.polyhedron import Polyhedron
from vistel.implicit.scene.surface import Material, Rgb


class SceneError(ValueError):
    """A scene that cannot be used; the text is one line per fault."""


@dataclass(frozen=True)
class Camera:
    """Where the picture is taken from. Right-handed, Y up unless `up` says otherwise; all in metres and radians.

    field_of_view: angle across the picture's width; height: with it the view is orthographic and this many metres high.
    """

    position: Vec3
    target: Vec3 = (0.0, 0.0, 0.0)
    up: Vec3 = (0.0, 1.0, 0.0)
    field_of_view: float = math.radians(40)
    height: float | None = None

    def __post_init__(self) -> None:
        ahead = np.subtract(self.target, self.position)
        if not np.isfinite(ahead).all() or np.linalg.norm(np.cross(ahead, self.up)) <= 1e-9 * np.linalg.norm(ahead):
            raise SceneError("camera: target lies at position or along up, expected a view across `up`")
        if not 0 < self.field_of_view < math.pi:
            raise SceneError(f"camera: field_of_view is {math.degrees(self.field_of_view):g} degrees, expected 0 to 180")
        if self.height is not None and not self.height > 0:
            raise SceneError(f"camera: height is {self.height:g}, expected more than 0")

    @cached_property
    def frame(self) -> F64:
        """(3, 3) unit rows: right, up and ahead, in the world's frame."""
        ahead = np.subtract(self.target, self.position)
        ahead = ahead / np.linalg.norm(ahead)
        right = np.cross(ahead, self.up)
        right = right / np.linalg.norm(right)
        return np.array([right, np.cross(right, ahead), ahead])

    def half_extent(self, size: tuple[int, int]) -> tuple[float, float]:
        """Half the width and height of the view: at a distance of 1 m, or anywhere in an orthographic one [m]."""
        width, height = size
        if self.height is not None:
            return self.height * width / height / 2, self.height / 2
        half = math.tan(self.field_of_view / 2)
        return half, half * height / width

    def rays(self, size: tuple[int, int], pixels: ArrayLike) -> tuple[F64, F64]:
        """Origins and unit directions (n, 3) of rays through pixels (n, 2): columns from the left, rows from the top;
        (0.5, 0.5) is the middle of the first pixel."""
        p = np.asarray(pixels, np.float64)
        half = self.half_extent(size)
        x = (2 * p[:, 0] / size[0] - 1) * half[0]
        y = (1 - 2 * p[:, 1] / size[1]) * half[1]
        right, up, ahead = self.frame
        across = x[:, None] * right + y[:, None] * up
        if self.height is not None:
            return np.array(self.position) + across, np.broadcast_to(ahead, across.shape).copy()
        along = across + ahead
        along /= np.sqrt(np.einsum("ij,ij->i", along, along))[:, None]
        return np.broadcast_to(np.array(self.position, np.float64), along.shape).copy(), along

    def project(self, points: ArrayLike, size: tuple[int, int]) -> tuple[F64, F64]:
        """Pixels (n, 2) where points (n, 3) are seen, as `rays` counts them, and their depths along `ahead` (n,)."""
        local = (np.asarray(points, np.float64) - np.array(self.position)) @ self.frame.T
        half = self.half_extent(size)
        scale = local[:, 2:] if self.height is None else 1.0
        plane = local[:, :2] / scale / half
        return np.stack([plane[:, 0] + 1, 1 - plane[:, 1]], axis=1) * np.array(size) / 2, local[:, 2]


@dataclass(frozen=True)
class Light:
    """A lamp at `position`, or parallel light that comes from the side `towards` points to; exactly one of the two."""

    position: Vec3 | None = None
    towards: Vec3 | None = None
    colour: Rgb = (1.0, 1.0, 1.0)
    shadows: bool = True

    def __post_init__(self) -> None:
        if (self.position is None) == (self.towards is None):
            raise SceneError("light: expected either position or towards")
        if self.towards is not None and not np.linalg.norm(self.towards) > 0:
            raise SceneError("light: towards is (0, 0, 0), expected a direction")

    def seen_from(self, points: F64) -> tuple[F64, F64]:
        """Unit directions (n, 3) from points (n, 3) to the light and the distances (n,), infinite for parallel light."""
        if self.position is None:
            towards = np.array(self.towards, np.float64)
            unit = towards / np.linalg.norm(towards)
            return np.broadcast_to(unit, points.shape).copy(), np.full(len(points), np.inf)
        offset = np.array(self.position) - points
        distance = np.sqrt(np.einsum("ij,ij->i", offset, offset))
        return offset / np.maximum(distance, 1e-30)[:, None], distance


@dataclass(frozen=True, eq=False)
class Mesh:
    """A polygon object, drawn as it is beside the implicit surface. vertices: (n, 3) [m]; triangles: (m, 3);
    smooth: shade with normals interpolated from the vertices'."""

    vertices: F64
    triangles: I64
    material: Material = field(default_factory=Material)
    smooth: bool = False

    def __post_init__(self) -> None:
        vertices, triangles = np.array(self.vertices, np.float64), np.array(self.triangles, np.int64)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise SceneError(f"mesh: vertices have the form {vertices.shape}, expected (n, 3) finite numbers")
        if triangles.ndim != 2 or triangles.shape[1] != 3:
            raise SceneError(f"mesh: triangles have the form {triangles.shape}, expected (m, 3)")
        if len(triangles) and not 0 <= triangles.min() <= triangles.max() < len(vertices):
            raise SceneError(f"mesh: triangles name vertices {triangles.min()} to {triangles.max()} of {len(vertices)}")
        vertices.setflags(write=False)
        triangles.setflags(write=False)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)

    @cached_property
    def vertex_normals(self) -> F64:
        """(n, 3) unit normals, the mean of the triangles around by area."""
        a, b, c = (self.vertices[self.triangles[:, k]] for k in range(3))
        total = np.zeros_like(self.vertices)
        area = np.cross(b - a, c - a)
        for k in range(3):
            np.add.at(total, self.triangles[:, k], area)
        length = np.linalg.norm(total, axis=1, keepdims=True)
        return np.divide(total, length, out=np.zeros_like(total), where=length > 0)


def mesh_of(solid: Polyhedron, material: Material | None = None, *, smooth: bool = False) -> Mesh:
    """A polyhedron as a plain polygon object."""
    return Mesh(solid.vertices, solid.triangles, material or Material(), smooth)


def ground(height: float = 0.0, extent: float = 100.0, material: Material | None = None) -> Mesh:
    """A square floor, `extent` metres to each side of the origin."""
    corners = [(-extent, height, -extent), (-extent, height, extent), (extent, height, extent), (extent, height, -extent)]
    return Mesh(np.array(corners), np.array([(0, 1, 2), (0, 2, 3)]), material or Material())


@dataclass(frozen=True, eq=False)
class Scene:
    """What is seen and from where.

    shape: the implicit surface F = threshold, its materials as attributes (see `Material.on`); material: that of
    primitives which have none; background: colour of rays that meet nothing; size: (width, height) in pixels.
    """

    camera: Camera
    shape: Shape | None = None
    meshes: Sequence[Mesh] = ()
    lights: Sequence[Light] = ()
    material: Material = field(default_factory=Material)
    background: Rgb = (0.1, 0.1, 0.15)
    size: tuple[int, int] = (400, 400)
    threshold: float = THRESHOLD

    def __post_init__(self) -> None:
        object.__setattr__(self, "meshes", tuple(self.meshes))
        object.__setattr__(self, "lights", tuple(self.lights))
        if not all(1 <= n <= 16384 for n in self.size):
            raise SceneError(f"scene: size is {self.size}, expected 1 to 16384 pixels each way")

    @cached_property
    def solid(self) -> Shape | None:
        """`shape` with the scene's own material on whatever has none; `bump` is on all primitives or on none."""
        if self.shape is None:
            return None
        bumpy = any(isinstance(s, Attributed) and "bump" in s.values for s in self.shape.walk())
        whole = self.material.on(self.shape)
        return whole.with_attributes(bump=(0.0,)) if bumpy and self.material.bump is None else whole

    @cached_property
    def program(self) -> FieldProgram | None:
        """The field's program with its attributes, None for a scene of polygons alone."""
        return None if self.solid is None else compile(self.solid)
