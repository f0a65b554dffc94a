"""What is drawn on: colour and depth of a picture, smoothed by many samples where that is cheap."""

import moderngl
import numpy as np

from vistel.arrays import U8


class Canvas:
    """A picture of `width` x `height` pixels; `target` is drawn into, `colour` holds it once it is `resolve`d, and so does
    `depth` where that is kept."""

    def __init__(self, ctx: moderngl.Context, width: int, height: int, samples: int, keeps_depth: bool = False) -> None:
        self._ctx = ctx
        self.size = width, height
        self.colour = ctx.texture(self.size, 4)
        self.colour.repeat_x = self.colour.repeat_y = False
        self.depth: moderngl.Texture | None = None
        if keeps_depth:
            self.depth = ctx.depth_texture(self.size)
            self.depth.compare_func = ""
            self.depth.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self.depth.repeat_x = self.depth.repeat_y = False
        under = self.depth or ctx.depth_renderbuffer(self.size)
        self._plain = self.target = ctx.framebuffer([self.colour], under)
        self._parts: list[moderngl.Framebuffer | moderngl.Renderbuffer | moderngl.Texture]
        self._parts = [self._plain, self.colour, under]
        if samples > 1:
            many = ctx.renderbuffer(self.size, 4, samples=samples), ctx.depth_renderbuffer(self.size, samples=samples)
            self.target = ctx.framebuffer([many[0]], many[1])
            self._parts += [self.target, *many]

    def resolve(self) -> None:
        """Bring what was drawn into `colour` and `depth`."""
        if self.target is not self._plain:
            self._ctx.copy_framebuffer(self._plain, self.target)

    def read_into(self, out: U8) -> None:
        """The resolved picture as (height, width, 4) RGBA bytes, first row at the bottom."""
        self._plain.read_into(out, components=4, alignment=1)

    def write(self, picture: U8) -> None:
        """Put a picture (height, width, 3) into `colour`, first row at the top."""
        opaque = np.full((*picture.shape[:2], 1), 255, np.uint8)
        self.colour.write(np.ascontiguousarray(np.concatenate((picture[::-1], opaque[::-1]), axis=2)).tobytes())

    def release(self) -> None:
        """Give everything back."""
        for part in self._parts:
            part.release()
