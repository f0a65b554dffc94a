"""A scene renderer in a thread of its own; made again when drawing fails: a graphics card lost, a window closed."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from prometheus_client import Gauge

from vistel.conference.model import RoomConfig as RoomKeys
from vistel.conference.running import running_folder
from vistel.render.figures.figures import DrawableFigure
from vistel.render.gl.context import NoOpenGlError
from vistel.render.interaction.navigation import Deflection
from vistel.render.interaction.requests import DrawingRequest, Request
from vistel.render.interaction.status import ConferenceStatus
from vistel.render.interaction.window_interaction import WindowInteraction
from vistel.render.preparation import decor_of
from vistel.render.resolution import Resolution
from vistel.render.scene_renderer import SceneRenderer
from vistel.render.stage.stage import Instant, ParticipantInfo
from vistel.render.turns import DrawingTurn, places_here
from vistel.render.view.view import View
from vistel.space.files.faults import RoomFileError
from vistel.space.files.interior import Interior
from vistel.space.files.model import Polymesh
from vistel.wire.clock import Clock
from vistel_services.renderer.window.presenter import DesktopWindows
from vistel_services.renderer.window.window import Pane

log = logging.getLogger("vistel.renderer")

_SCALE = Gauge("vistel_renderer_resolution_ratio", "Drawn part of the picture's width and height", ["site"])

RETRY_NS = 2_000_000_000
"""After how long drawing is tried again when it failed [ns]."""
NO_GL_RETRY_NS = 30_000_000_000
"""The same when there is no OpenGL at all [ns]."""


class DrawingThread:
    """Draws `view` of a room of `seats` at `site`, in `thread`. rate: of pictures a second at most; room: what the conference
    file says of it, where files hold some of it; whole: every pixel is drawn; load: makes figures; models: what things look
    like, filled with those of this site's files; panes: the windows that show the pictures, none for no window."""

    def __init__(
        self,
        site: str,
        view: View,
        rate: float,
        seats: int,
        room: RoomKeys | None,
        whole: bool,
        load: Callable[[ParticipantInfo], DrawableFigure],
        thread: ThreadPoolExecutor,
        models: dict[str, Polymesh],
        panes: Sequence[Pane] = (),
    ) -> None:
        self._site, self._view, self._rate, self._seats, self._room = site, view, rate, seats, room
        self._load, self._thread, self._models, self._panes = load, thread, models, panes
        self._resolution = None if whole else Resolution(rate, view.height)
        self._renderer: SceneRenderer | None = None
        self._turn = DrawingTurn(running_folder(), places_here())
        self._began_ns: int | None = None
        self._retry_ns = self._now_ns = 0
        self._requests: list[Request] = []
        self._set: WindowInteraction | None = None
        self.deflection = Deflection()
        """How the 3D mouse is pushed."""
        self.status = ConferenceStatus()
        """What the window shows beside its picture."""

    def requests(self) -> list[Request]:
        """What somebody at the window has asked for since the last call."""
        out, self._requests = self._requests, []
        return out

    async def take_turn(self, clock: Clock) -> None:
        """Wait until this machine's cores have time for a picture, where they draw; `draw` gives the turn back. What the picture
        shows is better received afterwards."""
        self._began_ns = time.perf_counter_ns()
        if self._renderer is not None and self._renderer.capability.software:
            await self._turn.begin(clock)

    async def draw(self, sampled: Callable[[], Instant]) -> NDArray[np.uint8] | None:
        """The picture, or None when there is none this time: after a failure, until the time of the next attempt. sampled: gives
        the newest instant; it is called on the drawing thread, when nothing is left to wait for."""
        if self._began_ns is None:
            self._began_ns = time.perf_counter_ns()
        try:
            return await self._call(self._draw, sampled)
        except NoOpenGlError as e:
            log.error("event=no_picture reason=%r retry_s=%.0f", str(e), NO_GL_RETRY_NS * 1e-9)
            self._retry_ns = self._now_ns + NO_GL_RETRY_NS
        except Exception:
            log.exception("event=drawing_failed action=set_up_again wait_s=%.0f", RETRY_NS * 1e-9)
            self._retry_ns = self._now_ns + RETRY_NS
            await self._call(self._give_up)
        finally:
            self._turn.end()
            self._began_ns = None
        return None

    @property
    def furnished(self) -> bool:
        """What this site's files hold of the room is there."""
        return self._renderer is not None

    @property
    def stand_ins(self) -> int:
        """Figures whose own avatar is not there yet."""
        return self._renderer.stand_ins if self._renderer is not None else 0

    async def close(self) -> None:
        if self._renderer is not None:
            renderer, self._renderer = self._renderer, None
            await self._call(renderer.close)
        self._turn.close()

    def _give_up(self) -> None:
        """Leave what cannot draw any more: its windows go, what was set at them stays."""
        renderer, self._renderer = self._renderer, None
        if renderer is None:
            return
        if (interaction := _interaction(renderer)) is not None:
            interaction.leave()
            self._requests += [request for request in interaction.requests() if not isinstance(request, DrawingRequest)]
            self._set = interaction
        with contextlib.suppress(Exception):  # of a context that is gone, nothing can be given back
            renderer.close()

    async def _call(self, function: Any, *args: Any) -> Any:
        return await asyncio.get_running_loop().run_in_executor(self._thread, function, *args)

    def _decor(self) -> Interior | None:
        """The room where it is from files; those that cannot be used are logged, and the built-in one is drawn."""
        if self._room is None:
            return None
        try:
            decor = decor_of(self._room)
            self._models.update(decor.models)
            return decor
        except RoomFileError as e:
            log.error("event=room_file_not_used reason=%r shown=built-in", str(e))
            return None

    def _draw(self, sampled: Callable[[], Instant]) -> NDArray[np.uint8] | None:
        instant = sampled()
        self._now_ns = instant.now_ns
        if self._now_ns < self._retry_ns:
            return None
        if self._renderer is None:
            # Setting up takes a while: the instant is old when it is done, the next one is drawn.
            began = time.perf_counter()
            windows = DesktopWindows(self._view, self._panes, f"VISTEL {self._site}") if self._panes else None
            self._renderer = SceneRenderer(self._view, self._seats, self._load, self._decor(), self._models, windows)
            if (interaction := _interaction(self._renderer)) is not None and self._set is not None:
                interaction.go_on(self._set)
            found = self._renderer.capability
            log.info(
                "event=drawing_with renderer=%r version=%d software=%s window=%s size=%dx%d setup_ms=%.0f",
                found.renderer,
                found.version,
                found.software,
                found.window,
                self._view.width,
                self._view.height,
                (time.perf_counter() - began) * 1e3,
            )
            return None
        interaction = _interaction(self._renderer)
        if interaction is not None:
            interaction.status, interaction.deflection = self.status, self.deflection
        picture = self._renderer.render(instant)
        if self._resolution is not None and self._renderer.complete:
            now_ns = time.perf_counter_ns()
            self._follow(self._renderer, self._resolution, now_ns, now_ns - (self._began_ns or now_ns))
        if interaction is not None:
            self._apply(self._renderer, interaction)
        if self._renderer is None:
            return picture
        if self._renderer.closed_by_user:
            log.info("event=window_closed using=headless")
            self._give_up()
            self._panes = ()
        return picture

    def _apply(self, renderer: SceneRenderer, interaction: WindowInteraction) -> None:
        """Do what somebody at the window wants of the picture; keep the other requests."""
        for request in interaction.requests():
            if not isinstance(request, DrawingRequest):
                self._requests.append(request)
                continue
            if request.scale is not None:
                self._resolution = None if request.scale else Resolution(self._rate, self._view.height)
                renderer.draw_at(request.scale or 1.0)
            if request.light is not None:
                self._light(renderer, interaction, request.light)

    def _light(self, renderer: SceneRenderer, interaction: WindowInteraction, light: str) -> None:
        """Draw in another light; where that cannot be set up, as before."""
        began = time.perf_counter()
        try:
            renderer.relight(light)
        except Exception as e:
            now = "fine" if renderer.painter.fine else "fast"
            log.warning("event=light_not_changed wanted=%s reason=%r using=%s", light, str(e), now)
            interaction.choices = replace(interaction.choices, light=now)
            return
        self._view = replace(self._view, light=light)
        log.info("event=light now=%s setup_ms=%.0f", light, (time.perf_counter() - began) * 1e3)

    def _follow(self, renderer: SceneRenderer, resolution: Resolution, now_ns: int, took_ns: int) -> None:
        """As many pixels as there is time for. took_ns: for the picture and the wait for its turn."""
        before = resolution.scale
        scale = resolution.drew(now_ns, took_ns)
        if scale != before:
            renderer.draw_at(scale)
            _SCALE.labels(self._site).set(scale)
            log.info("event=resolution scale=%.2f took_ms=%.0f", scale, took_ns * 1e-6)


def _interaction(renderer: SceneRenderer) -> WindowInteraction | None:
    """What somebody does at the windows (`DesktopWindows.interaction` makes nothing else); None without any."""
    return renderer.interaction if isinstance(renderer.interaction, WindowInteraction) else None
