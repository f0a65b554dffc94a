"""The shadow map of the roof's key light. Figures cast the shadows of their limbs, which lie inside their skin."""

from __future__ import annotations

import math
from collections.abc import Sequence

import moderngl
import numpy as np
from numpy.typing import NDArray

from vistel_services.renderer.programs import as_gl, program, put

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

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
        self._solid_program = program(ctx, "shadow_solid", "shadow")
        self._limb_program = program(ctx, "shadow_limb", "shadow")
        vertices, triangles = _split_sphere(9, 3)
        self._limbs = ctx.buffer(reserve=_MAX_LIMBS * 32, dynamic=True)
        self._limb_vao = ctx.vertex_array(
            self._limb_program,
            [
                (ctx.buffer(vertices.tobytes()), "3f 1f", "direction", "end"),
                (self._limbs, "4f 4f/i", "limb_a", "limb_b"),
            ],
            ctx.buffer(triangles.tobytes()),
        )

    def use(self, unit: int, depth_unit: int | None = None) -> dict[str, object]:
        """Bind the map, to a second unit as depth if one is given; returns what shaders need to know."""
        self.texture.use(unit)
        said = {"shadow_map": unit, "shadow_from_room": as_gl(self.lookup), "shadow_texel": 1.0 / self.size}
        if depth_unit is not None:
            self._as_depth.use(depth_unit)
            said["shadow_depth"] = depth_unit
        return said

    def solid(self, vertices: moderngl.Buffer, layout: str, triangles: moderngl.Buffer) -> moderngl.VertexArray:
        """A rigid body's vertex array for this pass; `layout` as moderngl's, its first item the position."""
        return self.ctx.vertex_array(self._solid_program, [(vertices, layout, "position")], triangles)

    def draw(self, limbs: Sequence[F32], solids: Sequence[tuple[F32, moderngl.VertexArray]]) -> None:
        """Draw limbs ((P, 8): end a, radius, end b, radius) and solids (matrix thing to room, vertices)."""
        self._target.use()
        self._target.clear(depth=1.0)
        self.ctx.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        light = as_gl(self.matrix)
        put(self._solid_program, shadow_from_room=light)
        for matrix, vao in solids:
            put(self._solid_program, room_from_thing=as_gl(matrix))
            vao.render()
        if limbs:
            every = np.ascontiguousarray(np.concatenate(limbs)[:_MAX_LIMBS], np.float32)
            self._limbs.write(every)
            put(self._limb_program, shadow_from_room=light)
            self._limb_vao.render(instances=len(every))


def _split_sphere(segments: int, rings: int) -> tuple[F32, NDArray[np.int32]]:
    """A unit sphere cut at its equator: (n, 4) direction and end, triangles (m, 3)."""
    rows = []
    for end, angles in (
        (0.0, np.linspace(math.pi, 0.5 * math.pi, rings)),
        (1.0, np.linspace(0.5 * math.pi, 0.0, rings)),
    ):
        for angle in angles:
            for k in range(segments):
                phi = 2.0 * math.pi * k / segments
                rows.append((math.sin(angle) * math.cos(phi), math.sin(angle) * math.sin(phi), math.cos(angle), end))
    triangles = []
    for i in range(2 * rings - 1):
        for k in range(segments):
            a, b = i * segments + k, i * segments + (k + 1) % segments
            c, d = b + segments, a + segments
            triangles += [(a, b, c), (a, c, d)]
    return np.array(rows, np.float32), np.array(triangles, np.int32)
