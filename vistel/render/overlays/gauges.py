"""How late everybody is, over the picture: for who sets a conference up."""

from collections.abc import Sequence
from functools import lru_cache

import moderngl
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vistel.arrays import U8
from vistel.render.gl.textures import texture_of
from vistel.render.overlays.overlays import TexturedRectangle, lay_over
from vistel.render.stage.stage import Instant

_INK = (226, 232, 238, 255)
_OLD = (255, 168, 110, 255)
"""Colour of what is later than `_OLD_S`."""
_GROUND = (10, 12, 16, 205)
_OLD_S = 0.5
_TURN_NS = 500_000_000
_NAME = 14


class Rate:
    """Pictures a second, from the times of the last ones."""

    def __init__(self) -> None:
        self._since_ns: int | None = None
        self._count = 0
        self.hertz = 0.0

    def drew(self, now_ns: int) -> None:
        """A picture of `now_ns` is drawn."""
        if self._since_ns is None:
            self._since_ns = now_ns
            return
        self._count += 1
        if now_ns - self._since_ns >= _TURN_NS:
            self.hertz = self._count / ((now_ns - self._since_ns) * 1e-9)
            self._since_ns, self._count = now_ns, 0


@lru_cache(maxsize=4)
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    try:
        return ImageFont.truetype("DejaVuSansMono.ttf", size)
    except OSError:
        return ImageFont.load_default(size)


def rows_of(instant: Instant, hertz: float, scale: float) -> tuple[tuple[str, bool], ...]:
    """A row of text for the picture and one for each person, and whether something is amiss: who is shown how long after it was
    captured, how old the newest that has come is, how unevenly it comes, and whether what is shown is a guess."""
    rows = [(f"{hertz:5.1f} pictures/s, drawn at {round(100 * scale)} %", False)]
    for person in instant.people:
        t = person.timing
        name = person.about.display_name
        name = name if len(name) <= _NAME else name[: _NAME - 1] + "…"
        text = f"{name:<{_NAME}} delay {t.delay_ns * 1e-6:4.0f}  age {t.age_ns * 1e-6:4.0f}  jitter {t.jitter_ns * 1e-6:3.0f} ms"
        rows.append((text + ("  held" if t.holding else ""), t.holding or t.age_ns * 1e-9 > _OLD_S))
    return tuple(rows)


class Gauges:
    """Draws rows of text into the picture's upper left corner; line: height of one [pixels]."""

    def __init__(self, ctx: moderngl.Context, pane: TexturedRectangle) -> None:
        self._ctx, self._pane = ctx, pane
        self.line = 12
        self._shown: tuple[tuple[tuple[str, bool], ...], int] = ((), 0)
        self._texture: moderngl.Texture | None = None

    def draw(self, rows: Sequence[tuple[str, bool]], size: tuple[int, int]) -> None:
        """Into a picture of `size` pixels."""
        if not rows:
            return
        key = tuple(rows), self.line
        if key != self._shown or self._texture is None:
            if self._texture is not None:
                self._texture.release()
            self._texture, self._shown = texture_of(self._ctx, paint(rows, self.line), False, mipmaps=False), key
        width, height = size
        w, h = self._texture.width, self._texture.height
        self._ctx.enable_only(moderngl.BLEND)
        lay_over(self._ctx)
        self._texture.use(0)
        self._pane.draw((-1.0, 1.0 - 2 * h / height, 2 * w / width - 1.0, 1.0), -1.0)


def paint(rows: Sequence[tuple[str, bool]], line: int) -> U8:
    """(h, w, 4) RGBA of rows `line` pixels high, first row at the top."""
    font = _font(max(7, round(0.72 * line)))
    pad = round(0.5 * line)
    width = round(max(font.getlength(text) for text, _ in rows)) + 2 * pad
    image = Image.new("RGBA", (width, line * len(rows) + 2 * pad), _GROUND)
    draw = ImageDraw.Draw(image)
    for k, (text, amiss) in enumerate(rows):
        draw.text((pad, pad + (k + 0.5) * line), text, font=font, fill=_OLD if amiss else _INK, anchor="lm")
    return np.asarray(image, np.uint8)
