"""A whole small conference as people see it: one site in a window on a display, the other one in a browser's stream."""

from __future__ import annotations

import asyncio
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

import aiohttp
import av
import numpy as np
import psutil
import pytest
from waiting import wait_until
from x_server import Hands, x_server

from vistel.render.view.camera import overview
from vistel.space.room import meeting_room
from vistel.wire.zenoh.endpoints import free_port

pytestmark = [pytest.mark.alone, pytest.mark.slow, pytest.mark.gl]

WIDTH, HEIGHT = 480, 270
BALL = overview().project(meeting_room(2).by_id["ball"].position[None], WIDTH, HEIGHT)[0, :2]
"""Where the yellow ball lies in a picture of the whole room [pixels]."""
LIFT = np.array((40.0, -35.0))
MOST_PICTURES = 200
"""Of the stream, by which the ball has come to where the mouse has drawn it."""
CONFERENCE = f"""
name = "live"
seed = 1
record = false
[room]
seats = 2
[[sites]]
name = "tokyo"
display = {{ width = {WIDTH}, height = {HEIGHT}, window = true, video = false }}
participants = [{{ name = "aiko", seat = 0, height = 1.64, avatar = "builtin:person=aiko" }}]
[[sites]]
name = "columbus"
display = {{ width = {WIDTH}, height = {HEIGHT}, view = "room", video = false, stream = "PORT" }}
participants = [{{ name = "ben", seat = 1, height = 1.82, avatar = "builtin:person=ben" }}]
"""


@dataclass
class Seen:
    """A finished conference and what was seen of it; pictures are (h, w, 3)."""

    out: Path
    on_screen: list[np.ndarray] = field(default_factory=list)
    before_it_was_lifted: np.ndarray | None = None
    lifted: np.ndarray | None = None
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
    port = free_port()
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
                seen.text, _ = process.communicate(timeout=600)
            seen.code = process.returncode
        seen.afterwards = hands.screen()
        yield seen


def _patch(picture: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Mean colour about a pixel."""
    x, y = np.round(at).astype(int)
    return picture[y - 1 : y + 2, x - 1 : x + 2].reshape(-1, 3).mean(axis=0)


def _yellow(picture: np.ndarray, at: np.ndarray) -> bool:
    red, green, blue = _patch(picture, at)
    return bool(min(red, green) > 110 and blue < 0.55 * min(red, green))


def _until(holds: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    def seen() -> bool:
        assert process.poll() is None, process.communicate()[0]
        return holds()

    wait_until(seen, every_s=0.1)


def _look(hands: Hands, port: int, seen: Seen) -> None:
    """At the display and at the stream until both have moved; then at the stream while the ball is lifted in the window."""
    seen.on_screen.append(hands.screen())
    asyncio.run(_watch(port, seen.in_stream, lambda: len(seen.in_stream) > 3 and _moved(seen.in_stream)))

    def moved() -> bool:
        seen.on_screen[1:] = [hands.screen()]
        return _moved(seen.on_screen)

    wait_until(moved, every_s=0.1)
    before: list[np.ndarray] = []
    asyncio.run(_watch(port, before, lambda: _yellow(before[-1], BALL)))  # no arm hides the ball
    seen.before_it_was_lifted = before[-1]
    for key in "F1", "3":  # no panel before the ball, and both look from the same place
        _press(hands, key)
    for patience in count(1):
        wait_until(lambda: _yellow(hands.screen(), BALL), every_s=0.1)
        hands.move(*BALL)
        time.sleep(2.0 * patience)  # the window looks once a picture what is under the mouse, and nothing tells from outside when
        hands.button(1, True)
        try:
            for share in np.linspace(0.1, 1.0, 10):
                hands.move(*(BALL + share * LIFT))
                time.sleep(0.1)  # a hand takes time
            later: list[np.ndarray] = []
            asyncio.run(_watch(port, later, lambda later=later: len(later) > MOST_PICTURES or _yellow(later[-1], BALL + LIFT)))
        finally:
            hands.button(1, False)
        if _yellow(later[-1], BALL + LIFT):
            seen.lifted = later[-1]
            return
        _press(hands, "3")  # the mouse was there too early, and what it has drawn may be the view


def _press(hands: Hands, key: str) -> None:
    hands.key(key, True)
    hands.key(key, False)


async def _watch(port: int, pictures: list[np.ndarray], enough: Callable[[], bool]) -> None:
    """As a browser does, until `pictures` are enough."""
    decoder = av.CodecContext.create("h264", "r")
    async with aiohttp.ClientSession() as session:
        async with session.get(f"http://127.0.0.1:{port}/") as page:
            assert page.status == 200
        async with session.ws_connect(f"http://127.0.0.1:{port}/stream", max_msg_size=0) as stream:
            async for said in stream:
                if said.type is aiohttp.WSMsgType.BINARY and said.data[0] in (0, 1):
                    pictures += [f.to_ndarray(format="rgb24") for f in decoder.decode(av.Packet(said.data[16:]))]
                    if pictures and enough():
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


def test_what_the_mouse_lifts_in_the_window_is_lifted_in_the_other_sites_picture(conference: Seen) -> None:
    assert conference.before_it_was_lifted is not None and conference.lifted is not None, conference.text
    assert _yellow(conference.before_it_was_lifted, BALL)
    assert not _yellow(conference.before_it_was_lifted, BALL + LIFT)
    assert _yellow(conference.lifted, BALL + LIFT)
    assert not _yellow(conference.lifted, BALL)


@pytest.mark.parametrize("site", ["tokyo", "columbus"])
def test_it_is_reported_what_the_first_picture_took(conference: Seen, site: str) -> None:
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
