"""A guest shows a tab of their browser or their camera live, in a real Chromium: others see it move, until it ends in any way."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from browser import Page, page
from guest_room import GuestRoom, at_the_door, own_cache
from screen_stream import plain
from waiting import until

from vistel.render.stage.screens import DecodedScreens
from vistel.wire.topics import BY_NAME
from vistel_services.console import bundle, guests

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
RED, BLUE = (200, 30, 40), (30, 60, 200)
SHOWN = (
    "data:text/html,<title>Shown</title><body><script>const colours = [[200,30,40],[30,60,200]];"
    "setInterval(() => document.body.style.background = `rgb(${colours[Math.floor(Date.now() / 4000) %25 2]})`, 50)</script>"
)
"""A tab that is red for four seconds and blue for four."""
CAPTURING = "--auto-select-tab-capture-source-by-title=Shown"
"""As if somebody had chosen that tab in the browser's dialogue."""


def share(picture: np.ndarray, colour: tuple[int, int, int]) -> float:
    """Of the picture that is of about this colour, as bright as a panel's page is."""
    away = np.abs(picture.astype(int) - 0.85 * np.array(colour)).max(axis=-1)
    return float((away < 45).mean())


@pytest.mark.slow
def test_a_guest_shows_a_tab_others_see_it_move_and_it_goes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if not all((bundle.FOLDER / name).is_file() for name in (bundle.BUNDLE, bundle.GUEST_BUNDLE, bundle.OF_SCREEN)):
        pytest.skip("the page for guests has not been made (make web)")
    own_cache(tmp_path, monkeypatch)

    async def visit() -> None:
        async with (
            page(tmp_path / "ann", *SOFTWARE_GL, CAPTURING) as tab,
            page(tmp_path / "host", *SOFTWARE_GL) as console,
            GuestRoom(tmp_path).serving(monkeypatch) as room,
            room.led() as leading,
        ):
            parts = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["screen"], queue_all=True, polled=True)
            await tab.call("Target.createTarget", url=SHOWN, newWindow=True)
            await at_the_door(tab, room, room.invited(), 480, 320)
            await tab.click(".people button[aria-current=true]")
            await tab.until("window.guest.me() === 'guest-1'")
            await tab.click("#add summary")
            await tab.click("#share-screen")
            await tab.until("document.querySelector('#share-told')?.innerText === 'Everybody sees it now.'")
            await tab.until("window.guest.sharing.sent.pictures > 3")
            came: list[str] = []
            await until(lambda: came.extend(s.message.codec for s in parts.take()) or came, "a picture", tasks=[leading])
            assert set(came) == {await tab.value("window.guest.sharing.sent.codec")}
            await console.open(
                f"http://{room.address}/", 640, 480
            )  # later than the panel: it is looked at from where it can be read
            for page_of_others, name in ((console, "vistel"), (tab, "guest")):
                await page_of_others.until(f"window.{name}.screens('guest-1') > 3")
            seen: set[str] = set()
            while seen != {"red", "blue"}:
                picture = await console.picture()
                seen |= {name for name, colour in (("red", RED), ("blue", BLUE)) if share(picture, colour) > 0.01}
            await tab.click("#share-end")
            await console.until("window.vistel.screens('guest-1') === 0")
            parts.take()
            room.take()
            moved = len(room.moved)
            await room.until(lambda: len(room.moved) > moved + 120, "Ann is still there")
            assert not parts.take(), "nothing more is sent"
            while max(share(picture := await console.picture(), RED), share(picture, BLUE)) >= 0.01:
                pass  # a busy page draws the board without it some pictures later
            assert not [m for m in tab.messages + console.messages if "Error" in m], tab.messages + console.messages

    asyncio.run(visit())


class Watcher:
    """What another site decodes of what Ann shows. streams: their numbers so far."""

    def __init__(self, room: GuestRoom) -> None:
        self._parts = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["screen"], queue_all=True, polled=True)
        self._decoded = DecodedScreens()
        self.streams: list[int] = []

    def seen(self) -> str:
        """The colour that is seen, by its strongest part; empty: nothing has come yet."""
        for sample in self._parts.take():
            if sample.message.stream not in self.streams:
                self.streams.append(sample.message.stream)
            self._decoded.receive("guest-1", sample.message, 0)
        self._decoded.settle()
        shown = self._decoded.shown(0).get("guest-1")
        return ("red", "green", "blue")[int(shown.rgb.mean(axis=(0, 1)).argmax())] if shown is not None else ""


@contextlib.asynccontextmanager
async def entered(folder: Path, patch: pytest.MonkeyPatch, *more: str) -> AsyncIterator[tuple[Page, GuestRoom, Watcher]]:
    """Ann in the room; more: arguments of her browser."""
    if not all((bundle.FOLDER / name).is_file() for name in (bundle.GUEST_BUNDLE, bundle.OF_SCREEN)):
        pytest.skip("the page for guests has not been made (make web)")
    own_cache(folder, patch)
    async with page(folder, *SOFTWARE_GL, *more) as tab, GuestRoom(folder).serving(patch) as room, room.led():
        yield tab, room, Watcher(room)


async def enter(tab: Page, room: GuestRoom, token: str = "") -> None:
    await at_the_door(tab, room, token or room.invited(), 480, 320)
    await tab.click(".people button[aria-current=true]")
    await tab.until("window.guest.me() === 'guest-1'")
    await tab.click("#add summary")


@pytest.mark.slow
def test_others_see_a_guests_camera_until_the_guest_stops_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    film, (done, data) = tmp_path / "film.mjpeg", cv2.imencode(".jpg", plain(BLUE, 640, 480)[:, :, ::-1])
    assert done
    film.write_bytes(data.tobytes() * 60)
    camera = ("--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream", f"--use-file-for-fake-video-capture={film}")

    async def visit() -> None:
        async with entered(tmp_path, monkeypatch, *camera) as (tab, room, watcher):
            await enter(tab, room)
            await tab.click("#share-camera")
            await until(lambda: watcher.seen() == "blue", "the camera's picture")
            assert await tab.value("window.guest.camera.state") != "on", "it is shown, and not what leads the figure"
            await tab.click("#share-end")
            await tab.until("!document.querySelector('#share-end')")
            await tab.until("window.guest.screens('guest-1') === 0")

    asyncio.run(visit())


@pytest.mark.slow
def test_what_is_shown_comes_back_with_the_connection_and_ends_with_the_browsers_own_button(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    closed, real = [], guests._close

    async def close(connection: Any, code: int, reason: str) -> None:
        closed.append(code)
        await real(connection, code, reason)

    monkeypatch.setattr(guests, "_close", close)

    async def visit() -> None:
        async with entered(tmp_path, monkeypatch, CAPTURING) as (tab, room, watcher):
            other = (await tab.call("Target.createTarget", url=SHOWN, newWindow=True))["targetId"]
            token = room.invited()
            await enter(tab, room, token)
            await tab.click("#share-screen")
            await until(watcher.seen, "a picture")
            for again in (False, True):
                before_it = len(watcher.streams)
                room.cut()
                if again:  # as where the console does not know yet that the connection before is gone
                    async with room.opened(token) as before:
                        await before.told("invited")
                        await until(lambda: guests.TAKEN in closed, "the page is refused, and tries again")
                await until(lambda count=before_it: watcher.seen() and len(watcher.streams) > count, "another stream")
                await tab.until("document.querySelector('#share-told')?.innerText === 'Everybody sees it now.'")
            await tab.until("window.guest.me() === 'guest-1'")
            # The tab that is shown is closed: its track ends as with the browser's own "Stop sharing".
            await tab.call("Target.closeTarget", targetId=other)
            await tab.until("!document.querySelector('#share-end')")
            await tab.until("window.guest.screens('guest-1') === 0")
            assert await tab.value("document.querySelector('#share-told')") is None, "who stops it is told nothing"
            await tab.until("Boolean(document.querySelector('#share-screen'))")

    asyncio.run(visit())
