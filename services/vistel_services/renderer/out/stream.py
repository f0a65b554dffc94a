"""A site's picture and sound for anybody with a browser: a page, and a WebSocket that feeds it (docs/how-to/watch-in-a-browser.md).

Text messages are JSON: "hello" first, "state" every second, "pong" for a page that compares clocks ("ping"); a page says "lost"
to go on with a key picture. Binary ones hold a kind, a time and a picture or sound (`stream_encoder.message`).
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
from datetime import datetime
from importlib import import_module, resources
from typing import TYPE_CHECKING

from prometheus_client import Counter, Gauge

from vistel.arrays import U8
from vistel.protocol.pages.words import words_of
from vistel.render.film.stream_encoder import SOUND, StreamEncoder, StreamPicture, message
from vistel.wire import background
from vistel.wire.clock import Clock
from vistel_services.renderer.out.stream_reader import Reader
from vistel_services.serving.address import PageAddress

if TYPE_CHECKING:
    from aiohttp import web

    from vistel_services.serving.server import PageServer

log = logging.getLogger("vistel.renderer")


_READERS = Gauge("vistel_renderer_stream_readers", "Browsers that watch", ["site"])
_LEFT_OUT = Counter("vistel_renderer_stream_left_out_total", "Pictures left out for slow readers", ["site"])

MOST_READERS = 16
_STATE_S = 1.0
_CLOSING_S = 0.3
_ENDED = 1001
"""What a page is told when the conference ends (RFC 6455 §7.4.1, "going away"), so that it can tell this from a loss."""
_MOST_SAID_BYTES = 4096
_SERVED = {"/": "index.html", "/watch.js": "watch.js", "/watch.css": "watch.css"}
_POLICY = "connect-src 'self'; img-src 'self' data:"


class Stream:
    """Serves on the running event loop. Nobody watching: nothing is encoded."""

    def __init__(self, site: str, address: PageAddress, size: tuple[int, int], rate: float, sound: bool, clock: Clock) -> None:
        """size: width and height of the pictures; rate: of them per second; sound: whether there will be any."""
        self._site, self.address, self._sound, self._clock = site, address, sound, clock
        self._loop = asyncio.get_running_loop()
        self._encoder = StreamEncoder(*size, rate, self._encoded)
        self._readers: set[Reader] = set()
        self._connections: set[web.WebSocketResponse] = set()
        self._server: PageServer | None = None
        self._stating: asyncio.Task[None] | None = None
        self._background = background.current()
        self._drawn = self._told_drawn = 0
        self._age_ns = 0

    async def open(self, now: datetime) -> None:
        """Serve; now: of this machine, for certificates. Raises OSError where the address cannot be used, CertificateError."""
        # Slow to load: the others are listened to meanwhile.
        await asyncio.to_thread(import_module, "vistel_services.serving.server")
        from vistel_services.serving.pages import PageFiles
        from vistel_services.serving.server import open_server

        files = PageFiles("stream", resources.files("vistel_services.renderer.out") / "page", _SERVED, _POLICY)
        more = {"/stream": self._watch}
        self._server = await open_server(self._site, files, self.address, more, self._clock, now)
        self.address = self._server.address
        self._stating = background.start(self._state(), "stream state")

    def put(self, t_ns: int, rgba: U8, age_ns: int) -> None:
        """A picture (h, w, 4) RGBA, first row at the bottom, drawn at `t_ns`, of motions then `age_ns` old. It is not changed."""
        self._drawn += 1
        self._age_ns = age_ns
        if self._readers:
            wants_key = any(r.wants_key and r.form == "h264" for r in self._readers)
            self._encoder.put(t_ns, rgba, {r.form for r in self._readers}, wants_key)

    def put_sound(self, t_ns: int, opus: bytes) -> None:
        """A frame of sound (an Opus packet of 20 ms, stereo) whose first sample is heard at `t_ns`."""
        if opus:
            for reader in self._readers:
                reader.play(message(SOUND, t_ns, opus))

    async def close(self) -> None:
        """Stop serving, and say so to readers."""
        if self._stating is not None:
            self._stating.cancel()
        ending = [background.start(c.close(code=_ENDED), "stream end") for c in self._connections]
        if ending:
            await asyncio.wait(ending, timeout=_CLOSING_S)
        if self._server is not None:
            await self._server.close()
        await asyncio.to_thread(self._encoder.close)

    def _encoded(self, form: str, picture: StreamPicture) -> None:
        """In the encoder's thread."""
        with contextlib.suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(self._show, form, picture)

    def _show(self, form: str, picture: StreamPicture) -> None:
        for reader in self._readers:
            if reader.form == form:
                before = reader.left_out
                reader.show(picture)
                if reader.left_out > before:
                    _LEFT_OUT.labels(self._site).inc(reader.left_out - before)

    async def _state(self) -> None:
        while True:
            await asyncio.sleep(_STATE_S)
            drawn = self._drawn - self._told_drawn
            self._told_drawn = self._drawn
            state = {
                "kind": "state",
                "rate": drawn / _STATE_S,
                "motion_age_ms": round(self._age_ns * 1e-6),
                "readers": len(self._readers),
            }
            for reader in self._readers:
                reader.put_text(json.dumps(state | {"left_out": reader.left_out}))

    async def _watch(self, request: web.Request) -> web.StreamResponse:
        from aiohttp import web

        from vistel_services.serving.server import prepared_socket

        if len(self._readers) >= MOST_READERS:
            raise web.HTTPServiceUnavailable(text=f"{MOST_READERS} are watching already\n")
        connection = await prepared_socket(request, _MOST_SAID_BYTES)
        reader = Reader("jpeg" if request.query.get("form") == "jpeg" else "h264")
        width, height = self._encoder.size
        hello = {"kind": "hello", "site": self._site, "width": width, "height": height, "sound": self._sound}
        reader.put_text(json.dumps(hello))
        self._readers.add(reader)
        self._connections.add(connection)
        _READERS.labels(self._site).set(len(self._readers))
        log.info("event=watched by=%s form=%s readers=%d", request.remote, reader.form, len(self._readers))
        sending = self._background.start(_send(connection, reader), "stream")
        try:
            async for said in connection:
                if said.type is web.WSMsgType.TEXT:
                    self._answer(reader, said.data)
        finally:
            sending.cancel()
            self._readers.discard(reader)
            self._connections.discard(connection)
            _READERS.labels(self._site).set(len(self._readers))
            log.info("event=watched_no_more by=%s left_out=%d readers=%d", request.remote, reader.left_out, len(self._readers))
        return connection

    def _answer(self, reader: Reader, text: str) -> None:
        """A page compares its clock with the conference's, or has lost its place."""
        said = words_of(text)
        ping = said.get("ping")
        if said.get("lost") is True:
            reader.lose()
        if isinstance(ping, int | float):
            reader.put_text(json.dumps({"kind": "pong", "ping": ping, "t_ms": self._clock.now_ns() * 1e-6}))


async def _send(connection: web.WebSocketResponse, reader: Reader) -> None:
    with contextlib.suppress(ConnectionError):
        while True:
            data = await reader.next()
            await (connection.send_str(data) if isinstance(data, str) else connection.send_bytes(data))
