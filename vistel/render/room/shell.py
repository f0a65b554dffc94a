"""The room's shell on the graphics side: floor, walls, ceiling and table top, with light baked into their pictures."""

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np

from vistel.arrays import F32
from vistel.render.gl.programs import as_gl, program, put, vertex_array
from vistel.render.gl.textures import texture_of
from vistel.render.light.shadow import ShadowMap
from vistel.render.light.surroundings import SIDE
from vistel.render.room.room import ShellPanel
from vistel.render.view.camera import Camera


@dataclass(frozen=True, eq=False)
class _Part:
    panel: ShellPanel
    vertices: moderngl.Buffer
    triangles: moderngl.Buffer
    vao: moderngl.VertexArray
    texture: moderngl.Texture


class Shell:
    """Draws a room's panels. light: defines of the shaders; software: the CPU draws."""

    def __init__(self, ctx: moderngl.Context, shadow: ShadowMap, light: tuple[str, ...], software: bool) -> None:
        self.ctx, self._shadow, self._light, self._software = ctx, shadow, light, software
        self._programs: dict[tuple[str, ...], moderngl.Program] = {}
        self._parts: list[_Part] = []
        self.casters: list[moderngl.VertexArray] = []
        """What of it throws shadows."""
        self._seen: moderngl.Framebuffer | None = None

    def build(self, panels: Sequence[ShellPanel]) -> None:
        """Add panels."""
        textures: dict[int, moderngl.Texture] = {}
        for panel in panels:
            data = np.hstack((panel.positions, panel.normals, panel.uv)).astype(np.float32)
            vertices, triangles = self.ctx.buffer(data.tobytes()), self.ctx.buffer(panel.triangles.astype(np.int32).tobytes())
            texture = textures.get(id(panel.texture)) or texture_of(self.ctx, panel.texture, self._software)
            textures[id(panel.texture)] = texture
            vao = self._array(panel, vertices, triangles, self._light)
            self._parts.append(_Part(panel, vertices, triangles, vao, texture))
            if panel.casts:
                self.casters.append(self._shadow.solid(vertices, "3f 20x", triangles))

    def __bool__(self) -> bool:
        """Whether there is a room at all."""
        return bool(self._parts)

    def draw(self, shared: dict[str, object], *, tables: bool) -> None:
        """Draw its table tops, or all else of it, with what all shaders share."""
        for variant in self._programs.values():
            put(variant, baked=0, **shared)
        for part in self._parts:
            if part.panel.casts == tables:
                part.texture.use(0)
                part.vao.render()

    def light_seen(self, camera: Camera) -> F32:
        """What `camera` sees of it while nobody is in it: (SIDE, SIDE, 3) linear light, first row at the bottom."""
        ctx, size = self.ctx, (SIDE, SIDE)
        if self._seen is None:  # kept: moderngl binds again what was bound, which must not be gone
            self._seen = ctx.framebuffer([ctx.renderbuffer(size, 4, dtype="f2")], ctx.depth_renderbuffer(size))
        target = self._seen
        target.use()
        target.clear(*_DUSK)
        ctx.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        clip = as_gl(camera.projection(1.0) @ camera.view())
        for part in self._parts:
            vao = self._array(part.panel, part.vertices, part.triangles, ("SURROUNDINGS",))
            put(vao.program, clip_from_room=clip, eye=tuple(camera.position), baked=0, **self._shadow.use(1))
            part.texture.use(0)
            vao.render()
            vao.release()
        return np.frombuffer(target.read(components=3, dtype="f2"), np.float16).reshape(SIDE, SIDE, 3).astype(np.float32)

    def _array(
        self, panel: ShellPanel, vertices: moderngl.Buffer, triangles: moderngl.Buffer, defines: tuple[str, ...]
    ) -> moderngl.VertexArray:
        layout = [(vertices, "3f 3f 2f", "position", "normal", "uv")]
        return vertex_array(self.ctx, self._program(panel, defines), layout, triangles, skip_errors=True)

    def _program(self, panel: ShellPanel, defines: tuple[str, ...]) -> moderngl.Program:
        if panel.key:
            defines += (panel.key,)
        if panel.gloss:
            defines += (f"GLOSS {panel.gloss:.3f}",)
        if defines not in self._programs:
            self._programs[defines] = program(self.ctx, "room", defines=defines)
        return self._programs[defines]


_DUSK = (0.35, 0.40, 0.45, 1.0)
"""Light that comes in where the shell is open."""
