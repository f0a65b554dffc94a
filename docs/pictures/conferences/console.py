"""The demo's console in a browser, day and night, on a desk and on a phone, with its tables, its map and what the host steers
with: console-*.png. Needs Chromium, a Japanese font and the console's page (`make web`); takes some minutes.

    python docs/pictures/conferences/console.py [room] [tables] [map] [steer]
"""

import asyncio
import signal
import subprocess
import sys
import tempfile
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
import tomli_w

from vistel.conference.files import DEMO_FILE, load

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests"))
from browser import Page, page

HERE = Path(__file__).parent
SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
DESK, PHONE = (1280, 800), (390, 844)
SHOTS = (
    ("console-day", DESK, "light"),
    ("console-night", DESK, "dark"),
    ("console-phone-day", PHONE, "light"),
    ("console-phone-night", PHONE, "dark"),
)
MAP = "[...document.querySelectorAll('#panel button')].find((b) => b.innerText.startsWith('Map'))"
SETTLED_S = 8.0
"""For rates and sparklines to say something."""


def main() -> None:
    wanted = sys.argv[1:] or tuple(PARTS)
    if unknown := set(wanted) - set(PARTS):
        sys.exit(f"{', '.join(sorted(unknown))}: expected some of {', '.join(PARTS)}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        command = [sys.executable, "-m", "vistel_cli.main", "up", str(conference(folder)), "--out", str(folder / "out")]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                url = next(line.split()[1] for line in process.stdout or () if line.startswith("  console"))
                asyncio.run(watch(folder, url, wanted))
            finally:
                process.send_signal(signal.SIGINT)


def conference(folder: Path) -> Path:
    """The demo, of which one site alone draws a small picture: the processor is the browser's."""
    data = load(DEMO_FILE).model_dump(mode="json", exclude_none=True)
    tokyo, *others = data["sites"]
    tokyo["display"] = {"width": 160, "height": 90, "video": False}
    for site in others:
        site["processes"] = [["tracker", "glove", "posture"]]
    file = folder / "demo.toml"
    file.write_text(tomli_w.dumps(data))
    return file


async def watch(folder: Path, url: str, wanted: Sequence[str]) -> None:
    """Open the page at `url`, and take the pictures that are wanted."""
    async with page(folder, *SOFTWARE_GL) as tab:
        await tab.open(url, *DESK)
        await tab.until("window.vistel && window.vistel.ready() === 3")
        await tab.value("window.vistel.sharp()")
        await tab.click(".choices button")
        for part in wanted:
            await PARTS[part](tab)


async def room(tab: Page) -> None:
    """By day and by night, on a desk and on a phone."""
    for shot, size, scheme in SHOTS:
        await _shown(tab, size, scheme)
        await _keep(tab, shot)


async def goes(tab: Page) -> None:
    """How the conference goes, on a phone by night and on a desk by day."""
    for shot, size, scheme in (("console-tables-phone", PHONE, "dark"), ("console-tables", DESK, "light")):
        await _shown(tab, size, scheme)
        await tab.value("document.querySelector('#panel table').closest('section').scrollIntoView({ block: 'start' })")
        await tab.value("[document.querySelector('aside'), document.scrollingElement].forEach((e) => e.scrollBy(0, -8))")
        await _keep(tab, shot)


async def the_map(tab: Page) -> None:
    """Who sends what to whom: as a list on a phone, and drawn on a desk, by night and by day."""
    await _shown(tab, PHONE, "dark")
    await tab.value(f"{MAP}.click()")
    await tab.until("Boolean(document.querySelector('.flows'))")
    await tab.value(f"{MAP}.scrollIntoView()")
    await asyncio.sleep(SETTLED_S)
    await _keep(tab, "console-map-phone")
    for shot, scheme in (("console-map-night", "dark"), ("console-map", "light")):
        await _shown(tab, DESK, scheme)
        await tab.value(f"{MAP}.click()")
        await tab.until("Boolean(document.querySelector('.map'))")
        await tab.value(f"{MAP}.scrollIntoView()")
        await asyncio.sleep(SETTLED_S)
        await _keep(tab, shot)


async def steer(tab: Page) -> None:
    """What the host steers with, on a phone by night and on a desk by day."""
    await _shown(tab, PHONE, "dark")
    await tab.value("document.querySelectorAll('.steer details').forEach((group) => (group.open = true))")
    await tab.value("document.querySelector('.steer').scrollIntoView()")
    await asyncio.sleep(SETTLED_S)
    await _keep(tab, "console-steer-phone")
    await _shown(tab, DESK, "light")
    await tab.value("document.querySelector('.steer-lines').open = false")
    await tab.value("document.querySelector('[name=ask]').focus()")
    await tab.call("Input.insertText", text="paint the red b")
    await tab.value("document.querySelector('.steer').scrollIntoView()")
    await asyncio.sleep(SETTLED_S)
    await _keep(tab, "console-steer")


PARTS: dict[str, Callable[[Page], Awaitable[None]]] = {"room": room, "tables": goes, "map": the_map, "steer": steer}


async def _keep(tab: Page, name: str) -> None:
    cv2.imwrite(str(HERE / f"{name}.png"), np.ascontiguousarray((await tab.picture())[..., ::-1]))


async def _shown(tab: Page, size: tuple[int, int], scheme: str) -> None:
    """The room on a desk or a phone, by day or by night, once it is settled."""
    await tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    await tab.call("Emulation.setScrollbarsHidden", hidden=size == PHONE)
    await tab.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=False)
    await tab.value("document.getElementById('views').firstElementChild.click()")
    await asyncio.sleep(SETTLED_S)


if __name__ == "__main__":
    main()
