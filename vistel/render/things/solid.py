"""Things on the graphics side: surfaces in plain colours, and those that show pictures."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import moderngl
import numpy as np

from vistel.arrays import F32, U8
from vistel.figure.making.source import Finish
from vistel.render.gl.programs import program, put, vertex_array
from vistel.render.gl.textures import rewritten
from vistel.render.light.shadow import ShadowMap
from vistel.render.light.surroundings import SMOOTHEST
from vistel.space.files.surfaces import PLAIN, SurfacePiece
from vistel.space.things.tessellate import Surface3

MOST_UNUSED = 4
"""Textures that are kept when nothing shows them."""


@dataclass
class SurfaceBuffers:
    """A surface on the graphics side; more: (n, 4) tint of its vertices, or (n, 2) their places in the picture; finish: how it
    shines where it is of a polymesh; glows: its picture shines by itself."""

    vao: moderngl.VertexArray
    shadow: moderngl.VertexArray
    buffers: list[moderngl.Buffer]
    more: F32
    picture: moderngl.Texture | None = None
    silhouette: moderngl.VertexArray | None = None
    finish: Finish = PLAIN
    glows: bool = False
    live: moderngl.Texture | None = None
    """Its own, that is seen in place of its picture."""

    def release(self) -> None:
        """Give it back."""
        if self.live is not None:
            self.live.release()
        for part in (self.vao, self.shadow, *([self.silhouette] if self.silhouette else []), *self.buffers):
            part.release()


@dataclass
class _Painted:
    """A picture and its texture; uses: surfaces that show it."""

    picture: U8
    texture: moderngl.Texture
    uses: int = 0


class SolidThings:
    """Makes and draws solids. paint: a texture of a picture (h, w, 3), first row at the top; light: defines of the shaders."""

    def __init__(
        self, ctx: moderngl.Context, shadow: ShadowMap, paint: Callable[[U8], moderngl.Texture], light: tuple[str, ...] = ()
    ) -> None:
        self.ctx, self._shadow, self._paint = ctx, shadow, paint
        self._plain = program(ctx, "solid", defines=light)
        self._pictured = program(ctx, "solid", defines=(*light, "PICTURED"))
        self._textures: dict[int | bytes, _Painted] = {}

    def plain(self, surface: Surface3, tint: F32) -> SurfaceBuffers:
        """A surface in colours of its vertices: linear colour and the ambient light there (n, 4)."""
        data = np.hstack((surface.vertices, surface.normals, tint)).astype(np.float32)
        vbo, ibo = self.ctx.buffer(data.tobytes()), self.ctx.buffer(surface.triangles.astype(np.int32).tobytes())
        vao = vertex_array(self.ctx, self._plain, [(vbo, "3f 3f 4f", "position", "normal", "tint")], ibo)
        return SurfaceBuffers(vao, self._shadow.solid(vbo, "3f 28x", ibo), [vbo, ibo], tint)

    def pictured(self, piece: SurfacePiece) -> SurfaceBuffers:
        """A piece of a polymesh with its picture; a plain one with a picture of one dot."""
        s = piece.surface
        picture, uv = piece.picture, piece.uv
        if picture is None or uv is None:
            picture, uv = np.array([[piece.colour]], np.uint8), np.zeros((len(s.vertices), 2), np.float32)
        data = np.hstack((s.vertices, s.normals, uv)).astype(np.float32)
        vbo, ibo = self.ctx.buffer(data.tobytes()), self.ctx.buffer(s.triangles.astype(np.int32).tobytes())
        vao = vertex_array(self.ctx, self._pictured, [(vbo, "3f 3f 2f", "position", "normal", "uv")], ibo)
        shadow = self._shadow.solid(vbo, "3f 20x", ibo)
        return SurfaceBuffers(vao, shadow, [vbo, ibo], uv, self._texture(picture), finish=piece.finish, glows=piece.glows)

    def repaint(self, solid: SurfaceBuffers, picture: U8 | None) -> None:
        """Show another picture (h, w, 3) on a surface, first row at the top; None: its own again."""
        if picture is not None and solid.live is not None and rewritten(solid.live, picture):
            return
        if solid.live is not None:
            solid.live.release()
        solid.live = None if picture is None else self._paint(picture)

    def release(self, solid: SurfaceBuffers) -> None:
        """Give a surface back. Textures that nothing shows are kept for a while: a thing that changes shows its own again."""
        solid.release()
        for key, painted in list(self._textures.items()):
            if painted.texture is solid.picture:
                self._textures[key] = self._textures.pop(key)  # let go of last
                painted.uses -= 1
        unused = [key for key, painted in self._textures.items() if not painted.uses and painted.picture.size > 3]
        for key in unused[:-MOST_UNUSED]:
            self._textures.pop(key).texture.release()

    def draw(self, views: Sequence[tuple[bytes, SurfaceBuffers]], gloss: float, shared: dict[str, object]) -> None:
        """Draw solids at matrices (as OpenGL reads them) with what all shaders share."""
        put(self._plain, gloss=gloss, rough=1.0 - 1.7 * gloss, **shared)
        for matrix, solid in views:
            if solid.picture is None:
                put(self._plain, room_from_thing=matrix)
                solid.vao.render()
        if not any(solid.picture for _, solid in views):
            return
        put(self._pictured, picture=0, **shared)
        self.ctx.disable(moderngl.CULL_FACE)  # polymeshes of others may be sheets, seen from both sides
        for matrix, solid in views:
            if solid.picture is not None:
                put(
                    self._pictured,
                    room_from_thing=matrix,
                    metallic=solid.finish.metallic,
                    rough=max(SMOOTHEST, solid.finish.roughness),
                    glows=float(solid.glows),
                )
                (solid.live or solid.picture).use(0)
                solid.vao.render()
        self.ctx.enable(moderngl.CULL_FACE)

    def _texture(self, picture: U8) -> moderngl.Texture:
        """One for all that show the same picture."""
        key = picture.tobytes() if picture.size <= 3 else id(picture)
        if key not in self._textures:
            self._textures[key] = _Painted(picture, self._paint(picture))
        self._textures[key].uses += 1
        return self._textures[key].texture
