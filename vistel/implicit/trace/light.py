"""The light that comes back along rays: first hits, lamps and their shadows, mirrored rays."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64, Bool
from vistel.implicit.scene import Scene
from vistel.implicit.scene.surface import AMBIENT, DIFFUSE, REFLECTION, SHININESS, SPECULAR
from vistel.implicit.trace.caster import RayCaster
from vistel.implicit.trace.exact import Exact
from vistel.implicit.trace.looks import ImplicitLook, MeshLook, SurfacePoints, merged
from vistel.implicit.trace.mesh_tree import BoxTree, MeshTree

FAINT = 1 / 512
"""A mirror that gives back less than this is not followed."""


@dataclass(frozen=True)
class Seen:
    """colour (n, 3) linear light; distance (n,), infinite where nothing was met; thing (n,): 0 for nothing, 1 for the
    implicit surface, 2 for polygons."""

    colour: F64
    distance: F64
    thing: NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class Tracer:
    """A scene made ready for rays.

    depth: how often a ray is mirrored; shadows: whether lamps that cast them do; method, samples: see RayCaster;
    retain: whether polygons of primitives that act alone are traced as such (see `exact`).
    """

    scene: Scene
    depth: int = 3
    shadows: bool = True
    method: str = "auto"
    samples: int = 8
    retain: bool = True

    @cached_property
    def caster(self) -> RayCaster | None:
        """Rays at the implicit surface; None for a scene without one."""
        program = self.scene.program
        return None if program is None else RayCaster(program, self.scene.threshold, self.method, self.samples)

    @cached_property
    def _implicit(self) -> ImplicitLook:
        assert self.scene.program is not None
        return ImplicitLook(self.scene.program)

    @cached_property
    def exact(self) -> Exact | None:
        """The polygons of primitives that are the surface themselves, and where the field has to be solved; None where
        it has to be solved everywhere."""
        caster = self.caster
        if caster is None or not self.retain or caster.way == "march":
            return None
        return Exact.of(caster.program, self.scene.threshold)

    @cached_property
    def _boxes(self) -> BoxTree:
        assert self.exact is not None
        return self.exact.tree()

    @cached_property
    def _meshes(self) -> MeshLook:
        """The polygons of the implicit surface first, then the polygon objects."""
        return MeshLook((*(self.exact.meshes if self.exact else ()), *self.scene.meshes))

    @cached_property
    def _own(self) -> int:
        """How many triangles belong to the implicit surface."""
        return sum(len(m.triangles) for m in self.exact.meshes) if self.exact else 0

    @cached_property
    def tree(self) -> MeshTree:
        """The triangles of the polygon objects and of the surface."""
        return MeshTree.of(self._meshes.corners)

    def prepare(self) -> "Tracer":
        """Compile and build all that rays need, so that threads share it."""
        _ = self.tree, self.exact and self._boxes
        if self.caster is not None:
            self.caster.prepare()
            _ = self._implicit.constants
        return self

    @cached_property
    def plain(self) -> tuple[F64, F64] | None:
        """Colour (3,) and finish (5,) of a scene that `draw` can draw: one sum of spheres and sphylinders of one material
        without a mirror or a bump, no polygons; else None."""
        if self.caster is None or self.scene.meshes or self.caster.way != "march":
            return None
        one = self._implicit.constants
        if one is None or np.any(one.get("bump", 0.0)) or (self.depth > 0 and one["finish"][0, REFLECTION] > FAINT):
            return None
        return one["colour"][0], one["finish"][0]

    def draw(
        self, box: tuple[int, int, int, int], light: NDArray[np.float32], distance: NDArray[np.float32], thing: NDArray[np.int8]
    ) -> None:
        """Draw the pixels of box (x0, y0, x1, y1) of a `plain` scene into whole pictures; the same as `seen` gives."""
        from vistel.implicit.trace.picture_kernels import draw

        assert self.plain is not None and self.caster is not None
        scene, camera = self.scene, self.scene.camera
        height, width = thing.shape
        half = camera.half_extent((width, height))
        step = np.array([2 * half[0] / width, 2 * half[1] / height])
        draw(
            *self.caster.ball,
            np.array(camera.position, np.float64),
            camera.frame,
            step,
            camera.height is not None,
            scene.threshold,
            *self.plain,
            self._lamps,
            self.shadows,
            np.array(box),
            light,
            distance,
            thing,
        )

    @cached_property
    def _lamps(self) -> F64:
        rows = np.zeros((len(self.scene.lights), 8))
        for row, lamp in zip(rows, self.scene.lights, strict=True):
            at = lamp.position if lamp.position is not None else lamp.towards
            assert at is not None
            row[0] = lamp.position is not None
            row[1:4] = at if row[0] else np.array(at) / np.linalg.norm(at)
            row[4:7], row[7] = lamp.colour, lamp.shadows
        return rows

    def hits(self, origins: F64, directions: F64, far: F64) -> tuple[F64, I64]:
        """Distance to the first surface, infinite for none, and its triangle, -1 for the implicit surface."""
        t, triangle = self.tree.cast(origins, directions, np.zeros(len(origins)), far)
        if self.caster is not None:
            own = self._solved(origins, directions, np.minimum(t, far))
            nearer = own < t
            t, triangle = np.where(nearer, own, t), np.where(nearer, -1, triangle)
        return t, triangle

    def _solved(self, origins: F64, directions: F64, far: F64) -> F64:
        """Distance to the implicit surface before far (n,), infinite for none; its own polygons are left out."""
        assert self.caster is not None
        if self.exact is None:
            return self.caster.first(origins, directions, 0.0, far)
        first, last = self._boxes.span(origins, directions, far)
        some = np.flatnonzero(first < last)
        t = np.full(len(origins), np.inf)
        if len(some):
            t[some] = self.caster.first(origins[some], directions[some], first[some], last[some])
        return t

    def blocked(self, origins: F64, directions: F64, far: F64) -> Bool:
        """Whether anything lies on rays (n, 3) before `far` (n,)."""
        near = np.zeros(len(origins))
        dark = np.isfinite(self.tree.cast(origins, directions, near, far, any_hit=True)[0])
        if self.caster is not None:
            dark |= np.isfinite(self._solved(origins, directions, np.where(dark, -1.0, far)))
        return dark

    def look(self, points: F64, triangle: I64, directions: F64) -> SurfacePoints:
        """What the surfaces look like at points that rays met."""
        mesh = triangle >= 0
        parts: list[tuple[Bool, SurfacePoints]] = []
        if not mesh.all():
            some = ~mesh
            parts.append((some, self._implicit.at(points[some], directions[some])))
        if mesh.any():
            parts.append((mesh, self._meshes.at(points[mesh], triangle[mesh], directions[mesh])))
        return merged(len(points), parts)

    def seen(self, origins: F64, directions: F64, level: int = 0) -> Seen:
        """The light that comes back along rays (n, 3), neighbours following each other."""
        n = len(origins)
        t, triangle = self.hits(origins, directions, np.full(n, np.inf))
        hit = np.isfinite(t)
        colour = np.empty((n, 3))
        colour[:] = self.scene.background
        thing = np.where(hit, np.where(triangle >= self._own, 2, 1), 0).astype(np.int8)
        if hit.any():
            along = directions[hit]
            points = origins[hit] + t[hit, None] * along
            look = self.look(points, triangle[hit], along)
            colour[hit] = self._lit(look, along, level)
        return Seen(colour, t, thing)

    def _lit(self, look: SurfacePoints, along: F64, level: int) -> F64:
        """Light given back at points towards where the rays came from."""
        finish = look.finish
        light = np.broadcast_to(finish[:, AMBIENT, None] * look.colour, look.points.shape).copy()
        start = look.points + look.lift[:, None] * look.normals
        for lamp in self.scene.lights:
            towards, distance = lamp.seen_from(look.points)
            facing = np.einsum("ij,ij->i", look.normals, towards)
            lit = facing > 0
            if self.shadows and lamp.shadows and lit.any():
                lit[lit] = ~self.blocked(start[lit], towards[lit], distance[lit])
            if not lit.any():
                continue
            if not lit.all():
                part, towards, facing, ahead = look.rows(lit), towards[lit], facing[lit], along[lit]
            else:
                part, ahead = look, along
            strength = np.broadcast_to(part.finish[:, DIFFUSE] * facing, facing.shape)
            given = strength[:, None] * part.colour
            if part.finish[:, SPECULAR].any():
                half = towards - ahead
                shine = np.einsum("ij,ij->i", part.normals, half) / np.sqrt(np.einsum("ij,ij->i", half, half))
                given += (part.finish[:, SPECULAR] * np.maximum(shine, 0.0) ** part.finish[:, SHININESS])[:, None]
            light[lit] += given * lamp.colour
        mirror = np.broadcast_to(finish[:, REFLECTION], len(light))
        clear = mirror > FAINT
        if level < self.depth and clear.any():
            normals, ahead = look.normals[clear], along[clear]
            turned = ahead - 2 * np.einsum("ij,ij->i", normals, ahead)[:, None] * normals
            image = self.seen(start[clear], turned, level + 1).colour
            light[clear] += mirror[clear, None] * (image - light[clear])
        return light
