"""The shadow map of the roof's key light. Figures cast the shadows of their skin, hair and clothes as they are deformed; those of
whom no vertices were put on the graphics side (out of the picture, stand-ins), of their limbs, which lie inside their skin."""

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64
from vistel.render.gl.programs import as_gl, program, put, vertex_array

KEY_DIRECTION = np.array((-0.527, 0.773, 0.353))
"""Towards the light; the same as in shaders/common.glsl."""
_REACH = 1.75
_CENTRE = np.array((0.0, 0.62, 0.0))
_MAX_LIMBS = 55 * 24


def shadow_matrix() -> F64:
    """(4, 4) room to the light's clip space: parallel light over the table and everyone round it."""
    back = KEY_DIRECTION / np.linalg.norm(KEY_DIRECTION)
    right = np.cross((0.0, 1.0, 0.0), back)
    right /= np.linalg.norm(right)
    rotation = np.stack((right, np.cross(back, right), -back))
    out = np.eye(4)
    out[:3, :3] = rotation / _REACH
    out[:3, 3] = -out[:3, :3] @ _CENTRE
    return out


@dataclass(frozen=True, eq=False)
class Holes:
    """Where a figure lets light through: below `cutoff` of `opacity`, bound to `unit`; box: lowest u and v of what the opacity
    spans on the figure's texture, one over its width and height."""

    opacity: moderngl.Texture
    unit: int
    box: tuple[float, float, float, float]
    cutoff: float


@dataclass(frozen=True, eq=False)
class Caster:
    """Triangles of a figure, room frame, that throw a shadow. both_sides: sheets that light meets from behind too."""

    vao: moderngl.VertexArray
    holes: Holes | None = None
    both_sides: bool = False


class ShadowMap:
    """Depth as the key light sees it."""

    def __init__(self, ctx: moderngl.Context, size: int) -> None:
        self.ctx, self.size = ctx, size
        self.matrix = shadow_matrix()
        self.texture = ctx.depth_texture((size, size))
        self.texture.compare_func = "<="
        self.texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        # Sampled with coordinates in 0..1; outside, the clamped border texels are empty, hence lit.
        self.lookup = np.array(((0.5, 0, 0, 0.5), (0, 0.5, 0, 0.5), (0, 0, 0.5, 0.5), (0, 0, 0, 1.0))) @ self.matrix
        self.texture.repeat_x = self.texture.repeat_y = False
        self._as_depth = ctx.sampler(
            texture=self.texture, compare_func="", filter=(moderngl.NEAREST, moderngl.NEAREST), repeat_x=False, repeat_y=False
        )
        self._target = ctx.framebuffer(depth_attachment=self.texture)
        still = ctx.depth_texture((size, size))
        self._still_target = ctx.framebuffer(depth_attachment=still)
        # moderngl copies depth only along with colour.
        self._from, self._to = (ctx.framebuffer([ctx.texture((size, size), 1)], depth) for depth in (still, self.texture))
        self._still: tuple[moderngl.VertexArray, ...] | None = None
        self._solid_program = program(ctx, "shadow/solid", "shadow/plain")
        self._limb_program = program(ctx, "shadow/limb", "shadow/plain")
        self._holes_program: moderngl.Program | None = None
        vertices, triangles = _split_sphere(9, 3)
        self._limbs = ctx.buffer(reserve=_MAX_LIMBS * 32, dynamic=True)
        self._limb_vao = vertex_array(
            ctx,
            self._limb_program,
            [(ctx.buffer(vertices.tobytes()), "3f 1f", "direction", "end"), (self._limbs, "4f 4f/i", "limb_a", "limb_b")],
            ctx.buffer(triangles.tobytes()),
        )

    def use(self, unit: int, depth_unit: int | None = None) -> dict[str, object]:
        """Bind the map, to a second unit as depth if one is given; returns what shaders need to know."""
        self.texture.use(unit)
        said: dict[str, object] = {"shadow_map": unit, "shadow_from_room": as_gl(self.lookup), "shadow_texel": 1.0 / self.size}
        if depth_unit is not None:
            self._as_depth.use(depth_unit)
            said["shadow_depth"] = depth_unit
        return said

    def solid(self, vertices: moderngl.Buffer, layout: str, triangles: moderngl.Buffer) -> moderngl.VertexArray:
        """A rigid body's vertex array for this pass; `layout` as moderngl's, its first item the position."""
        return vertex_array(self.ctx, self._solid_program, [(vertices, layout, "position")], triangles)

    def figure(
        self, vertices: moderngl.Buffer, uv: moderngl.Buffer, triangles: moderngl.Buffer, holes: Holes | None, both_sides: bool
    ) -> Caster:
        """Triangles of a figure; vertices: positions and normals; uv: texture coordinates and the kind of material."""
        if holes is None:
            return Caster(self.solid(vertices, "3f 12x", triangles), None, both_sides)
        if self._holes_program is None:
            self._holes_program = program(self.ctx, "shadow/holes")
        layout = [(vertices, "3f 12x", "position"), (uv, "2f 4x", "uv")]
        return Caster(vertex_array(self.ctx, self._holes_program, layout, triangles), holes, both_sides)

    def keep(self, still: Sequence[moderngl.VertexArray]) -> None:
        """What throws shadows and does not move, room frame: drawn once, then copied until it is other vertices."""
        if self._still is not None and len(still) == len(self._still) and all(map(operator.is_, still, self._still)):
            return
        self._still = tuple(still)
        self._begin(self._still_target)
        self._still_target.clear(depth=1.0)
        put(self._solid_program, shadow_from_room=as_gl(self.matrix), room_from_thing=as_gl(np.eye(4)))
        for vao in self._still:
            vao.render()

    def draw(self, figures: Sequence[F32 | Sequence[Caster]], solids: Sequence[tuple[F32, moderngl.VertexArray]]) -> None:
        """Draw figures, each as its limbs ((P, 8): end a, radius, end b, radius) or its triangles, and solids (matrix
        thing to room, vertices), beside what is kept."""
        if self._still is None:
            self.keep(())
        self.ctx.copy_framebuffer(self._to, self._from)
        self._begin(self._target)
        light = as_gl(self.matrix)
        put(self._solid_program, shadow_from_room=light)
        for matrix, vao in solids:
            put(self._solid_program, room_from_thing=as_gl(matrix))
            vao.render()
        put(self._solid_program, room_from_thing=as_gl(np.eye(4)))
        for caster in (c for figure in figures if not isinstance(figure, np.ndarray) for c in figure):
            self._throw(caster, light)
        limbs = [figure for figure in figures if isinstance(figure, np.ndarray)]
        if limbs:
            every = np.ascontiguousarray(np.concatenate(limbs)[:_MAX_LIMBS], np.float32)
            self._limbs.write(every)
            put(self._limb_program, shadow_from_room=light)
            self._limb_vao.render(instances=len(every))

    def _begin(self, target: moderngl.Framebuffer) -> None:
        target.use()
        self.ctx.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)

    def _throw(self, caster: Caster, light: bytes) -> None:
        holes = caster.holes
        if holes is not None and self._holes_program is not None:
            holes.opacity.use(holes.unit)
            put(self._holes_program, shadow_from_room=light, opacity=holes.unit, box=holes.box, cutoff=holes.cutoff)
        if caster.both_sides:
            self.ctx.disable(moderngl.CULL_FACE)
        caster.vao.render()
        if caster.both_sides:
            self.ctx.enable(moderngl.CULL_FACE)


def _split_sphere(segments: int, rings: int) -> tuple[F32, NDArray[np.int32]]:
    """A unit sphere cut at its equator: (n, 4) direction and end, triangles (m, 3)."""
    rows: list[tuple[float, float, float, float]] = []
    for end, angles in ((0.0, np.linspace(math.pi, 0.5 * math.pi, rings)), (1.0, np.linspace(0.5 * math.pi, 0.0, rings))):
        for angle in angles:
            for k in range(segments):
                phi = 2.0 * math.pi * k / segments
                rows.append((math.sin(angle) * math.cos(phi), math.sin(angle) * math.sin(phi), math.cos(angle), end))
    triangles: list[tuple[int, int, int]] = []
    for i in range(2 * rings - 1):
        for k in range(segments):
            a, b = i * segments + k, i * segments + (k + 1) % segments
            c, d = b + segments, a + segments
            triangles += [(a, b, c), (a, c, d)]
    return np.array(rows, np.float32), np.array(triangles, np.int32)
