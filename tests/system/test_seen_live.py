"""A whole small conference as people see it: one site in a window on a display, the other one in a browser's stream."""

from __future__ import annotations

import asyncio
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import aiohttp
import av
import numpy as np
import psutil
import pytest
from x_server import Hands, x_server

pytestmark = [pytest.mark.alone, pytest.mark.slow, pytest.mark.gl]

WIDTH, HEIGHT = 480, 270
PATIENCE_S = 200.0
CONFERENCE = f"""
name = "live"
seed = 1
record = false
[room]
seats = 2
[[sites]]
name = "tokyo"
display = {{ width = {WIDTH}, height = {HEIGHT}, window = true, video = false }}
participants = [{{ name = "aiko", seat = 0, height = 1.64, avatar = "builtin:seed=2" }}]
[[sites]]
name = "columbus"
display = {{ width = {WIDTH}, height = {HEIGHT}, video = false, stream = "PORT" }}
participants = [{{ name = "ben", seat = 1, height = 1.82, avatar = "builtin:seed=4,pattern=4,top=7" }}]
"""


@dataclass
class Seen:
    """A finished conference and what was seen of it; pictures are (h, w, 3)."""

    out: Path
    on_screen: list[np.ndarray] = field(default_factory=list)
    in_stream: list[np.ndarray] = field(default_factory=list)
    afterwards: np.ndarray | None = None
    processes: list[psutil.Process] = field(default_factory=list)
    text: str = ""
    code: int = -1

    def log(self, site: str) -> str:
        file = self.out / "logs" / f"{site}-renderer.log"
        return file.read_text() if file.exists() else ""


@pytest.fixture(scope="module")
def conference(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Seen]:
    """From its first pictures of both people until Ctrl-C."""
    folder = tmp_path_factory.mktemp("live")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    file, seen = folder / "live.toml", Seen(folder / "out")
    file.write_text(CONFERENCE.replace("PORT", str(port)))
    with pytest.MonkeyPatch.context() as patch, x_server(patch, WIDTH, HEIGHT) as hands:
        command = [sys.executable, "-m", "vistel_cli.main", "up", str(file), "--out", str(seen.out)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
            try:
                _until(lambda: all("event=picture people=2 stand_ins=0" in seen.log(s) for s in ("tokyo", "columbus")), process)
                seen.processes = psutil.Process(process.pid).children(recursive=True)
                _look(hands, port, seen)
            finally:
                process.send_signal(signal.SIGINT)
                seen.text, _ = process.communicate(timeout=60)
            seen.code = process.returncode
        seen.afterwards = hands.screen()
        yield seen


def _until(holds: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not holds():
        assert process.poll() is None, process.communicate()[0]
        assert time.monotonic() < deadline, "nothing was seen in time"
        time.sleep(0.1)


def _look(hands: Hands, port: int, seen: Seen) -> None:
    """At the display and at the stream until both have moved."""
    seen.on_screen.append(hands.screen())
    asyncio.run(_watch(port, seen.in_stream))
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        seen.on_screen[1:] = [hands.screen()]
        if _moved(seen.on_screen):
            return
        time.sleep(0.1)


async def _watch(port: int, pictures: list[np.ndarray]) -> None:
    """As a browser does, until what is shown has moved."""
    decoder = av.CodecContext.create("h264", "r")
    async with asyncio.timeout(PATIENCE_S), aiohttp.ClientSession() as session:
        async with session.get(f"http://127.0.0.1:{port}/") as page:
            assert page.status == 200
        async with session.ws_connect(f"http://127.0.0.1:{port}/stream", max_msg_size=0) as stream:
            async for said in stream:
                if said.type is aiohttp.WSMsgType.BINARY and said.data[0] in (0, 1):
                    pictures += [f.to_ndarray(format="rgb24") for f in decoder.decode(av.Packet(said.data[16:]))]
                    if len(pictures) > 3 and _moved(pictures):
                        return


def _moved(pictures: list[np.ndarray]) -> bool:
    return float(np.abs(pictures[0].astype(int) - pictures[-1]).mean()) > 0.5


def test_the_window_shows_a_picture_that_moves(conference: Seen) -> None:
    assert len(conference.on_screen) == 2, conference.text
    for picture in conference.on_screen:
        assert picture.shape == (HEIGHT, WIDTH, 3)
        assert picture.std() > 15
    assert _moved(conference.on_screen)


def test_the_stream_decodes_and_moves(conference: Seen) -> None:
    assert len(conference.in_stream) > 3, conference.text
    for picture in conference.in_stream:
        assert picture.shape == (HEIGHT, WIDTH, 3)
        assert picture.std() > 15
    assert _moved(conference.in_stream)


@pytest.mark.parametrize("site", ["tokyo", "columbus"])
def test_it_is_told_what_the_first_picture_took(conference: Seen, site: str) -> None:
    (line,) = re.findall("event=first_picture (.*)", conference.log(site))
    assert re.match(r"seconds=[\d.]+ processor_s=[\d.]+ loading_s=[\d.]+ opening_s=[\d.]+ setting_up_s=[\d.]+ drawing_s=", line)


def test_ctrl_c_ends_it_all(conference: Seen) -> None:
    assert conference.code == 0, conference.text
    for site in ("tokyo", "columbus"):
        assert "process stopped exit_code=0" in conference.log(site)
    assert len(conference.processes) >= 6
    assert [p.pid for p in conference.processes if p.is_running()] == []  # a zombie would be
    assert conference.afterwards is not None
    assert not conference.afterwards.any()  # nothing of the window is left on the display
