"""The light is changed at a real window: the picture changes, the window stays."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from x_server import Hands, x_server

from vistel.figure.posture.posture import standing
from vistel.geometry.pose import Pose
from vistel.space.room import meeting_room
from vistel_services.renderer import studio as studios
from vistel_services.renderer.draw import Painter
from vistel_services.renderer.easel import Easel
from vistel_services.renderer.figures import Shape, StandIn
from vistel_services.renderer.playout import Timing
from vistel_services.renderer.stage import About, Instant, PersonNow
from vistel_services.renderer.view import View
from vistel_services.renderer.world_view import WorldView

pytestmark = pytest.mark.gl
ROOM = meeting_room(3)
LOOSE = {t.id: t for t in ROOM.things if not t.fixed}
ABOUT = About("aiko", "Aiko")


@pytest.fixture
def hands(monkeypatch: pytest.MonkeyPatch) -> Iterator[Hands]:
    with x_server(monkeypatch, 320, 200) as somebody:
        yield somebody


def shapes(about: About) -> Shape:
    return StandIn(about.height)


def instant(n: int, *, people: bool = True, without: str = "") -> Instant:
    things = {name: t for name, t in LOOSE.items() if name != without}
    world = WorldView(n, {name: Pose(t.position, t.rotation) for name, t in things.items()})
    somebody = (PersonNow(ABOUT, standing(), Timing(0, 0, 0, False)),) if people else ()
    return Instant(n * 33_000_000, somebody, world, things)


def played(play: Callable[[Easel], Awaitable[None]]) -> None:
    async def whole() -> None:
        thread = ThreadPoolExecutor(1)
        easel = Easel("tokyo", View(160, 100, "room", "", True, light="fast"), 30.0, 3, None, True, shapes, thread, {})
        try:
            await easel.draw(instant(1))
            assert easel._studio is not None
            easel._studio._smoothing.result()
            await play(easel)
        finally:
            await easel.close()
            thread.shutdown()

    asyncio.run(whole())


async def picture(easel: Easel, n: int, **how: Any) -> np.ndarray:
    """The third of three, when shadows are there."""
    for k in range(3):
        drawn = await easel.draw(instant(n + k, **how))
    assert drawn is not None
    return drawn[..., :3].astype(float)


async def lit(easel: Easel, light: str, n: int) -> None:
    """Somebody chooses a light in the panel."""
    desk = easel._studio.desk
    desk._chosen(replace(desk.choices, light=light))
    await easel.draw(instant(n))


def windows(hands: Hands) -> list[int]:
    return [w.id for w in hands._display.screen().root.query_tree().children]


def test_the_light_changes_to_and_fro_in_one_window(hands: Hands, caplog: pytest.LogCaptureFixture) -> None:
    async def play(easel: Easel) -> None:
        studio = easel._studio
        fast = await picture(easel, 10)
        there, context, desk = windows(hands), studio.painter.ctx, studio.desk
        with caplog.at_level(logging.INFO, "vistel.renderer"):
            await lit(easel, "fine", 20)
        assert easel._studio is studio and studio.painter.fine
        fine = await picture(easel, 30)
        assert np.abs(fine - fast).mean() > 2.0
        painter = studio.painter
        await lit(easel, "fast", 40)
        assert np.abs(await picture(easel, 50) - fast).mean() < 0.5
        await easel._call(studio.draw_at, 0.5)
        await lit(easel, "fine", 60)
        assert studio.painter is painter  # made once
        assert painter.size == (80, 50)
        await easel._call(studio.draw_at, 1.0)
        assert np.abs(await picture(easel, 70) - fine).mean() < 0.5
        assert (windows(hands), studio.painter.ctx, studio.desk) == (there, context, desk)
        assert hands.screen().any() and studio.painter.error() == "GL_NO_ERROR"
        assert desk.choices.light == "fine"
        assert len([r for r in caplog.records if "event=light now=fine setup_ms=" in r.message]) == 1
        assert not any("drawing_with" in r.message for r in caplog.records)

    played(play)


def test_who_and_what_goes_while_another_light_is_on_is_gone_in_this_one_too(hands: Hands) -> None:
    async def play(easel: Easel) -> None:
        empty = await picture(easel, 10, people=False, without="ball")
        whole = await picture(easel, 20)
        assert np.abs(whole - empty).max() > 30
        await lit(easel, "fine", 30)
        await picture(easel, 40)
        await picture(easel, 50, people=False, without="ball")
        desk = easel._studio.desk
        desk._chosen(replace(desk.choices, light="fast"))
        for k in range(60, 64):
            drawn = await easel.draw(instant(k, people=False, without="ball"))
        assert np.abs(drawn[..., :3] - empty).mean() < 0.5
        assert not easel._studio.painter._figures._figures

    played(play)


def test_light_that_cannot_be_set_up_is_told_in_one_line_and_the_picture_goes_on(
    hands: Hands, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: Any) -> Painter:
        raise RuntimeError("out of memory")

    async def play(easel: Easel) -> None:
        before = await picture(easel, 10)
        monkeypatch.setattr(studios, "Painter", none)
        with caplog.at_level(logging.WARNING, "vistel.renderer"):
            await lit(easel, "fine", 20)
        (line,) = [r.message for r in caplog.records if "light_not_changed" in r.message]
        assert "out of memory" in line and "using=fast" in line
        assert easel._studio.desk.choices.light == "fast"
        assert np.abs(await picture(easel, 30) - before).mean() < 0.5

    played(play)
