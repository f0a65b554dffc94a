"""One stream of the room for all who watch. Nobody watching: nothing is received and nothing is made."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
from collections.abc import Generator
from importlib import import_module
from typing import TYPE_CHECKING

from aiohttp import web
from prometheus_client import Counter, Gauge

from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.conference.running import studio_here
from vistel.session.chat import Chat
from vistel.session.steering.page import Steering
from vistel.wire import background, motion
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.link.arrivals import Arrivals
from vistel_services.console.viewer import FRAME, Viewer
from vistel_services.serving.pages import STEERS
from vistel_services.serving.server import CLOSING_S, prepared_socket

if TYPE_CHECKING:
    from vistel_services.console.feed import Feed

log = logging.getLogger("vistel.console")

_VIEWERS = Gauge("vistel_console_viewers_count", "Browsers that watch the console")
_SENT = Counter("vistel_console_sent_bytes_total", "Bytes sent to viewers of the console")
_REFUSED = Counter("vistel_console_steering_refused_total", "Messages of viewers who may not steer")
_LEFT_OUT = Counter("vistel_console_left_out_total", "Frames left out for viewers of the console that are slow")

MOST_VIEWERS = 100
RATE_HZ = 30.0
"""Frames per second."""
_NUMBERS_NS = 1_000_000_000
_LINGER_NS = 5_000_000_000
"""The room is followed so long after the last viewer has left: who loads the page again finds it there."""
_ENDED = 1001
"""What a page is told when the conference ends (RFC 6455 §7.4.1, "going away"), so that it can tell this from a loss."""
_MOST_SAID_BYTES = 4096
HEAR = "hear"
"""What a page says that wants voices; with anything else it wants them no more."""
_FOR_EVER = "private, max-age=31536000, immutable"


class Gateway:
    """Lives on the event loop."""

    def __init__(self, conference: Conference, paths: RunPaths, bus: Bus, clock: Clock) -> None:
        self._conference, self._bus, self._clock, self._paths = conference, bus, clock, paths
        self._steering = Steering(conference, paths, bus, clock)
        self._chat = Chat(bus)  # from the beginning: who comes later reads what was written before
        self._viewers: set[Viewer] = set()
        self._connections: set[web.WebSocketResponse] = set()
        self._somebody = asyncio.Event()
        self._feed: Feed | None = None
        self._background = background.current()

    async def run(self) -> None:
        """Make frames while somebody watches, until cancelled."""
        await asyncio.to_thread(_load)
        while True:
            await self._somebody.wait()
            await self._watched()

    async def _watched(self) -> None:
        from vistel.session.going.numbers import Numbers
        from vistel_services.console.feed import Feed

        clock, period_ns = self._clock, round(1e9 / RATE_HZ)
        arrivals = Arrivals(self._bus)
        feed = self._feed = Feed(self._conference, arrivals.bus, clock, self._chat)
        numbers = Numbers(self._conference, arrivals)
        try:
            due_ns = told_ns = clock.now_ns()
            left_ns = due_ns
            while self._viewers or clock.now_ns() - left_ns < _LINGER_NS:
                left_ns = clock.now_ns() if self._viewers else left_ns
                numbers.take()
                instant, frame, messages = feed.step(clock.now_ns(), heard=any(viewer.hears for viewer in self._viewers))
                if instant.now_ns - told_ns >= _NUMBERS_NS:
                    told_ns = instant.now_ns
                    now = numbers.now(instant.now_ns, instant.people)
                    messages.append(("numbers", json.dumps(now | {"kind": "numbers", "viewers": len(self._viewers)})))
                spoken, screens = feed.voices(instant), feed.screens.take()
                for viewer in self._viewers:
                    viewer.put_voices(spoken)
                    viewer.put_screens(screens)
                    for kind, words in messages:
                        viewer.put(kind, words)
                    viewer.put(FRAME, frame)
                due_ns = max(due_ns + period_ns, clock.now_ns() - period_ns // 4)
                await clock.sleep_until_ns(due_ns)
        finally:
            self._feed = None
            feed.close()
            numbers.close()

    async def watch(self, request: web.Request) -> web.StreamResponse:
        """A viewer's WebSocket."""
        if len(self._viewers) >= MOST_VIEWERS:
            raise web.HTTPServiceUnavailable(text=f"{MOST_VIEWERS} are watching already\n")
        connection = await prepared_socket(request, _MOST_SAID_BYTES)
        viewer = Viewer(steers=request.get(STEERS, False))
        steered = self._steering.page(viewer.put, request.remote or "", steers=viewer.steers)
        with self.viewing(connection, viewer), steered as take:
            async for received in connection:  # JSON of what steers, "hear" or anything else; how much it may be is limited
                if isinstance(received.data, str) and received.data.startswith("{"):
                    _REFUSED.inc(not take(received.data))
                else:
                    viewer.hears = received.data == HEAR
        return connection

    @contextlib.contextmanager
    def viewing(self, connection: web.WebSocketResponse, viewer: Viewer) -> Generator[None]:
        """While entered, the room is sent there."""
        hello = {"kind": "hello", "conference": self._conference.name, "recorded": bool(self._paths.logs), "steers": viewer.steers}
        viewer.put("hello", json.dumps(hello | {"studio": studio_here() if viewer.steers else ""}))
        self._viewers.add(viewer)
        self._connections.add(connection)
        self._somebody.set()
        if self._feed is not None:
            self._feed.tell_all()
        _VIEWERS.set(len(self._viewers))
        log.info("event=watched viewers=%d", len(self._viewers))
        sending = self._background.start(send(connection, viewer), "console viewer")
        try:
            yield
        finally:
            sending.cancel()
            self._viewers.discard(viewer)
            self._connections.discard(connection)
            if not self._viewers:
                self._somebody.clear()
            _VIEWERS.set(len(self._viewers))
            _LEFT_OUT.inc(viewer.left_out)
            log.info("event=watched_no_more left_out=%d viewers=%d", viewer.left_out, len(self._viewers))

    def file(self, digest: str) -> bytes | None:
        """A GLB file of the room."""
        return self._feed.file(digest) if self._feed is not None else None

    def shows_live(self, participant: str) -> bool:
        """Whether a panel shows somebody's screen while it comes."""
        return self._feed is not None and participant in self._feed.stage.live

    async def close(self) -> None:
        """Tell viewers that the conference ends."""
        self._chat.close()
        self._steering.close()
        ending = [background.start(c.close(code=_ENDED), "console end") for c in self._connections]
        if ending:
            await asyncio.wait(ending, timeout=CLOSING_S)


def glb(data: bytes | None) -> web.Response:
    """A GLB file that never changes; raises 404 for None."""
    if data is None:
        raise web.HTTPNotFound(text="no such file\n")
    headers = {"Cache-Control": _FOR_EVER, "X-Content-Type-Options": "nosniff"}
    return web.Response(body=data, content_type="model/gltf-binary", headers=headers)


def _load() -> None:
    """What is slow to load, beside the rest of a start: who comes first waits for it no more."""
    import_module("vistel_services.console.feed")
    import_module("vistel.session.going.numbers")
    motion.warm_up()


async def send(connection: web.WebSocketResponse, viewer: Viewer) -> None:
    """What waits for a viewer, until cancelled."""
    with contextlib.suppress(ConnectionError):
        while True:
            data = await viewer.next()
            await (connection.send_str(data) if isinstance(data, str) else connection.send_bytes(data))
            _SENT.inc(len(data))
