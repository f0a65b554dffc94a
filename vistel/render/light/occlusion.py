"""Darkens the picture where surfaces hide each other's light: in folds, under chins, where feet stand on the floor."""

import moderngl
import numpy as np

from vistel.arrays import F64
from vistel.render.gl.canvas import Canvas
from vistel.render.gl.programs import as_gl, program, put, vertex_array
from vistel.render.view.screens import Box, Sight


class Occlusion:
    """Works on what a canvas holds so far."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._measure = program(ctx, "occlusion")
        self._darken = program(ctx, "occlusion", "occlude")
        corners = ctx.buffer(np.array(((0, 0), (1, 0), (0, 1), (1, 1)), np.float32).tobytes())
        self._measuring = vertex_array(ctx, self._measure, [(corners, "2f", "corner")])
        self._darkening = vertex_array(ctx, self._darken, [(corners, "2f", "corner")])
        self._targets: dict[tuple[int, int], tuple[moderngl.Texture, moderngl.Framebuffer]] = {}

    def darken(self, canvas: Canvas, sight: Sight, clip: F64, box: Box) -> None:
        """Darken what is in `box`, seen by `sight`; clip: (4, 4) from the room."""
        depth = canvas.depth
        if depth is None:
            raise ValueError("occlusion: the canvas keeps no depth")
        canvas.resolve()
        x, y, width, height = box
        part = (x / canvas.size[0], y / canvas.size[1], width / canvas.size[0], height / canvas.size[1])
        share, target = self._target(width, height)
        target.use()
        self._ctx.enable_only(moderngl.NOTHING)
        depth.use(0)
        put(
            self._measure,
            depth=0,
            room_from_clip=as_gl(np.linalg.inv(clip)),
            eye=tuple(sight.camera.position),
            part=part,
            pixels=sight.camera.pixels_per_m(1.0, height) / width,
            aspect=width / height,
        )
        self._measuring.render(moderngl.TRIANGLE_STRIP)
        canvas.target.use()
        self._ctx.enable_only(moderngl.BLEND)
        self._ctx.blend_func = moderngl.DST_COLOR, moderngl.ZERO
        share.use(1)
        put(self._darken, open_share=1, depth=0, part=part)
        self._darkening.render(moderngl.TRIANGLE_STRIP)

    def _target(self, width: int, height: int) -> tuple[moderngl.Texture, moderngl.Framebuffer]:
        """Kept for each size that is drawn: a few, with the resolutions a machine can do."""
        size = width, height
        if size not in self._targets:
            texture = self._ctx.texture(size, 1)
            self._targets[size] = texture, self._ctx.framebuffer([texture])
        return self._targets[size]
