"""A stream on a real socket: a browser shows what is drawn, and readers that misbehave cost the renderer nothing."""

from __future__ import annotations

import asyncio
import contextlib
import re
import socket
import time
from collections.abc import AsyncIterator
from datetime import UTC, datetime
from pathlib import Path

import aiohttp
import cv2
import numpy as np
import pytest
from browser import page

from vistel.wire.clock import SystemClock
from vistel_services.renderer.out.stream import MOST_READERS, Stream
from vistel_services.serving import server
from vistel_services.serving.address import PageAddress

WIDTH, HEIGHT, RATE = 640, 360, 25.0
LOCAL = PageAddress("127.0.0.1", 0)


def drawn(k: int) -> np.ndarray:
    """A picture whose quarters are red, green, blue and a grey that moves, (h, w, 4), first row at the bottom."""
    out = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
    out[:180, :320, 0], out[:180, 320:, 1], out[180:, :320, 2] = 200, 160, 220
    out[180:, 320:, :3] = 60 + k % 100
    return out


def noise(seed: int) -> np.ndarray:
    """A picture that needs many bytes."""
    return np.random.default_rng(seed).integers(0, 255, (HEIGHT, WIDTH, 4), np.uint8)


@contextlib.asynccontextmanager
async def streaming(address: PageAddress = LOCAL, sound: bool = False) -> AsyncIterator[Stream]:
    stream = Stream("tokyo", address, (WIDTH, HEIGHT), RATE, sound, SystemClock())
    await stream.open(datetime.now(UTC))
    try:
        yield stream
    finally:
        await stream.close()


async def draw(stream: Stream, clock: SystemClock, *, busy: bool = False) -> None:
    noisy = [noise(k) for k in range(4)]
    k = 0
    while True:
        stream.put(clock.now_ns(), noisy[k % 4] if busy else drawn(k), 42_000_000)
        k += 1
        await asyncio.sleep(1 / RATE)  # a browser plays it in real time


PIXELS = """(() => {
  const c = document.getElementById('picture');
  const p = (x, y) => Array.from(c.getContext('2d').getImageData(x, y, 1, 1).data.slice(0, 3));
  return [c.width, c.height, p(160, 270), p(480, 270), p(160, 90)];
})()"""
FITS = """(() => {
  const state = document.getElementById('state');
  const { scrollWidth, scrollHeight } = document.documentElement;
  return scrollWidth <= innerWidth && scrollHeight <= innerHeight && state.scrollWidth <= state.clientWidth;
})()"""


def test_a_browser_shows_what_is_drawn_says_how_it_goes_and_comes_back(tmp_path: Path) -> None:
    async def watch() -> None:
        clock = SystemClock()
        async with page(tmp_path) as tab:
            async with streaming() as stream:
                drawing, begun_s = asyncio.create_task(draw(stream, clock)), time.monotonic()
                address = stream.address
                await tab.open(f"http://{address}/")
                await tab.until("document.getElementById('state').textContent.includes('ms old')")
                await tab.call("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=1, mobile=False)
                await tab.until("innerWidth === 390")
                assert await tab.value(FITS), "a phone shows a part of the page"
                width, height, *colours = await tab.value(PIXELS)
                assert (width, height) == (WIDTH, HEIGHT)
                for seen, wanted in zip(colours, ((200, 0, 0), (0, 160, 0), (0, 0, 220)), strict=True):
                    assert np.abs(np.subtract(seen, wanted)).max() < 14, (seen, wanted)
                said = await tab.until(f"({SEEN})(document.getElementById('state'))")  # a busy page has seconds without a picture
                assert f"{WIDTH} × {HEIGHT}" in said["text"]
                drawn_so_late = 42  # and the picture is some time on its way
                assert int(re.findall(r"motions (\d+) ms", said["text"])[0]) >= drawn_so_late
                assert await tab.value("document.title") == "VISTEL tokyo"
                assert 0.0 <= said["ageMs"] < (time.monotonic() - begun_s) * 1e3, "no older than the first"
                cv2.imwrite(str(tmp_path / "page.png"), cv2.cvtColor(await tab.picture(), cv2.COLOR_RGB2BGR))
                drawing.cancel()
            await tab.until("!document.getElementById('trouble').hidden")
            assert "has ended" in await tab.value("document.getElementById('trouble').textContent")
            async with streaming(address) as stream:
                drawing = asyncio.create_task(draw(stream, clock))
                await tab.until("document.getElementById('trouble').hidden")
                await tab.until("document.getElementById('state').textContent.includes('ms old')")
                drawing.cancel()
            assert not [m for m in tab.messages if "Error" in m and "WebSocket" not in m], tab.messages

    asyncio.run(watch())


SEEN = "({ textContent, dataset }) => Number(dataset.rate) > 0 && { text: textContent, ageMs: Number(dataset.ageMs) }"
"""JavaScript: what the page says of the last second, if it has shown a picture in it."""


async def deaf(address: PageAddress) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """A WebSocket that is opened and never read."""
    connection = socket.create_connection((address.host, address.port))
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)
    reader, writer = await asyncio.open_connection(sock=connection, limit=1024)
    writer.transport.pause_reading()
    host = f"{address.host}:{address.port}"
    writer.write(
        f"GET /stream HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    await writer.drain()
    return reader, writer


def test_a_reader_that_never_reads_costs_neither_the_renderer_nor_the_others_anything(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "_SILENT_S", 3600.0)  # else it is let go of, on a busy machine before so much is read

    async def watch() -> None:
        clock = SystemClock()
        async with streaming() as stream, aiohttp.ClientSession() as session:
            writers = [(await deaf(stream.address))[1] for _ in range(3)]
            drawing = asyncio.create_task(draw(stream, clock, busy=True))
            async with session.ws_connect(f"http://{stream.address}/stream", max_msg_size=0) as healthy:
                # Far more than fits into the system's buffers.
                bytes_seen = pictures = 0
                while bytes_seen < 6_000_000:
                    said = await healthy.receive()
                    if said.type is aiohttp.WSMsgType.BINARY:
                        bytes_seen, pictures = bytes_seen + len(said.data), pictures + 1
            stalled = [r for r in stream._readers if r.left_out > 0]
            assert len(stalled) == 3
            assert all(len(r._pictures) <= 6 for r in stalled)
            assert pictures > 20
            drawing.cancel()
            for writer in writers:
                writer.transport.abort()

    asyncio.run(watch())


def test_pages_of_others_and_too_many_are_refused() -> None:
    async def ask() -> None:
        async with streaming() as stream, aiohttp.ClientSession() as session:
            url = f"http://{stream.address}"
            for headers in ({"Origin": "http://evil.example"}, {"Host": "evil.example"}):
                with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
                    await session.ws_connect(f"{url}/stream", headers=headers)
                assert refused.value.status == 403
            async with session.get(url, headers={"Host": "evil.example"}) as answer:
                assert answer.status == 403
            async with session.get(url) as answer:
                assert answer.status == 200
                assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
            async with contextlib.AsyncExitStack() as stack:
                for _ in range(MOST_READERS):
                    await stack.enter_async_context(session.ws_connect(f"{url}/stream", headers={"Origin": url}))
                with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
                    await session.ws_connect(f"{url}/stream")
                assert refused.value.status == 503

    asyncio.run(ask())


@pytest.mark.parametrize("said", ["", "{", "[]", "3", '{"ping": "x"}', '{"ping": null}', '{"lost": 1}', "x" * 4000])
def test_what_a_page_sends_breaks_nothing(said: str) -> None:
    async def tell() -> None:
        async with streaming() as stream, aiohttp.ClientSession() as session:
            async with session.ws_connect(f"http://{stream.address}/stream") as ws:
                await ws.send_str(said)
                await ws.send_str('{"ping": 12.5}')
                while "pong" not in (heard := str((await ws.receive()).data)):
                    pass
            assert '"ping": 12.5' in heard

    asyncio.run(tell())


def test_a_page_without_webcodecs_gets_jpeg() -> None:
    async def ask() -> None:
        async with streaming() as stream, aiohttp.ClientSession() as session:
            drawing = asyncio.create_task(draw(stream, SystemClock()))
            async with session.ws_connect(f"http://{stream.address}/stream?form=jpeg") as ws:
                while (said := await ws.receive()).type is not aiohttp.WSMsgType.BINARY:
                    pass
            drawing.cancel()
            picture = cv2.imdecode(np.frombuffer(said.data[16:], np.uint8), cv2.IMREAD_COLOR)
            assert picture.shape == (HEIGHT, WIDTH, 3)
            assert np.abs(picture[90, 160].astype(int) - (220, 0, 0)).max() < 20

    asyncio.run(ask())


def test_nobody_watching_costs_no_encoding() -> None:
    async def idle() -> None:
        async with streaming() as stream:
            for k in range(100):
                stream.put(k, drawn(0), 0)
            assert stream._encoder.left_out == 0
            assert stream._encoder._codec is None

    asyncio.run(idle())
