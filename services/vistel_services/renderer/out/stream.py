"""A site's picture and sound for anybody with a browser: a page, and a WebSocket that feeds it (docs/how-to/watch-in-a-browser.md).

Text messages are JSON: "hello" first, "state" every second, "pong" for a page that compares clocks ("ping"); a page says "lost"
to go on with a key picture. Binary ones hold a kind, a time and a picture or sound (`stream_encoder.message`).
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import socket
from dataclasses import replace
from datetime import datetime
from importlib import import_module
from typing import TYPE_CHECKING

from prometheus_client import Counter, Gauge

from vistel.arrays import U8
from vistel.wire import background
from vistel.wire.clock import Clock
from vistel_services.renderer.out.stream_address import StreamAddress, with_certificate
from vistel_services.renderer.out.stream_encoder import SOUND, StreamEncoder, message
from vistel_services.renderer.out.stream_reader import Reader, StreamPicture

if TYPE_CHECKING:
    from aiohttp import web

    from vistel_services.renderer.out.stream_pages import StreamPages

log = logging.getLogger("vistel.renderer")


_READERS = Gauge("vistel_renderer_stream_readers", "Browsers that watch", ["site"])
_LEFT_OUT = Counter("vistel_renderer_stream_left_out_total", "Pictures left out for slow readers", ["site"])

MOST_READERS = 16
_STATE_S = 1.0
_SILENT_S = 15.0
"""A reader that has not answered for so long is gone."""
_CLOSING_S = 0.3
_ENDED = 1001
"""What a page is told when the conference ends (RFC 6455 §7.4.1, "going away"), so that it can tell this from a loss."""
_SEND_BUFFER = 1 << 18
"""Of the system, for each reader: what waits there is late."""
_MOST_FORM_BYTES = 4096


class Stream:
    """Serves on the running event loop. Nobody watching: nothing is encoded."""

    def __init__(self, site: str, address: StreamAddress, size: tuple[int, int], rate: float, sound: bool, clock: Clock) -> None:
        """size: width and height of the pictures; rate: of them per second; sound: whether there will be any."""
        self._site, self.address, self._sound, self._clock = site, address, sound, clock
        self._loop = asyncio.get_running_loop()
        self._encoder = StreamEncoder(*size, rate, self._encoded)
        self._readers: set[Reader] = set()
        self._connections: set[web.WebSocketResponse] = set()
        self._runner: web.AppRunner | None = None
        self._stating: asyncio.Task[None] | None = None
        self._background = background.current()
        self._pages: StreamPages | None = None
        self._drawn = self._told_drawn = 0
        self._age_ns = 0

    async def open(self, now: datetime) -> None:
        """Serve; now: of this machine, for certificates. Raises OSError where the address cannot be used, CertificateError."""
        # Slow to load: the others are listened to meanwhile.
        await asyncio.to_thread(import_module, "vistel_services.renderer.out.stream_pages")
        from aiohttp import web  # few sites stream

        from vistel_services.renderer.out.stream_pages import SERVED, StreamPages

        address = with_certificate(self.address, self._site, now)
        tls, names, shown = None, frozenset[str](), ""
        if address.certificate is not None:
            from vistel.wire.certificates.authority import read_certificate
            from vistel.wire.certificates.server import fingerprint, names_of, server_tls

            tls, certificate = server_tls(address.certificate), read_certificate(address.certificate.certificate)
            names, shown = names_of(certificate), fingerprint(certificate)
        pages = self._pages = StreamPages(address, names, self._clock)
        app = web.Application(client_max_size=_MOST_FORM_BYTES)
        for path in SERVED:
            app.router.add_get(path, pages.page)
        app.router.add_post("/", pages.enter)
        app.router.add_get("/stream", self._watch)
        runner = self._runner = web.AppRunner(app, access_log=None, shutdown_timeout=_CLOSING_S)
        await runner.setup()
        await web.TCPSite(runner, address.host, address.port, ssl_context=tls).start()
        host, port = runner.addresses[0][:2]
        pages.address = self.address = replace(address, host=str(host), port=int(port))
        self._stating = background.start(self._state(), "stream state")
        reach = "this_machine" if self.address.local else "network"
        log.info("event=streaming address=%s reach=%s sha256=%s", self.address.url, reach, shown)
        if tls is None and not self.address.local:
            log.warning("event=stream_insecure address=%s reason='plain HTTP beyond this machine is meant'", self.address.url)

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
        if self._runner is not None:
            await self._runner.cleanup()
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

        if self._pages is not None:
            self._pages.check_place(request)
            self._pages.check_token(request)
        if len(self._readers) >= MOST_READERS:
            raise web.HTTPServiceUnavailable(text=f"{MOST_READERS} are watching already\n")
        socket_of = request.transport.get_extra_info("socket") if request.transport else None
        if socket_of is not None:
            socket_of.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
        connection = web.WebSocketResponse(heartbeat=_SILENT_S, compress=False, max_msg_size=4096)
        await connection.prepare(request)
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
        try:
            said = json.loads(text)
            ping = said.get("ping")
        except (ValueError, AttributeError, RecursionError):
            return
        if said.get("lost") is True:
            reader.lose()
        if isinstance(ping, int | float):
            reader.put_text(json.dumps({"kind": "pong", "ping": ping, "t_ms": self._clock.now_ns() * 1e-6}))


async def _send(connection: web.WebSocketResponse, reader: Reader) -> None:
    with contextlib.suppress(ConnectionError):
        while True:
            data = await reader.next()
            await (connection.send_str(data) if isinstance(data, str) else connection.send_bytes(data))
