"""A guest in a browser: the page before the room, own eyes and hand in it, the guest as others see them, the chat, and a camera
before which a drawn person sits: guest-*.png. Needs Chromium, a Japanese font and the console's pages (`make web`); takes some
minutes.

    python docs/pictures/conferences/guest.py [door] [chat] [eyes] [camera]
"""

import asyncio
import contextlib
import json
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import tomli_w

from vistel.conference.files import load

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests/service")]
from browser import Page, page
from guest_film import HIGH, RAISES, SITS, film, person, stills

HERE = Path(__file__).parent
CONFERENCE = ROOT / "examples/conferences/guests.toml"
SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
CAMERA = ("--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream")
SIZE, PHONE = (1120, 700), (390, 844)
QUICK = (480, 300)
"""While nothing is looked at."""
THINGS = ("box", "ball", "can", "ring", "cone")
"""One after the other, until one is taken: somebody else may have it, or it is out of reach."""
TRY_S = 30.0
"""For a hand to reach a thing, on a busy machine too."""
LIFT_PX = 90
TURNS = 4
"""To the right, towards who writes."""
FILE = "guests.toml"
PARTS = ("door", "chat", "eyes", "camera")
COMMAND = [sys.executable, "-m", "vistel_cli.main"]
LINES = (("aiko", "Welcome, Ann!"), ("aiko", "The agenda is at https://example.org/agenda"))
ANSWER = "Thanks, I have read it."


def main() -> None:
    wanted = sys.argv[1:] or PARTS
    if unknown := set(wanted) - set(PARTS):
        sys.exit(f"{', '.join(sorted(unknown))}: expected some of {', '.join(PARTS)}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = conference(folder)
        run = [*COMMAND, "up", str(file), "--out", str(folder / "out")]
        said = folder / "up.log"  # a pipe that nobody reads would be full after some minutes, and hold `vistel up` up
        with said.open("w") as log, subprocess.Popen(run, stdout=log) as up:
            try:
                url = line_with("  console ", said, up).split()[1]
                line_with("everybody sees everybody", said, up)
                asked = [*COMMAND, "invite", "Ann", str(file), "--seat", "guest-2", "--json"]
                told = subprocess.run(asked, stdout=subprocess.PIPE, check=True)
                asyncio.run(visit(folder, url, json.loads(told.stdout)["link"], wanted))
            finally:
                up.send_signal(signal.SIGINT)


def conference(folder: Path) -> Path:
    """Seats for guests, and somebody with trackers for whom nothing is drawn: the processor is the browser's."""
    data = load(CONFERENCE).model_dump(mode="json", exclude_none=True)
    data["record"] = False
    data["world"].pop("folder")  # that of the example, where a run would begin with the room of the run before
    data["sites"][0]["processes"] = [["tracker", "glove", "posture"]]
    file = folder / FILE
    file.write_text(tomli_w.dumps(data))
    return file


def line_with(words: str, said: Path, up: subprocess.Popen[bytes]) -> str:
    """What `vistel up` says, as soon as it does."""
    while not (lines := [line for line in said.read_text().splitlines() if words in line]):
        if up.poll() is not None:
            sys.exit(f"the conference ended: {said.read_text()}")
        time.sleep(0.2)
    return lines[0]


async def visit(folder: Path, console: str, link: str, wanted: Sequence[str]) -> None:
    """Enter by the link, and take the pictures that are wanted."""
    more = SOFTWARE_GL
    if "camera" in wanted:
        sits, raises, high = stills(person("ben"), (SITS, RAISES, HIGH))
        shown = film(folder / "film.mjpeg", [(sits, 8.0), (raises, 12.0), (high, 60.0)])
        more = (*SOFTWARE_GL, *CAMERA, f"--use-file-for-fake-video-capture={shown}")
    async with page(folder / "guest", *more) as tab:
        await tab.open(link, *SIZE)
        await tab.until("!document.getElementById('door').hidden && window.guest.ready() === 1")
        await asyncio.sleep(6.0)  # for walls and things
        if "door" in wanted:
            await sharp(tab)
            await kept(tab, "guest-door")
        await resize(tab, QUICK)
        await tab.click(".people button[aria-current=true]")
        await tab.until("window.guest.own()")
        await asyncio.sleep(2.0)  # until the view is steady
        if "chat" in wanted:
            await chat(tab, folder / FILE)
        if "eyes" in wanted:
            await eyes(tab, folder, console)
        if "camera" in wanted:
            await camera(tab)


async def eyes(tab: Page, folder: Path, console: str) -> None:
    """Take a thing and lift it; look at it from the console too."""
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
    await resize(tab, SIZE)
    await sharp(tab)
    await kept(tab, "guest-eyes")
    await resize(tab, QUICK)
    await mouse(tab, "mouseReleased", x, y - LIFT_PX / 2, clickCount=1)


async def camera(tab: Page) -> None:
    """The figure raises its hands as the person before the camera does."""
    await tab.click("#camera")
    await tab.until("document.getElementById('mirror').innerText.includes('Your figure does what you do')")
    await tab.until("window.guest.joints(window.guest.me()).filter(([, y]) => y > 1.15).length > 40")  # both hands are up
    await resize(tab, SIZE)
    await sharp(tab)
    await kept(tab, "guest-camera")
    await resize(tab, QUICK)


async def chat(tab: Page, file: Path) -> None:
    """Somebody writes, and the guest answers and turns to them; and the room on a phone."""
    for who, line in LINES:
        await asyncio.to_thread(subprocess.run, [*COMMAND, "chat", str(file), line, "--as", who], check=True)
    await tab.until(f"document.querySelector('#chat-button b')?.innerText === '{len(LINES)}'")
    await tab.click("#chat-button")
    await tab.call("Input.insertText", text=ANSWER)
    await tab.click("#chat form button")
    await tab.until(f"document.querySelector('#chat .lines').innerText.includes({ANSWER!r})")
    for _ in range(TURNS):
        await tab.value("document.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight' }))")
        await asyncio.sleep(0.5)  # the page draws when it does
    await resize(tab, SIZE)
    await sharp(tab)
    await kept(tab, "guest-chat", "document.body")
    await tab.click("#chat-button")
    await resize(tab, PHONE)
    await tab.value("document.getElementById('does').scrollTo(0, 0)")
    await sharp(tab)
    await kept(tab, "guest-phone", "document.body")
    await resize(tab, QUICK)


async def resize(tab: Page, size: tuple[int, int]) -> None:
    await tab.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=False)


async def sharp(tab: Page) -> None:
    await tab.value("window.guest.sharp()")
    await asyncio.sleep(8.0)


async def taken(tab: Page) -> tuple[float, float]:
    """Where the pointer holds a thing."""
    while True:
        for thing in THINGS:
            await asyncio.sleep(1.0)  # for hands to be out of the way
            x, y = await tab.value(f"window.guest.seen(window.guest.thing({thing!r}))")
            if await tab.value(f"document.elementFromPoint({x}, {y})?.tagName") != "CANVAS":
                continue  # it is off the picture or under a button
            await mouse(tab, "mouseMoved", x, y)
            await mouse(tab, "mousePressed", x, y, clickCount=1)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(TRY_S):
                    await tab.until("window.guest.held().some(([who]) => who === window.guest.me())")
                    return x, y
            await mouse(tab, "mouseReleased", x, y, clickCount=1)


async def mouse(tab: Page, kind: str, x: float, y: float, **more: object) -> None:
    await tab.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, **more)


async def kept(tab: Page, name: str, part: str = "document.getElementById('room')") -> None:
    """The picture of the room, and what lies over it; or another part of the page."""
    box = f"{part}.getBoundingClientRect()"
    x, y, width, height = await tab.value(f"(r => [r.x, r.y, r.width, r.height].map(Math.round))({box})")
    picture = (await tab.picture())[y : y + height, x : x + width, ::-1]
    cv2.imwrite(str(HERE / f"{name}.png"), np.ascontiguousarray(picture))


if __name__ == "__main__":
    main()
