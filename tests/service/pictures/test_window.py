"""A real window on an X server of its own: mouse and keyboard go in as X events, the world hears what was done with them."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from waiting import until
from world_site import CONFERENCE
from x_server import Hands, x_server

from vistel.conference.paths import RunPaths
from vistel.render.config import RenderConfig
from vistel.render.scene_renderer import SceneRenderer
from vistel.render.stage.signs import sign_of
from vistel.render.view.view import Mode, View
from vistel.space.things import props
from vistel.v1 import motion_pb2
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.motion import MotionEncoder, MotionSample
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener
from vistel_services import world
from vistel_services.renderer import drawing_thread, service
from vistel_services.renderer.out.outputs import Out
from vistel_services.renderer.window.window import Pane

pytestmark = pytest.mark.gl
WIDTH, HEIGHT = 640, 400


@pytest.fixture(autouse=True)
def _hours_of_silence_count_for_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a machine that stands still for half a second what a mouse leads would fall, and be taken up anew: two things to undo."""
    monkeypatch.setattr(props, "SILENT_NS", 10**13)


@pytest.fixture
def hands(monkeypatch: pytest.MonkeyPatch) -> Iterator[Hands]:
    with x_server(monkeypatch, WIDTH, HEIGHT) as somebody:
        yield somebody


class Conference:
    """The real world service and a renderer with a window, at one site; what the others hear."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.clock, self.network = SystemClock(), MemoryNetwork()
        self.world = replace(world.configure(CONFERENCE, None, RunPaths(folder / "run", folder)), folder=None)
        view = View(WIDTH, HEIGHT, "seat", "aiko", wrinkles=False, layers=False)
        sites = {"tokyo": ("aiko",), "paris": ("bruno",)}
        out = Out(film=folder / "tokyo.mp4")
        self.renderer = service.Config(
            "tokyo", RenderConfig(view, 3, 0.05), 60.0, out, (Pane("VISTEL tokyo", WIDTH, HEIGHT),), sites=sites
        )
        self.studio: SceneRenderer | None = None
        made = drawing_thread.SceneRenderer

        def keep(*args: Any, **kw: Any) -> SceneRenderer:
            self.studio = made(*args, **kw)
            return self.studio

        monkeypatch.setattr(drawing_thread, "SceneRenderer", keep)
        self.elsewhere = self.network.bus("demo", "paris", self.clock)
        self.room = WorldListener(self.elsewhere, self.clock)
        self.now: Any = None
        self.coming = deque[Any]()
        self.tasks: list[asyncio.Task[None]] = []

    async def send_people(self) -> None:
        bus = self.network.bus("demo", "tokyo", self.clock)
        bus.announce("process-capture")
        about = motion_pb2.Participant(participant="aiko", site="tokyo", avatar="builtin:no-such-setting=1", height_m=1.7)
        bus.publish(BY_NAME["participant"], participant="aiko").put(about)
        publication, encoder = bus.publish(BY_NAME["motion"], participant="aiko"), MotionEncoder()
        body = np.zeros(25)
        body[1] = math.pi / 2
        for k in range(1, 1_000_000):
            hands = np.full((2, 20), 0.2)
            publication.put(encoder.encode(MotionSample(k, self.clock.now_ns(), body, hands, np.array((0.0, 0.0, -0.55, 0.0)))))
            await asyncio.sleep(1 / 60)  # as a tracker does, in real time

    async def until(self, holds: Callable[[], bool], what: str) -> None:
        """Wait for it, however slow the machine is. Asks after each state of the room: on a busy machine several come at once."""

        def seen() -> bool:
            self.coming += [now for now, _ in self.room.take()]
            while self.coming:
                self.now = self.coming.popleft()
                if holds():
                    return True
            return holds()

        await until(seen, what, tasks=self.tasks)

    def at(self, thing: str) -> np.ndarray:
        return self.now.poses[thing][0]

    def pixel(self, thing: str) -> np.ndarray:
        """Where a thing is in the window."""
        assert self.studio is not None
        sight = self.studio._from[0]
        return sight.camera.project(self.at(thing)[None], WIDTH, HEIGHT)[0, :2]


def played(folder: Path, monkeypatch: pytest.MonkeyPatch, play: Callable[[Conference], Any]) -> None:
    async def whole() -> None:
        c = Conference(folder, monkeypatch)
        here = c.network.bus("demo", "tokyo", c.clock)
        c.tasks = [
            asyncio.create_task(c.send_people()),
            asyncio.create_task(world.run(c.world, c.network.bus("demo", "hub", c.clock), c.clock)),
            asyncio.create_task(service.run(c.renderer, here, c.clock)),
        ]
        try:
            await c.until(lambda: c.now is not None and "ball" in c.now.poses, "the room")
            await c.until(
                lambda: c.studio is not None and bool(c.studio._from) and bool(c.studio.interaction), "a picture in a window"
            )
            await c.until(lambda: "ball" in c.studio.interaction._known, "things to point at")
            await play(c)
        finally:
            for task in c.tasks:
                task.cancel()
            await asyncio.gather(*c.tasks, return_exceptions=True)

    asyncio.run(whole())


def test_a_thing_that_is_clicked_is_selected_and_one_that_is_drawn_goes_there_at_every_site(
    hands: Hands, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(c: Conference) -> None:
        interaction = c.studio.interaction
        x, y = c.pixel("ball")
        hands.move(x, y)
        await c.until(lambda: interaction._hit is not None and interaction._hit.thing == "ball", "the ball under the mouse")
        hands.button(1, True)
        hands.button(1, False)
        await c.until(lambda: dict(c.now.selected).get("aiko") == ("ball",), "the selection, at another site")
        began = c.at("ball").copy()
        hands.button(1, True)
        await c.until(lambda: interaction._dragging is not None, "the ball on the mouse")
        for k in range(1, 11):
            hands.move(x, y - 8 * k)
            await asyncio.sleep(0.03)  # a hand takes time
        await c.until(lambda: c.at("ball")[1] > began[1] + 0.08, "the ball in the air, at another site")
        up = c.at("ball").copy()
        depth = interaction._dragging.depth
        hands.wheel(2)
        await c.until(lambda: interaction._dragging.depth > depth, "the ball further off")
        hands.button(1, False)
        await c.until(lambda: interaction._dragging is None, "the ball off the mouse")
        await c.until(lambda: c.at("ball")[1] < up[1] - 0.04, "the ball fallen")

        hands.key("u", True)
        hands.key("u", False)
        await c.until(lambda: bool(np.allclose(c.at("ball"), began, atol=5e-3)), "the ball where it was before the drag")
        hands.key("y", True)
        hands.key("y", False)
        await c.until(lambda: c.at("ball")[1] > began[1] + 0.08, "the drag done again")

    played(tmp_path, monkeypatch, play)


def test_a_hand_is_raised_and_a_reaction_given_by_key_at_every_site(
    hands: Hands, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(c: Conference) -> None:
        hands.move(200, 200)
        await c.until(lambda: "aiko" in c.now.participants, "aiko in the room")
        hands.key("r", True)
        hands.key("r", False)
        await c.until(lambda: sign_of(c.now.signals, "aiko") == "hand up 1", "her hand, at another site")
        for name, down in (("Shift_L", True), ("2", True), ("2", False), ("Shift_L", False)):
            hands.key(name, down)
        await c.until(lambda: sign_of(c.now.signals, "aiko") == "hand up 1 · claps", "she claps, at another site")

    played(tmp_path, monkeypatch, play)


def test_keys_and_mouse_look_about_and_walk_and_film(hands: Hands, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(c: Conference) -> None:
        interaction = c.studio.interaction
        seat = c.studio._from[0].camera.position.copy()
        hands.move(200, 200)
        hands.key("w", True)
        await c.until(lambda: interaction.choices.mode is Mode.FREE, "a walk")
        await c.until(lambda: np.linalg.norm(c.studio._from[0].camera.position - seat) > 0.1, "some way")
        hands.key("w", False)
        before = c.studio._from[0].camera.rotation.copy()
        hands.button(3, True)
        for k in range(1, 6):
            hands.move(200 + 12 * k, 200)
            await asyncio.sleep(0.03)  # a hand takes time
        hands.button(3, False)
        await c.until(lambda: float((before[:, 2] * c.studio._from[0].camera.rotation[:, 2]).sum()) < 0.97, "another direction")
        hands.key("1", True)
        hands.key("1", False)
        await c.until(lambda: np.linalg.norm(c.studio._from[0].camera.position - seat) < 0.05, "the seat again")
        hands.key("3", True)
        hands.key("3", False)
        await c.until(lambda: interaction.choices.mode is Mode.ROOM and c.studio._inside == "", "the overview")
        hands.key("f", True)
        hands.key("f", False)
        await c.until(lambda: c.studio._inside == "aiko" and interaction.choices.mode is Mode.FOLLOW, "somebody's eyes")
        for film in ("tokyo.mp4", ""):
            hands.key("F9", True)
            hands.key("F9", False)
            await c.until(lambda film=film: interaction.status.film == film, "a film, and its end")

    played(tmp_path, monkeypatch, play)
    assert (tmp_path / "tokyo.mp4").stat().st_size > 0
