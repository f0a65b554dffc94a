"""Captions drawn at the foot of a picture."""

from collections.abc import Sequence

import moderngl

from vistel.render.gl.textures import texture_of
from vistel.render.overlays.captions import paint_caption
from vistel.render.overlays.overlays import TexturedRectangle, lay_over
from vistel.render.stage.captions import Caption


class Subtitles:
    """Captions at the foot of a picture; line: height of one [pixels]."""

    def __init__(self, ctx: moderngl.Context, pane: TexturedRectangle) -> None:
        self._ctx, self._pane = ctx, pane
        self.line = 14
        self._textures: dict[tuple[Caption, int], moderngl.Texture] = {}

    def draw(self, captions: Sequence[Caption], size: tuple[int, int]) -> None:
        """Into a picture of `size` pixels, the newest lowest."""
        for old in set(self._textures) - {(caption, self.line) for caption in captions}:
            self._textures.pop(old).release()
        if not captions:
            return
        width, height = size
        self._ctx.enable_only(moderngl.BLEND)
        lay_over(self._ctx)
        y = round(0.6 * self.line)
        for caption in reversed(captions):
            key = caption, self.line
            if key not in self._textures:
                self._textures[key] = texture_of(self._ctx, paint_caption(caption, self.line), False, mipmaps=False)
            texture = self._textures[key]
            w, h = texture.width, texture.height
            scale = min(1.0, (width - 4) / w)
            w, h = round(scale * w), round(scale * h)
            x = (width - w) // 2
            texture.use(0)
            self._pane.draw((2 * x / width - 1, 2 * y / height - 1, 2 * (x + w) / width - 1, 2 * (y + h) / height - 1), -1.0)
            y += h + 3
