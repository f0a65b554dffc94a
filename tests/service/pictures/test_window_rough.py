"""What happens to windows: made as small as can be, their graphics card lost, monitors chosen among several."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from waiting import wait_until
from window_pictures import HEIGHT, WIDTH, Pictures, played
from x_server import Hands, x_server

from vistel.render.gl.context import open_surface
from vistel.render.interaction.requests import Drag, Drop
from vistel.render.painter import Painter
from vistel.render.view.view import Mode
from vistel_services.renderer import drawing_thread
from vistel_services.renderer.window.presenter import opener
from vistel_services.renderer.window.window import Pane, chosen_monitor

pytestmark = pytest.mark.gl


@pytest.fixture
def hands(monkeypatch: pytest.MonkeyPatch) -> Iterator[Hands]:
    with x_server(monkeypatch, WIDTH, HEIGHT) as somebody:
        yield somebody


def test_a_window_made_as_small_as_can_be_goes_on_and_is_whole_again_when_it_is_large(
    hands: Hands, caplog: pytest.LogCaptureFixture
) -> None:
    import glfw

    async def play(p: Pictures) -> None:
        call, handle, studio = p.drawing._call, p.window._handles[0], p.drawing._renderer
        for size in ((1, 1), (9, 2), (2, 200)):
            await call(glfw.set_window_size, handle, *size)
            await p.until(lambda size=size: p.window.size() == size, f"a window of {size}")
            hands.move(0, 0)
            hands.button(1, True)
            hands.move(1, 1)
            hands.button(1, False)
            hands.wheel(1)
            drawn = await p.draw(3)
            assert drawn is not None and drawn.shape == (HEIGHT, WIDTH, 4)
        p.window.size = lambda number=0: (0, 0)  # as minimised ones are
        hands.move(2, 2)
        assert await p.draw(2) is not None
        del p.window.size
        await call(glfw.set_window_size, handle, WIDTH, HEIGHT)
        await p.until(lambda: p.window.size() == (WIDTH, HEIGHT), "the window as it was")
        await p.until(lambda: hands.screen().std() > 20, "a picture of the window")
        assert p.drawing._renderer is studio and studio.painter.error() == "GL_NO_ERROR"
        assert not [r for r in caplog.records if r.levelno >= logging.ERROR]

    played(play)


def test_a_card_lost_in_the_middle_of_a_drag_gives_a_new_window_with_what_was_set_and_lets_go(
    hands: Hands, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(drawing_thread, "RETRY_NS", 50_000_000)

    async def play(p: Pictures) -> None:
        x, y = p.at("ball")
        hands.move(x, y)
        hands.button(1, True)
        await p.until(lambda: p.interaction._dragging is not None, "the ball on the mouse")
        for k in range(1, 5):
            hands.move(x, y - 6 * k)
            await p.draw()
        p.interaction.choices = replace(p.interaction.choices, gauges=True, mode=Mode.FREE)
        led = [w for w in p.drawing.requests() if isinstance(w, Drag)]
        assert led and led[-1].thing == "ball"
        lost = p.drawing._renderer
        with caplog.at_level(logging.ERROR):
            await p.drawing._call(lost._surface.ctx.release)
            await p.until(lambda: p.drawing._renderer not in (None, lost), "another window")
        await p.draw(3)
        await p.until(lambda: hands.screen().std() > 20, "a picture of the other window")
        assert p.interaction.choices.gauges and p.interaction.choices.mode is Mode.FREE
        (free,) = [w for w in p.drawing.requests() if isinstance(w, Drop)]
        assert free.thing == "ball"
        assert sum("set_up_again" in r.message for r in caplog.records) == 1

    played(play)


@pytest.mark.parametrize(
    ("wanted", "names", "chosen"),
    [
        ("HDMI-1", ["DP-1", "HDMI-1"], 1),
        ("hdmi", ["DP-1", "HDMI-1"], 1),
        ("0", ["DP-1", "HDMI-1"], 0),
        ("1", ["DP-1", "HDMI-1"], 1),
        ("DP-1", ["eDP-1", "DP-1"], 1),
        ("DP-1", ["DP-10", "DP-1"], 1),
        ("DP", ["eDP-1", "DP-1"], 0),
        ("EPSON", ["DP-1", "Epson PJ"], 1),
        ("2", ["DP-1", "DP-2"], 1),
        ("7", ["DP-1", "HDMI-2"], None),
        ("VGA", ["DP-1", "HDMI-1"], None),
        ("0", [], None),
        ("\u00b2", ["DP-1"], None),
    ],
)
def test_a_monitor_is_meant_by_its_name_its_number_or_part_of_its_name(wanted: str, names: list[str], chosen: int | None) -> None:
    assert chosen_monitor(wanted, names) == chosen


def test_each_screen_fills_the_monitor_that_is_named_for_it(hands: Hands, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two monitors side by side, as the system would tell of them; the windows on them are real."""
    import glfw

    half = WIDTH // 2
    there = {"left": ("eDP-1", (0, 0)), "right": ("DP-1", (half, 0))}
    monkeypatch.setattr(glfw, "get_monitors", lambda: list(there))
    monkeypatch.setattr(glfw, "get_monitor_name", lambda m: there[m][0].encode())
    monkeypatch.setattr(glfw, "get_monitor_pos", lambda m: there[m][1])
    monkeypatch.setattr(glfw, "get_video_mode", lambda m: SimpleNamespace(size=SimpleNamespace(width=half, height=HEIGHT)))
    panes = [Pane("a", 64, 64, monitor="DP-1", part=(0, 0, 64, 64)), Pane("b", 64, 64, monitor="0", part=(64, 0, 64, 64))]
    surface = open_surface(opener(panes))
    try:
        painter = Painter(surface, 128, 64)
        picture = np.zeros((64, 128, 3), np.uint8)
        picture[:, :64], picture[:, 64:] = (255, 0, 0), (0, 0, 255)
        painter.put_picture(picture)

        def shown() -> list[tuple[int, ...]]:
            """The middles of both monitors."""
            assert painter.show()
            screen = hands.screen()
            return [tuple(screen[HEIGHT // 2, x]) for x in (half // 2, half + half // 2)]

        wait_until(lambda: shown() == [(0, 0, 255), (255, 0, 0)], "the first pane on the right monitor, the other on the left")
        assert surface.window.window.size(0) == surface.window.window.size(1) == (half, HEIGHT)
    finally:
        surface.close()
