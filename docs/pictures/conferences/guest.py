"""A guest in a browser: the page before the room, own eyes and hand in it, and the guest as others see them: guest-*.png. Needs
Chromium and the console's pages (`make web`); takes two minutes."""

import asyncio
import contextlib
import json
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests"))
from browser import Page, page

HERE = Path(__file__).parent
CONFERENCE = ROOT / "examples/conferences/guests.toml"
SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
SIZE = (1120, 700)
THINGS = ("box", "ball", "can")
"""One after the other, until one is taken: somebody else may have it, or it is out of reach."""
TRY_S = 10.0
LIFT_PX = 90


def main() -> None:
    command = [sys.executable, "-m", "vistel_cli.main"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        conference = shutil.copy(CONFERENCE, folder)  # its room is kept beside it
        run = [*command, "up", conference, "--out", str(folder / "out")]
        with subprocess.Popen(run, stdout=subprocess.PIPE, text=True) as up:
            try:
                url = next(line.split()[1] for line in up.stdout or () if line.startswith("  console"))
                next(line for line in up.stdout or () if "everybody sees everybody" in line)
                asked = [*command, "invite", "Ann", "--seat", "guest-2", "--json"]
                told = subprocess.run(asked, stdout=subprocess.PIPE, check=True)
                asyncio.run(visit(folder, url, json.loads(told.stdout)["link"]))
            finally:
                up.send_signal(signal.SIGINT)


async def visit(folder: Path, console: str, link: str) -> None:
    """Enter by the link, take the box, and look at it from the console too."""
    async with page(folder / "guest", *SOFTWARE_GL) as tab:
        await tab.open(link, *SIZE)
        await tab.until("!document.getElementById('door').hidden && window.guest.ready() === 1")
        await asyncio.sleep(6.0)  # for walls and things
        await kept(tab, "guest-door")
        await tab.call("Emulation.setDeviceMetricsOverride", width=480, height=300, deviceScaleFactor=1, mobile=False)
        await tab.click(".people button[aria-current=true]")
        await tab.until("window.guest.own()")
        await asyncio.sleep(2.0)  # until the view is steady
        x, y = await taken(tab)
        for n in range(12):
            await mouse(tab, "mouseMoved", x, y - n * LIFT_PX / 24)
            await asyncio.sleep(0.1)  # as a hand moves
        async with page(folder / "console", *SOFTWARE_GL) as other:
            await other.open(console, *SIZE)
            await other.until("window.vistel && window.vistel.ready() === 2")
            await other.value("window.vistel.sharp()")
            await asyncio.sleep(8.0)
            await kept(other, "guest-seen")
        await tab.call("Emulation.setDeviceMetricsOverride", width=SIZE[0], height=SIZE[1], deviceScaleFactor=1, mobile=False)
        await tab.value("window.guest.sharp()")
        await asyncio.sleep(8.0)
        await kept(tab, "guest-eyes")


async def taken(tab: Page) -> tuple[float, float]:
    """Where the pointer holds a thing."""
    while True:
        for thing in THINGS:
            x, y = await tab.value(f"window.guest.seen(window.guest.thing({thing!r}))")
            await mouse(tab, "mouseMoved", x, y)
            await mouse(tab, "mousePressed", x, y, clickCount=1)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(TRY_S):
                    await tab.until("window.guest.held().some(([who]) => who === window.guest.me())")
                    return x, y
            await mouse(tab, "mouseReleased", x, y, clickCount=1)
            await asyncio.sleep(1.0)  # for the hand to be out of the way


async def mouse(tab: Page, kind: str, x: float, y: float, **more: object) -> None:
    await tab.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, **more)


async def kept(tab: Page, name: str) -> None:
    """The picture of the room, and what lies over it."""
    box = "document.getElementById('room').getBoundingClientRect()"
    x, y, width, height = await tab.value(f"(r => [r.x, r.y, r.width, r.height].map(Math.round))({box})")
    picture = (await tab.picture())[y : y + height, x : x + width, ::-1]
    cv2.imwrite(str(HERE / f"{name}.png"), np.ascontiguousarray(picture))


if __name__ == "__main__":
    main()
