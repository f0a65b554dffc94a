"""How a finished picture gets on the windows: whole, a screen's part to each window, or each eye to its own buffer."""

from __future__ import annotations

from collections.abc import Callable

import moderngl

from vistel_services.renderer.canvas import Canvas
from vistel_services.renderer.window.bare_gl import BACK, BACK_LEFT, BACK_RIGHT, Box
from vistel_services.renderer.window.window import Window


class Presenter:
    """Shows pictures on `window`, whose context `ctx` is current."""

    def __init__(self, ctx: moderngl.Context, window: Window) -> None:
        self._ctx, self._window = ctx, window

    def show(self, canvas: Canvas, over: Callable[[], None] | None = None) -> bool:
        """The picture in `canvas`, and what `over` draws into the first window, whose framebuffer is bound for it. False
        when a window was closed."""
        window = self._window
        for number, part in reversed(list(enumerate(window.parts(canvas.size)))):
            size = window.size(number)
            if not all(size):
                continue  # minimised: there is nothing to draw into
            window.enter(number)
            for source, buffer in _eyes(part, window.stereo):
                into = fitted(source, size, window.eyes_apart and not window.stereo)
                window.gl(number).show(canvas.colour.glo, source, into, buffer)
            if number == 0:
                self._ctx.screen.use()
                self._ctx.screen.viewport = (0, 0, *size)
                if over is not None:
                    over()
        return window.turn()


def _eyes(part: Box, stereo: bool) -> list[tuple[Box, int]]:
    if not stereo:
        return [(part, BACK)]
    x, y, w, h = part
    return [((x, y, w // 2, h), BACK_LEFT), ((x + w // 2, y, w - w // 2, h), BACK_RIGHT)]


def fitted(part: Box, size: tuple[int, int], squeezed: bool = False) -> Box:
    """Where in a window of `size` a picture's part is shown as large as fits, its shape kept. squeezed: it holds two eyes'
    pictures of full width side by side, each of which gets half the window's."""
    _, _, w, h = part
    w = w // 2 if squeezed else w
    scale = min(size[0] / w, size[1] / h)
    width, height = round(w * scale), round(h * scale)
    return (size[0] - width) // 2, (size[1] - height) // 2, width, height
