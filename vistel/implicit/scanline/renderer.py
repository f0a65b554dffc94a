"""Scanline pictures of scenes: the sweep's surface and polygons in one z-buffer, lit, and redone where edited."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, I64, U8
from vistel.implicit.evaluation.program import FieldProgram, compile
from vistel.implicit.graph.shape import Shape
from vistel.implicit.scanline.along_kernels import LARGE
from vistel.implicit.scanline.polygons_kernels import draw_triangles
from vistel.implicit.scanline.shade_kernels import LAMP_WORDS, LOOKS, shade
from vistel.implicit.scanline.surface import Surface
from vistel.implicit.scanline.view import View
from vistel.implicit.scene import Scene, SceneError
from vistel.implicit.trace import Tracer
from vistel.implicit.trace.looks import ImplicitLook


@dataclass(frozen=True)
class ScanlinePicture:
    """light: (h, w, 3) linear; depth: (h, w) along the line of sight [m], infinite where nothing is seen; thing (h, w):
    0 nothing, 1 the implicit surface, 2 polygons; redrawn: part of the picture that was drawn, 0..1."""

    light: F32
    depth: F32
    thing: NDArray[np.int8]
    redrawn: float


class Scanline:
    """Draws a scene and keeps what it needs to draw it again after an edit.

        line = Scanline(scene)
        picture = line.draw()
        picture = line.edit(other_shape)      # only the pixels that its changed primitives cover

    First hits without shadows and mirrors (`vistel.implicit.trace` has those). size: (width, height), by default the
    scene's. Raises SceneError where the field can nowhere reach the scene's threshold, or never falls below it.
    """

    def __init__(self, scene: Scene, size: tuple[int, int] | None = None) -> None:
        self.scene = scene
        self.size = size or scene.size
        program = scene.program
        origin = np.zeros(3) if program is None else program.origin
        self.view = View.of(scene.camera, self.size, origin)
        self.surface = None if program is None else Surface(self.view, scene.threshold, _checked(program, scene.threshold))
        self._origin = origin
        self._lamps = self._in_eye_space()
        self._last: ScanlinePicture | None = None

    def draw(self) -> ScanlinePicture:
        """The whole picture."""
        dirty = np.ones((self.size[1], self.view.groups), np.uint8) if self.surface is None else self.surface.draw()
        self._last = None
        return self._lit(dirty)

    def edit(self, shape: Shape) -> ScanlinePicture:
        """The picture with another shape: only what its changed primitives cover is drawn again."""
        self.scene = replace(self.scene, shape=shape)
        solid = self.scene.solid
        assert solid is not None
        program = _checked(compile(solid, origin=self._origin), self.scene.threshold)
        if self.surface is None or self._last is None:
            self.surface = Surface(self.view, self.scene.threshold, program)
            return self.draw()
        return self._lit(self.surface.edit(program))

    @property
    def program(self) -> FieldProgram | None:
        """What is drawn."""
        return None if self.surface is None else self.surface.program

    def _in_eye_space(self) -> F32:
        frame, rows = self.view.frame, np.zeros((len(self.scene.lights), LAMP_WORDS), np.float32)
        for row, lamp in zip(rows, self.scene.lights, strict=True):
            if lamp.position is None:
                towards = np.array(lamp.towards, np.float64)
                row[:4] = *(frame @ towards / np.linalg.norm(towards)), 1.0
            else:
                row[:3] = frame @ (np.array(lamp.position, np.float64) - self._origin)
            row[4:] = lamp.colour
        return rows

    def _lit(self, dirty: U8) -> ScanlinePicture:
        surface = self.surface
        constants = None
        if surface is not None and not self.scene.meshes:
            constants = ImplicitLook(surface.program).constants
            if constants is not None and np.any(constants.get("bump", 0.0)):
                constants = None
        if surface is not None and constants is not None:
            depth, normal = surface.depth, surface.normal
            look = np.concatenate([constants["colour"][0], constants["finish"][0, :4]]).astype(np.float32)
            look = look.reshape(LOOKS, 1, 1)
        else:
            depth, normal, look = self._looked_at(dirty)
        width, height = self.size
        if self._last is None:
            light, far = np.empty((height, width, 3), np.float32), np.empty((height, width), np.float32)
            thing = np.empty((height, width), np.int8)
        else:
            light, far, thing = self._last.light.copy(), self._last.depth.copy(), self._last.thing.copy()
        shade(
            depth,
            normal,
            look,
            constants is not None,
            self.view.numbers,
            self._lamps,
            np.array(self.scene.background, np.float32),
            dirty,
            light,
            far,
            thing,
        )
        if self.scene.meshes:
            thing += (thing == 1) & (self._meshes.depth[:, :width] <= depth[2:, :width])
        self._last = ScanlinePicture(light, far, thing, float(dirty.mean()))
        return self._last

    def _looked_at(self, dirty: U8) -> tuple[F32, F32, F32]:
        """Depth, normals and looks of the nearest of surface and polygons in dirty groups, point by point."""
        shape = self.size[1], 16 * self.view.groups
        looks, meshes = self._looks, self._meshes
        wanted = np.repeat(dirty != 0, 16, axis=1)
        nearest = looks.depth[2:]
        nearest[wanted] = LARGE if self.surface is None else self.surface.depth[2:][wanted]
        triangle = np.full(shape, -1, np.int64)
        before = meshes.depth < nearest
        nearest[before], triangle[before] = meshes.depth[before], meshes.owner[before]
        rows, columns = np.nonzero(wanted & (nearest < LARGE))
        if len(rows):
            directions = self.view.directions(rows, columns)
            points = self._origin + self.view.points(rows, columns, nearest[rows, columns].astype(np.float64))
            look = Tracer(self.scene, depth=0, shadows=False).look(points, triangle[rows, columns], directions)
            looks.normal[:, rows, columns] = self.view.frame @ look.normals.T
            looks.planes[:3, rows, columns] = np.broadcast_to(look.colour, points.shape).T
            looks.planes[3:, rows, columns] = np.broadcast_to(look.finish[:, :4], (len(points), 4)).T
        return looks.depth, looks.normal, looks.planes

    @cached_property
    def _meshes(self) -> "_Meshes":
        shape = self.size[1], 16 * self.view.groups
        depth, owner = np.full(shape, LARGE, np.float32), np.full(shape, -1, np.int64)
        if self.scene.meshes:
            corners = np.concatenate([m.vertices[m.triangles] for m in self.scene.meshes])
            corners = (corners - self._origin) @ self.view.frame.T + self.view.numbers[5:8]
            draw_triangles(corners, self.view.numbers, self.size[0], depth, owner)
        return _Meshes(depth, owner)

    @cached_property
    def _looks(self) -> "_Looks":
        height, columns = self.size[1], 16 * self.view.groups
        return _Looks(
            np.full((height + 2, columns), LARGE, np.float32),
            np.zeros((3, height, columns), np.float32),
            np.zeros((LOOKS, height, columns), np.float32),
        )


@dataclass(frozen=True)
class _Meshes:
    """The polygons' z-buffer (height, columns) and the triangle in front, -1 for none."""

    depth: F32
    owner: I64


@dataclass(frozen=True)
class _Looks:
    """Depth, normals and looks pixel by pixel, as `shade` takes them."""

    depth: F32
    normal: F32
    planes: F32


def _checked(program: FieldProgram, threshold: float) -> FieldProgram:
    """The program, if its surface has an inside and an end."""
    if program.far >= threshold:
        raise SceneError(
            "shapes: the object has no end (its field is above the threshold out of reach of all primitives); "
            "intersect it with a bounded shape"
        )
    return program


def render(scene: Scene, size: tuple[int, int] | None = None) -> ScanlinePicture:
    """The scanline picture of a scene: first hits without shadows and mirrors."""
    return Scanline(scene, size).draw()
