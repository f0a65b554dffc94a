"""The light is changed at a real window: the picture changes, the window stays."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from x_server import Hands, x_server

from vistel.figure.posture.posture import standing
from vistel.geometry.pose import Pose
from vistel.render import scene_renderer as studios
from vistel.render.figures.figures import DrawableFigure, StandIn
from vistel.render.painter import Painter
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.view import View
from vistel.space.room import meeting_room
from vistel_services.renderer.drawing_thread import DrawingThread
from vistel_services.renderer.window.window import Pane

pytestmark = pytest.mark.gl
ROOM = meeting_room(3)
LOOSE = {t.id: t for t in ROOM.things if not t.fixed}
ABOUT = ParticipantInfo("aiko", "Aiko")


@pytest.fixture
def hands(monkeypatch: pytest.MonkeyPatch) -> Iterator[Hands]:
    with x_server(monkeypatch, 320, 200) as somebody:
        yield somebody


def shapes(about: ParticipantInfo) -> DrawableFigure:
    return StandIn(about.height)


def instant(n: int, *, people: bool = True, without: str = "") -> Instant:
    things = {name: t for name, t in LOOSE.items() if name != without}
    world = PlayoutWorld(n, {name: Pose(t.position, t.rotation) for name, t in things.items()})
    somebody = (PersonNow(ABOUT, standing(), Timing(0, 0, 0, False)),) if people else ()
    return Instant(n * 33_000_000, somebody, world, things)


def played(play: Callable[[DrawingThread], Awaitable[None]]) -> None:
    async def whole() -> None:
        thread = ThreadPoolExecutor(1)
        drawing = DrawingThread(
            "tokyo", View(160, 100, "room", "", light="fast"), 30.0, 3, None, True, shapes, thread, {}, [Pane("w", 160, 100)]
        )
        try:
            await drawing.draw(partial(instant, 1))
            assert drawing._renderer is not None
            drawing._renderer._smoothing.result()
            await play(drawing)
        finally:
            await drawing.close()
            thread.shutdown()

    asyncio.run(whole())


async def picture(drawing: DrawingThread, n: int, **how: Any) -> np.ndarray:
    """The third of three, when shadows are there."""
    for k in range(3):
        drawn = await drawing.draw(partial(instant, n + k, **how))
    assert drawn is not None
    return drawn[..., :3].astype(float)


async def lit(drawing: DrawingThread, light: str, n: int) -> None:
    """Somebody chooses a light in the panel."""
    interaction = drawing._renderer.interaction
    interaction._chosen(replace(interaction.choices, light=light))
    await drawing.draw(partial(instant, n))


def windows(hands: Hands) -> list[int]:
    return [w.id for w in hands._display.screen().root.query_tree().children]


def test_the_light_changes_to_and_fro_in_one_window(hands: Hands, caplog: pytest.LogCaptureFixture) -> None:
    async def play(drawing: DrawingThread) -> None:
        studio = drawing._renderer
        fast = await picture(drawing, 10)
        there, context, interaction = windows(hands), studio.painter.ctx, studio.interaction
        with caplog.at_level(logging.INFO, "vistel.renderer"):
            await lit(drawing, "fine", 20)
        assert drawing._renderer is studio and studio.painter.fine
        fine = await picture(drawing, 30)
        assert np.abs(fine - fast).mean() > 2.0
        painter = studio.painter
        await lit(drawing, "fast", 40)
        assert np.abs(await picture(drawing, 50) - fast).mean() < 0.5
        await drawing._call(studio.draw_at, 0.5)
        await lit(drawing, "fine", 60)
        assert studio.painter is painter  # made once
        assert painter.size == (80, 50)
        await drawing._call(studio.draw_at, 1.0)
        assert np.abs(await picture(drawing, 70) - fine).mean() < 0.5
        assert (windows(hands), studio.painter.ctx, studio.interaction) == (there, context, interaction)
        assert hands.screen().any() and studio.painter.error() == "GL_NO_ERROR"
        assert interaction.choices.light == "fine"
        assert len([r for r in caplog.records if "event=light now=fine setup_ms=" in r.message]) == 1
        assert not any("drawing_with" in r.message for r in caplog.records)

    played(play)


def test_who_and_what_goes_while_another_light_is_on_is_gone_in_this_one_too(hands: Hands) -> None:
    async def play(drawing: DrawingThread) -> None:
        empty = await picture(drawing, 10, people=False, without="ball")
        whole = await picture(drawing, 20)
        assert np.abs(whole - empty).max() > 30
        await lit(drawing, "fine", 30)
        await picture(drawing, 40)
        await picture(drawing, 50, people=False, without="ball")
        interaction = drawing._renderer.interaction
        interaction._chosen(replace(interaction.choices, light="fast"))
        for k in range(60, 64):
            drawn = await drawing.draw(partial(instant, k, people=False, without="ball"))
        assert np.abs(drawn[..., :3] - empty).mean() < 0.5
        assert not drawing._renderer.painter._figures._figures

    played(play)


def test_light_that_cannot_be_set_up_is_reported_in_one_line_and_the_picture_goes_on(
    hands: Hands, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: Any) -> Painter:
        raise RuntimeError("out of memory")

    async def play(drawing: DrawingThread) -> None:
        before = await picture(drawing, 10)
        monkeypatch.setattr(studios, "Painter", none)
        with caplog.at_level(logging.WARNING, "vistel.renderer"):
            await lit(drawing, "fine", 20)
        (line,) = [r.message for r in caplog.records if "light_not_changed" in r.message]
        assert "out of memory" in line and "using=fast" in line
        assert drawing._renderer.interaction.choices.light == "fast"
        assert np.abs(await picture(drawing, 30) - before).mean() < 0.5

    played(play)
