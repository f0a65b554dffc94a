"""Dear ImGui's triangles through moderngl, with textures that grow while it runs (its protocol since 1.92)."""

import ctypes
from typing import Any

import moderngl
import numpy as np

from vistel.render.gl.programs import program, put, vertex_array


class ImguiPainter:
    """Draws what ImGui has built into the framebuffer that is bound. imgui: the module, its context being current."""

    def __init__(self, ctx: moderngl.Context, imgui: Any) -> None:
        self._ctx, self._imgui = ctx, imgui
        self._program = program(ctx, "panel")
        self._vertices = ctx.buffer(reserve=1 << 16, dynamic=True)
        self._indices = ctx.buffer(reserve=1 << 15, dynamic=True)
        self._vao = self._bound()
        self._textures: dict[int, moderngl.Texture] = {}
        imgui.get_io().backend_flags |= imgui.BackendFlags_.renderer_has_textures
        limit = int(ctx.info["GL_MAX_TEXTURE_SIZE"])
        platform = imgui.get_platform_io()
        platform.renderer_texture_max_width = platform.renderer_texture_max_height = limit

    def _bound(self) -> moderngl.VertexArray:
        layout = [(self._vertices, "2f 2f 4f1", "place", "uv", "ink")]
        return vertex_array(self._ctx, self._program, layout, self._indices, self._imgui.INDEX_SIZE)

    def draw(self, data: Any, height: int) -> None:
        """data: ImGui's draw data; height: of the framebuffer [pixels]."""
        for texture in self._imgui.get_platform_io().textures:
            if texture.status != self._imgui.ImTextureStatus.ok:
                self._bring(texture)
        ctx, scale = self._ctx, data.framebuffer_scale
        ctx.enable_only(moderngl.BLEND)
        ctx.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        put(self._program, size=tuple(data.display_size), picture=0)
        for commands in data.cmd_lists:
            self._put(commands)
            for command in commands.cmd_buffer:
                x0, y0, x1, y1 = command.clip_rect
                box = int(x0 * scale.x), int(height - y1 * scale.y), int((x1 - x0) * scale.x), int((y1 - y0) * scale.y)
                if box[2] <= 0 or box[3] <= 0 or not command.elem_count:
                    continue
                ctx.scissor = box
                self._textures[command.tex_ref.get_tex_id()].use(0)
                self._vao.render(moderngl.TRIANGLES, command.elem_count, first=command.idx_offset)
        ctx.scissor = None

    def release(self) -> None:
        """Give everything back."""
        for texture in self._imgui.get_platform_io().textures:
            if texture.ref_count == 1:
                texture.status = self._imgui.ImTextureStatus.want_destroy
                self._bring(texture)
        for part in (self._vao, self._vertices, self._indices, self._program):
            part.release()

    def _put(self, commands: Any) -> None:
        vertices, indices = commands.vtx_buffer, commands.idx_buffer
        vertex_bytes, index_bytes = vertices.size() * self._imgui.VERTEX_SIZE, indices.size() * self._imgui.INDEX_SIZE
        if vertex_bytes > self._vertices.size or index_bytes > self._indices.size:
            self._vao.release()
            self._vertices.orphan(max(self._vertices.size, 2 * vertex_bytes))
            self._indices.orphan(max(self._indices.size, 2 * index_bytes))
            self._vao = self._bound()
        self._vertices.write(ctypes.string_at(vertices.data_address(), vertex_bytes))
        self._indices.write(ctypes.string_at(indices.data_address(), index_bytes))

    def _bring(self, texture: Any) -> None:
        """Make, change or take away a texture as ImGui wants it."""
        status = self._imgui.ImTextureStatus
        if texture.status == status.want_create:
            made = self._ctx.texture((texture.width, texture.height), 4, texture.get_pixels_array().tobytes())
            made.repeat_x = made.repeat_y = False
            self._textures[made.glo] = made
            texture.set_tex_id(made.glo)
            texture.status = status.ok
        elif texture.status == status.want_updates:
            pixels = np.asarray(texture.get_pixels_array()).reshape(texture.height, texture.width, 4)
            known = self._textures[texture.tex_id]
            for r in texture.updates:
                part = np.ascontiguousarray(pixels[r.y : r.y + r.h, r.x : r.x + r.w])
                known.write(part.tobytes(), viewport=(r.x, r.y, r.w, r.h))
            texture.status = status.ok
        elif texture.status == status.want_destroy:
            self._textures.pop(texture.tex_id).release()
            texture.set_tex_id(0)
            texture.status = status.destroyed
