"""What is laid over a finished picture: names over heads, and the light of projectors whose pictures join."""

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np

from vistel.arrays import F64, U8
from vistel.render.gl.programs import program, put, vertex_array
from vistel.render.gl.textures import texture_of
from vistel.render.overlays.captions import paint_caption
from vistel.render.overlays.labels import Label, paint_label
from vistel.render.stage.captions import Caption
from vistel.render.view.screens import Sight

BEFORE_M = 0.3
"""A name on somebody's breast is so much nearer than their spine [m]."""
_NEAREST = 0.2
"""What is nearer to the eye is not named [m]."""
_Box = tuple[float, float, float, float]
"""Left, bottom, right, top [pixels]."""
_LAID_OVER = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA, moderngl.ZERO, moderngl.ONE_MINUS_SRC_ALPHA


def lay_over(ctx: moderngl.Context) -> None:
    """Blend what is drawn next as text: what is behind it shows through, and a pixel's alpha becomes the share of it that does.
    So the filter of edges (`antialias`) distinguishes letters, whose edges are smooth already, from what was drawn."""
    ctx.blend_func = _LAID_OVER  # pyright: ignore[reportAttributeAccessIssue]  of moderngl's two forms its types know one


@dataclass(frozen=True)
class LabelView:
    """A name, or what was said, over the room point `place` (3,). instead: (3,) where it is if it would cover what is read."""

    label: Label | Caption
    place: F64
    instead: F64 | None = None


class TexturedRectangle:
    """A rectangle that shows the texture bound to unit 0."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._program = program(ctx, "label")
        self._vao = vertex_array(ctx, self._program, [(_corners(ctx), "2f", "corner")])

    def draw(self, box: tuple[float, float, float, float], depth: float) -> None:
        """box: left, bottom, right, top in clip space; depth: there."""
        put(self._program, text=0, opacity=1.0, box=box, depth=depth)
        self._vao.render(moderngl.TRIANGLE_STRIP)


class Names:
    """Labels over places of the room; `line`: height of a name [pixels]."""

    def __init__(self, ctx: moderngl.Context, pane: TexturedRectangle) -> None:
        self._ctx, self._pane = ctx, pane
        self.line = 12
        self._textures: dict[tuple[Label | Caption, int], moderngl.Texture] = {}

    def draw(self, labels: Sequence[LabelView], eye: F64, clip: F64, size: tuple[int, int], read: Sequence[F64] = ()) -> None:
        """Those in sight of `eye` (3,), the farthest first, into a picture of `size` pixels; clip: (4, 4) from the room; read: of
        boards and panels, the corners (4, 3), from the lower left one round."""
        width, height = size
        fronts = [box for corners in read if (box := _front_seen(corners, eye, clip, size)) is not None]
        self._ctx.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
        lay_over(self._ctx)
        for view in sorted(labels, key=lambda v: -float(((v.place - eye) ** 2).sum())):
            at = clip @ np.append(view.place, 1.0)
            if at[3] < _NEAREST or abs(at[0]) > 1.3 * at[3] or abs(at[1]) > 1.3 * at[3]:
                continue
            texture = self._texture(view.label)
            w, h = texture.width, texture.height
            x, y = _lower_left(at, w, size)
            if view.instead is not None and any(_meet((x, y, x + w, y + h), front) for front in fronts):
                at = clip @ np.append(view.instead, 1.0)
                x, y = _lower_left(at, w, size)
                # They hide what is behind them there anyway, so the name is before their clothes.
                towards = eye - view.instead
                before = clip @ np.append(view.instead + BEFORE_M / max(BEFORE_M, float(np.linalg.norm(towards))) * towards, 1.0)
                at[2:] = before[2:]
            fits = max(2, min(width - w - 2, x)), max(2, min(height - h - 2, y))
            # A name that had to move into the picture may lie over its own head: there it is drawn on top.
            depth = float(at[2] / at[3]) if fits == (x, y) else -1.0
            x, y = fits
            texture.use(0)
            self._pane.draw((2 * x / width - 1, 2 * y / height - 1, 2 * (x + w) / width - 1, 2 * (y + h) / height - 1), depth)
        for known in set(self._textures) - {(view.label, self.line) for view in labels}:
            self._textures.pop(known).release()

    def _texture(self, label: Label | Caption) -> moderngl.Texture:
        key = label, self.line
        if key not in self._textures:
            self._textures[key] = texture_of(self._ctx, self._paint(label), False, mipmaps=False)
        return self._textures[key]

    def _paint(self, label: Label | Caption) -> U8:
        return paint_caption(label, round(0.7 * self.line)) if isinstance(label, Caption) else paint_label(label, self.line)


def _lower_left(at: F64, width: int, size: tuple[int, int]) -> tuple[int, int]:
    """Pixel of the lower left corner of what is `width` pixels wide and stands over `at` (4,) of clip space."""
    return round((0.5 + 0.5 * at[0] / at[3]) * size[0] - 0.5 * width), round((0.5 + 0.5 * at[1] / at[3]) * size[1])


def _front_seen(corners: F64, eye: F64, clip: F64, size: tuple[int, int]) -> _Box | None:
    """Where a rectangle that is read stands in the picture [pixels]; None where it cannot be read from `eye`."""
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    at = np.column_stack((corners, np.ones(4))) @ clip.T
    if float(normal @ (eye - corners[0])) <= 0.0 or at[:, 3].min() < _NEAREST:
        return None
    places = (0.5 + 0.5 * at[:, :2] / at[:, 3:]) * size
    return (*places.min(axis=0).tolist(), *places.max(axis=0).tolist())


def _meet(a: _Box, b: _Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


class Projectors:
    """Fades and tints what neighbouring projectors show, so that their pictures join."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = program(ctx, "correct")
        self._vao = vertex_array(ctx, self._program, [(_corners(ctx), "2f", "corner")])

    def join(self, target: moderngl.Framebuffer, sights: Sequence[Sight]) -> None:
        """Correct the pictures of `sights` that are in `target`."""
        self._ctx.enable_only(moderngl.BLEND)
        self._ctx.blend_func = moderngl.DST_COLOR, moderngl.ZERO
        # Both eyes of an anaglyph share a box, which is corrected once.
        for box, screen in {sight.box: sight.screen for sight in sights}.items():
            if box is None or screen is None or screen.plain:
                continue
            target.viewport = box
            put(self._program, gain=screen.gain, blend=screen.blend)
            self._vao.render(moderngl.TRIANGLE_STRIP)


def _corners(ctx: moderngl.Context) -> moderngl.Buffer:
    return ctx.buffer(np.array(((0, 0), (1, 0), (0, 1), (1, 1)), np.float32).tobytes())
