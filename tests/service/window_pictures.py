"""A drawing thread with a real window, and pictures of the room one after the other."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np

from vistel.figure.posture.posture import Posture
from vistel.geometry.pose import Pose
from vistel.render.figures.figures import DrawableFigure, StandIn
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.view import View
from vistel.space.room import meeting_room
from vistel_services.renderer.drawing_thread import DrawingThread
from vistel_services.renderer.window.window import Pane

LOOSE = {t.id: t for t in meeting_room(3).things if not t.fixed}
WIDTH, HEIGHT = 480, 300


def shapes(about: ParticipantInfo) -> DrawableFigure:
    """Nobody has an avatar of their own."""
    return StandIn(about.height)


class Pictures:
    """A drawing thread with a window, and pictures of the room one after the other."""

    def __init__(self, thread: ThreadPoolExecutor, view: View) -> None:
        self.drawing = DrawingThread("tokyo", view, 30.0, 3, None, True, shapes, thread, {}, [Pane("w", WIDTH, HEIGHT)])
        self.n = 0
        self.people: dict[str, Posture] = {}
        self.places: dict[str, np.ndarray] = {}

    async def draw(self, times: int = 1, without: str = "") -> np.ndarray | None:
        drawn = None
        for _ in range(times):
            self.n += 1
            things = {name: t for name, t in LOOSE.items() if name != without}
            world = PlayoutWorld(self.n, {name: Pose(self.places.get(name, t.position), t.rotation) for name, t in things.items()})
            people = tuple(PersonNow(ParticipantInfo(name, name), p, Timing(0, 0, 0, False)) for name, p in self.people.items())
            drawn = await self.drawing.draw(partial(Instant, self.n * 33_000_000, people, world, things))
        return drawn

    async def until(self, holds: Callable[[], bool], what: str) -> None:
        await self.draw()
        while not holds():
            await asyncio.sleep(0.01)  # the bus is read in real time
            await self.draw()

    @property
    def window(self) -> Any:
        return self.drawing._renderer._surface.window.window

    @property
    def interaction(self) -> Any:
        return self.drawing._renderer.interaction

    def at(self, thing: str) -> np.ndarray:
        (sight,) = self.drawing._renderer._from
        return sight.camera.project(LOOSE[thing].position[None], WIDTH, HEIGHT)[0, :2]


WINDOW = View(WIDTH, HEIGHT, "room", "aiko", light="fast")


def played(play: Callable[[Pictures], Awaitable[None]], view: View = WINDOW) -> None:
    """Set the drawing thread up, draw, play, and take it down."""

    async def whole() -> None:
        thread = ThreadPoolExecutor(1)
        pictures = Pictures(thread, view)
        try:
            await pictures.draw(3)
            pictures.drawing._renderer._smoothing.result()
            await play(pictures)
        finally:
            await pictures.drawing.close()
            thread.shutdown()

    asyncio.run(whole())
