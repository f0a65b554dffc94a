"""A guest shows a picture and a PDF from the page, in a real browser, and everybody has the panel."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from browser import Page, page
from guest_room import GuestRoom, at_the_door, own_cache
from PIL import Image
from waiting import until

from vistel.v1.world_pb2 import Thing
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener
from vistel_cli.examples.slides import SLIDES, pdf
from vistel_services.console import bundle

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")


async def choose(tab: Page, file: Path) -> None:
    """As somebody does in the browser's dialogue for files."""
    root = (await tab.call("DOM.getDocument"))["root"]["nodeId"]
    node = (await tab.call("DOM.querySelector", nodeId=root, selector="#show input"))["nodeId"]
    await tab.call("DOM.setFileInputFiles", nodeId=node, files=[str(file)])


@pytest.mark.slow
def test_a_guest_shows_a_picture_and_the_pages_of_a_pdf(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if not all((bundle.FOLDER / name).is_file() for name in (bundle.GUEST_BUNDLE, *bundle.OF_PDF)):
        pytest.skip("the page for guests has not been made (make web)")
    own_cache(tmp_path, monkeypatch)
    (tmp_path / "slides.pdf").write_bytes(pdf(SLIDES))
    Image.new("RGB", (3000, 1500), "red").save(tmp_path / "wide.png")
    (tmp_path / "no.png").write_text("no picture")

    async def visit() -> None:
        async with page(tmp_path, *SOFTWARE_GL) as tab, GuestRoom(tmp_path).serving(monkeypatch) as room, room.led() as leading:
            listener = WorldListener(room.network.bus("c", "guests", room.clock), room.clock)
            things: dict[str, Thing] = {}

            def panels() -> list[Thing]:
                for now, _ in listener.take():
                    things.clear()
                    things.update(now.things)
                return [t for t in things.values() if t.HasField("pages")]

            sent = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["picture_part"], queue_all=True, polled=True)
            await at_the_door(tab, room, room.invited(), 800, 520)
            await tab.click(".people button[aria-current=true]")
            await tab.until("window.guest.me() === 'guest-1'")
            assert await tab.value("document.querySelector('#page-next')") is None, "nothing is up yet"

            await choose(tab, tmp_path / "no.png")
            await tab.until("document.querySelector('#show-told')?.innerText.startsWith('This cannot be shown')")
            await choose(tab, tmp_path / "wide.png")
            await until(panels, "a panel", tasks=[leading])
            (panel,) = panels()
            assert (panel.name, panel.pages.by, len(panel.pages.models)) == ("wide", "guest-1", 1)
            assert panel.looks[0].matrix[0] == pytest.approx(2.0 * panel.looks[0].matrix[4], rel=1e-3), "as wide as the picture"
            await tab.until("document.querySelector('#show-away')")
            await tab.click("#show-away")
            await until(lambda: not panels(), "no panel")

            await choose(tab, tmp_path / "slides.pdf")
            await until(panels, "the slides", tasks=[leading])
            assert len(panels()[0].pages.models) == len(SLIDES)
            assert len(set(panels()[0].pages.models)) == len(SLIDES), "each page is another picture"
            await tab.until("document.querySelector('#page-next')")
            await tab.click("#page-next")
            await until(lambda: panels()[0].pages.shown == 1, "the second page")
            await tab.click("#page-back")
            await until(lambda: panels()[0].pages.shown == 0, "the first page")
            await tab.until(f"window.guest.thing({panels()[0].id!r}) !== null")  # it is in the picture of the guest, too
            sizes = {(s.names["picture"], s.message.size) for s in sent.take()}
            assert len(sizes) == 1 + len(SLIDES) and all(size < 400_000 for _, size in sizes)

    asyncio.run(visit())
