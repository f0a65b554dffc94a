"""A guest shows a tab of their browser live, in a real Chromium; its moving colours are read on the panel in others' pictures."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np
import pytest
from browser import page
from guest_room import GuestRoom, at_the_door, own_cache
from waiting import until

from vistel.wire.topics import BY_NAME
from vistel_services.console import bundle

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
            picture = await console.picture()
            assert max(share(picture, RED), share(picture, BLUE)) < 0.01
            assert not [m for m in tab.messages + console.messages if "Error" in m], tab.messages + console.messages

    asyncio.run(visit())
