"""Windows on an X server of the test's own: several of one picture, small and gone ones, each eye's buffer."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from typing import Any

import moderngl
import numpy as np
import pytest
from waiting import wait_until
from x_server import Hands, x_server

from vistel.render.gl.context import GlContext, NoOpenGlError, open_surface
from vistel.render.gl.raw_gl import BACK_LEFT, BACK_RIGHT
from vistel.render.painter import Painter
from vistel_services.renderer.window.presenter import Presenter, opener
from vistel_services.renderer.window.window import Pane, Window

pytestmark = pytest.mark.gl
RED, GREEN, BLUE = (255, 0, 0), (0, 255, 0), (0, 0, 255)


@pytest.fixture
def hands(monkeypatch: pytest.MonkeyPatch) -> Iterator[Hands]:
    with x_server(monkeypatch, 640, 480) as somebody:
        yield somebody


def window_of(surface: GlContext) -> Window:
    """The windows behind a surface."""
    assert isinstance(surface.window, Presenter)
    return surface.window.window


def halves(width: int, height: int) -> np.ndarray:
    """Red left, blue right, the lowest tenth green."""
    picture = np.zeros((height, width, 3), np.uint8)
    picture[:, : width // 2], picture[:, width // 2 :], picture[-height // 10 :] = RED, BLUE, GREEN
    return picture


def shown_on(hands: Hands, painter: Painter, there: dict[tuple[int, int], tuple[int, int, int]]) -> np.ndarray:
    """The screen once the windows are mapped and drawn: when these pixels, (row, column), have their colours."""
    screen = np.empty(0)

    def drawn() -> bool:
        nonlocal screen
        assert painter.show()
        screen = hands.screen()
        return all(tuple(screen[place]) == colour for place, colour in there.items())

    wait_until(drawn, f"{there} on the screen")
    return screen


def test_each_screen_has_a_window_of_its_own_where_the_file_puts_it(hands: Hands) -> None:
    panes = [Pane("l", 200, 150, at=(10, 20), part=(0, 0, 200, 150)), Pane("r", 200, 150, at=(300, 200), part=(200, 0, 200, 150))]
    surface = open_surface(opener(panes))
    try:
        painter = Painter(surface, 400, 150)
        for size in ((400, 150), (200, 75)):  # drawn smaller, it is enlarged
            painter.resize(*size)
            painter.put_picture(halves(*size))
            screen = shown_on(hands, painter, {(60, 110): RED, (240, 400): BLUE, (165, 110): GREEN, (345, 400): GREEN})
            assert not screen[10, 5].any() and not screen[100, 260].any()
        assert painter.error() == "GL_NO_ERROR"
    finally:
        surface.close()


def test_a_picture_keeps_its_shape_in_a_window_of_another(hands: Hands) -> None:
    surface = open_surface(opener([Pane("w", 300, 300, at=(0, 0))]))
    try:
        painter = Painter(surface, 300, 100)
        painter.put_picture(halves(300, 100))
        screen = shown_on(hands, painter, {(150, 20): RED, (150, 280): BLUE})
        assert not screen[90, 150].any() and not screen[210, 150].any()
    finally:
        surface.close()


def test_a_window_that_is_minimised_draws_nothing_and_is_drawn_again_when_it_is_back(hands: Hands) -> None:
    import glfw

    surface = open_surface(opener([Pane("w", 200, 150, at=(0, 0))]))
    try:
        painter = Painter(surface, 200, 150)
        painter.put_picture(halves(200, 150))
        shown_on(hands, painter, {(60, 20): RED, (60, 180): BLUE})
        sizes = iter([(0, 0), (200, 0), (0, 150), (1, 1)])
        real = window_of(surface).size
        for size in sizes:
            window_of(surface).size = lambda number=0, size=size: size  # type: ignore[method-assign]
            assert painter.show()
        window_of(surface).size = real  # type: ignore[method-assign]
        handle = window_of(surface)._handles[0]
        glfw.hide_window(handle)
        assert painter.show()
        glfw.show_window(handle)
        glfw.set_window_size(handle, 400, 300)
        wait_until(lambda: painter.show() and window_of(surface).size() == (400, 300) and tuple(hands.screen()[150, 380]) == BLUE)
        assert painter.error() == "GL_NO_ERROR"
    finally:
        surface.close()


def test_a_window_whose_cross_is_pressed_says_so(hands: Hands) -> None:
    import glfw

    surface = open_surface(opener([Pane("w", 100, 80)]))
    try:
        painter = Painter(surface, 100, 80)
        assert painter.show()
        glfw.set_window_should_close(window_of(surface)._handles[0], True)
        assert not painter.show()
    finally:
        surface.close()


def test_a_driver_without_stereo_buffers_is_reported_and_both_eyes_are_shown_side_by_side(
    hands: Hands, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        surface = open_surface(opener([Pane("w", 200, 150, at=(0, 0))], eyes_apart=True))
    try:
        if window_of(surface).stereo:
            pytest.skip("this driver has stereo buffers")
        assert len([r for r in caplog.records if "no_stereo_buffers" in r.message]) == 1
        painter = Painter(surface, 400, 150)
        painter.put_picture(halves(400, 150))
        shown_on(hands, painter, {(60, 20): RED, (60, 180): BLUE})
    finally:
        surface.close()


def test_with_stereo_buffers_each_eye_gets_its_half_of_the_picture() -> None:
    calls: list[tuple[Any, ...]] = []

    class Gl:
        def show(self, *said: Any) -> None:
            calls.append(said)

    class Driver:
        """A window of a driver that has them, which this machine's has not."""

        stereo = eyes_apart = True

        def parts(self, size: tuple[int, int]) -> list[tuple[int, int, int, int]]:
            return [(0, 0, *size)]

        def size(self, number: int = 0) -> tuple[int, int]:
            return 400, 300

        def enter(self, number: int) -> None:
            pass

        def gl(self, number: int) -> Gl:
            return Gl()

        def turn(self) -> bool:
            return True

    class Picture:
        size = (800, 300)
        colour = type("Colour", (), {"glo": 7})

    ctx: Any = type("Context", (), {"screen": type("Screen", (), {"use": lambda self: None, "viewport": None})()})
    assert Presenter(Driver()).show(ctx, Picture())  # type: ignore[arg-type]
    assert calls == [(7, (0, 0, 400, 300), (0, 0, 400, 300), BACK_LEFT), (7, (400, 0, 400, 300), (0, 0, 400, 300), BACK_RIGHT)]


def test_a_monitor_that_is_not_there_is_reported_and_an_ordinary_window_opened(
    hands: Hands, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        surface = open_surface(opener([Pane("w", 100, 80, monitor="no such monitor")]))
    try:
        assert surface.capability.window
        (line,) = [r.message for r in caplog.records if "no_monitor" in r.message]
        assert "no such monitor" in line and "there_are" in line
    finally:
        surface.close()


def test_opengl_that_is_too_old_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def too_old(**said: Any) -> moderngl.Context:
        raise ValueError(f"Requested OpenGL version {said.get('require')}, got version 210")

    monkeypatch.setattr(moderngl, "create_context", too_old)
    with pytest.raises(NoOpenGlError, match=r"no OpenGL 3\.3 \(Requested OpenGL version 330, got version 210\)") as e:
        open_surface()
    assert "\n" not in str(e.value)


def test_a_window_whose_opengl_is_too_old_is_closed_again_and_the_picture_drawn_without(
    hands: Hands, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    real = moderngl.create_context

    def too_old(**said: Any) -> moderngl.Context:
        if not said.get("standalone"):
            raise ValueError("Requested OpenGL version 330, got version 210")
        return real(**said)

    monkeypatch.setattr(moderngl, "create_context", too_old)
    with caplog.at_level(logging.WARNING):
        surface = open_surface(opener([Pane("w", 64, 64)]))
    try:
        assert not surface.capability.window
        assert any("got version 210" in r.message and "using=headless" in r.message for r in caplog.records)
    finally:
        surface.close()
