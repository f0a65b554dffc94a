"""An easel with a real window, and pictures of the room one after the other."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from vistel.figure.posture.posture import Posture
from vistel.geometry.pose import Pose
from vistel.space.room import meeting_room
from vistel_services.renderer.easel import Easel
from vistel_services.renderer.figures import Shape, StandIn
from vistel_services.renderer.playout import Timing
from vistel_services.renderer.stage import About, Instant, PersonNow
from vistel_services.renderer.view import View
from vistel_services.renderer.world_view import WorldView

LOOSE = {t.id: t for t in meeting_room(3).things if not t.fixed}
WIDTH, HEIGHT = 480, 300


def shapes(about: About) -> Shape:
    """Nobody has an avatar of their own."""
    return StandIn(about.height)


class Pictures:
    """An easel with a window, and pictures of the room one after the other."""

    def __init__(self, thread: ThreadPoolExecutor, view: View) -> None:
        self.easel = Easel("tokyo", view, 30.0, 3, None, True, shapes, thread, {})
        self.n = 0
        self.people: dict[str, Posture] = {}
        self.places: dict[str, np.ndarray] = {}

    async def draw(self, times: int = 1, without: str = "") -> np.ndarray | None:
        drawn = None
        for _ in range(times):
            self.n += 1
            things = {name: t for name, t in LOOSE.items() if name != without}
            world = WorldView(self.n, {name: Pose(self.places.get(name, t.position), t.rotation) for name, t in things.items()})
            people = tuple(PersonNow(About(name, name), p, Timing(0, 0, 0, False)) for name, p in self.people.items())
            drawn = await self.easel.draw(Instant(self.n * 33_000_000, people, world, things))
        return drawn

    async def until(self, holds: Callable[[], bool], what: str) -> None:
        await self.draw()
        while not holds():
            await asyncio.sleep(0.01)  # the bus is read in real time
            await self.draw()

    @property
    def window(self) -> Any:
        return self.easel._studio._surface.window

    @property
    def desk(self) -> Any:
        return self.easel._studio.desk

    def at(self, thing: str) -> np.ndarray:
        (sight,) = self.easel._studio._from
        return sight.camera.project(LOOSE[thing].position[None], WIDTH, HEIGHT)[0, :2]


WINDOW = View(WIDTH, HEIGHT, "room", "aiko", True, light="fast")


def played(play: Callable[[Pictures], Awaitable[None]], view: View = WINDOW) -> None:
    """Set the easel up, draw, play, and take it down."""

    async def whole() -> None:
        thread = ThreadPoolExecutor(1)
        pictures = Pictures(thread, view)
        try:
            await pictures.draw(3)
            pictures.easel._studio._smoothing.result()
            await play(pictures)
        finally:
            await pictures.easel.close()
            thread.shutdown()

    asyncio.run(whole())
