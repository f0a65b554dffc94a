"""The demo's console in a browser, day and night, on a desk and on a phone: console-*.png. Needs Chromium and the console's page
(`make web`); takes three minutes."""

import asyncio
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
SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
SHOTS = (
    ("console-day", 1280, 800, "light"),
    ("console-night", 1280, 800, "dark"),
    ("console-phone-day", 390, 844, "light"),
    ("console-phone-night", 390, 844, "dark"),
)
SETTLED_S = 8.0
"""For rates and sparklines to say something."""


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        command = [sys.executable, "-m", "vistel_cli.main", "up", "--out", str(folder / "out")]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                url = next(line.split()[1] for line in process.stdout or () if line.startswith("  console"))
                asyncio.run(watch(folder, url))
            finally:
                process.send_signal(signal.SIGINT)


async def watch(folder: Path, url: str) -> None:
    """The page at `url`, by day and by night, on a desk and on a phone."""
    async with page(folder, *SOFTWARE_GL) as tab:
        for shot, width, height, scheme in SHOTS:
            await tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
            if shot == SHOTS[0][0]:
                await tab.open(url, width, height)
                await tab.until("window.vistel && window.vistel.ready() === 3")
                await tab.value("window.vistel.sharp()")
                await tab.click(".choices button")
            else:
                await _resize(tab, width, height)
            await asyncio.sleep(SETTLED_S)
            await _keep(tab, shot)
        await steer(tab)


async def steer(tab: Page) -> None:
    """What the host steers with, on a phone by night, where it was left, and on a desk by day."""
    await tab.value("document.querySelectorAll('.steer details').forEach((group) => (group.open = true))")
    await tab.value("document.querySelector('.steer').scrollIntoView()")
    await asyncio.sleep(SETTLED_S)
    await _keep(tab, "console-steer-phone")
    await tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "light"}])
    await _resize(tab, 1280, 800)
    await tab.value("document.querySelector('.steer-lines').open = false")
    await tab.value("document.querySelector('[name=ask]').focus()")
    await tab.call("Input.insertText", text="paint the red b")
    await tab.value("document.querySelector('.steer').scrollIntoView()")
    await asyncio.sleep(SETTLED_S)
    await _keep(tab, "console-steer")


async def _keep(tab: Page, name: str) -> None:
    cv2.imwrite(str(HERE / f"{name}.png"), np.ascontiguousarray((await tab.picture())[..., ::-1]))


async def _resize(tab: Page, width: int, height: int) -> None:
    await tab.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
    await tab.value("document.getElementById('views').firstElementChild.click()")


if __name__ == "__main__":
    main()
