"""Shows finished pictures on windows: whole, a screen's part to each window, or each eye to its own buffer."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import moderngl

from vistel.arrays import U8
from vistel.render.gl.canvas import Canvas
from vistel.render.gl.context import open_surface
from vistel.render.gl.raw_gl import BACK, BACK_LEFT, BACK_RIGHT
from vistel.render.interaction.window_interaction import WindowInteraction
from vistel.render.painter import Painter
from vistel.render.view.screens import Box, Stereo, fitted
from vistel.render.view.view import View, choices_of
from vistel.space.files.model import Polymesh
from vistel_services.renderer.window.window import Pane, Window

_SHOWN_AGAIN_S = 0.05
"""Between two looks at whether a window with a still picture was closed."""


class Presenter:
    """Shows pictures on `window` (a `GlWindow`)."""

    def __init__(self, window: Window) -> None:
        self.window = window

    def show(self, ctx: moderngl.Context, canvas: Canvas, over: Callable[[], None] | None = None) -> bool:
        """The picture in `canvas`, and what `over` draws into the first window, whose framebuffer is bound for it. False
        when a window was closed."""
        window = self.window
        for number, part in reversed(list(enumerate(window.parts(canvas.size)))):
            size = window.size(number)
            if not all(size):
                continue  # minimised: there is nothing to draw into
            window.enter(number)
            for source, buffer in _eyes(part, window.stereo):
                into = fitted(source, size, window.eyes_apart and not window.stereo)
                window.gl(number).show(canvas.colour.glo, source, into, buffer)
            if number == 0:
                ctx.screen.use()
                ctx.screen.viewport = (0, 0, *size)
                if over is not None:
                    over()
        return window.turn()

    def close(self) -> None:
        """Close the windows."""
        self.window.close()


class DesktopWindows:
    """Windows for pictures of `view`, one for each of `panes` (a `WindowSystem`). title: of the panel beside the picture."""

    def __init__(self, view: View, panes: Sequence[Pane], title: str) -> None:
        self._view, self._panes, self._title = view, panes, title
        self._window: Window | None = None

    def open(self) -> Presenter:
        """Open them. Raises NoWindowError."""
        self._window = Window(self._panes, self._view.stereo is Stereo.QUAD_BUFFER)
        return Presenter(self._window)

    def interaction(self, painter: Painter, models: Mapping[str, Polymesh]) -> WindowInteraction:
        """What somebody does at them."""
        assert self._window is not None, "opened before"
        view = self._view
        choices = replace(choices_of(view), light="fine" if painter.fine else "fast")
        walled, stereo = bool(view.screens), view.stereoscopic
        return WindowInteraction(painter.ctx, self._window, view.eyes, choices, self._title, models, walled=walled, stereo=stereo)


def opener(panes: Sequence[Pane], eyes_apart: bool = False) -> Callable[[], Presenter]:
    """What `open_surface` opens windows with. eyes_apart: see `Window`."""
    return lambda: Presenter(Window(panes, eyes_apart))


def show_picture(picture: U8, title: str) -> bool:
    """Show a picture (h, w, 3), first row at the top, in a window until that is closed; False where no window can be opened.

    Raises NoOpenGlError.
    """
    height, width = picture.shape[:2]
    surface = open_surface(opener([Pane(title, width, height)]))
    try:
        if surface.window is None:
            return False
        painter = Painter(surface, width, height)
        painter.put_picture(picture)
        while painter.show():
            time.sleep(_SHOWN_AGAIN_S)
        return True
    finally:
        surface.close()


def _eyes(part: Box, stereo: bool) -> list[tuple[Box, int]]:
    if not stereo:
        return [(part, BACK)]
    x, y, w, h = part
    return [((x, y, w // 2, h), BACK_LEFT), ((x + w // 2, y, w - w // 2, h), BACK_RIGHT)]
