"""The studios' pages in a browser: avatar*.png, calibration*.png. Needs Chromium, a Japanese font, and the pages (`make web`).

python docs/pictures/studio/studio.py
"""

import asyncio
import sys
import tempfile
from pathlib import Path

import cv2
from aiohttp import web

from vistel.conference.files import load
from vistel.figure.people.builtin import builtin_avatar
from vistel_cli.studio.avatar import AvatarStudio
from vistel_cli.studio.calibration import CalibrationStudio
from vistel_cli.studio.pages import studios

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests"))
from browser import Page, page

HERE = Path(__file__).parent
SOFTWARE = ("--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader")
DESK, PHONE = (1280, 800), (390, 844)
FILE = """
name = "lab"
[[sites]]
name = "tokyo"
[[sites.participants]]
name = "aiko"
height = 1.64
[sites.participants.tracker]
[sites.participants.gloves.left]
[sites.participants.gloves.right]
[sites.participants.face]
kind = "camera"
[sites.participants.eye]
"""
READY = (
    "!!window.vistelAvatar && window.vistelAvatar.settled() && document.querySelector('aside section').textContent.includes('mesh')"
)
BUTTON = "[...document.querySelectorAll('button')].find((b) => b.textContent === '{}').click()"


async def main() -> None:
    """Serves a built-in person and the devices of one participant, and looks at the pages."""
    avatar = builtin_avatar("builtin:person=aiko", name="aiko", height=1.64)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = folder / "lab.toml"
        file.write_text(FILE)
        hosts: set[str] = set()
        parts = {
            "avatar": AvatarStudio(lambda: avatar, "aiko.usda").app(),
            "wrinkles": web.Application(),
            "calibration": CalibrationStudio(load(file), file).app(),
        }
        runner = web.AppRunner(studios(parts, hosts, "avatar"), shutdown_timeout=1.0)
        await runner.setup()
        try:
            await web.TCPSite(runner, "127.0.0.1", 0).start()
            address = f"127.0.0.1:{runner.addresses[0][1]}"
            hosts.add(address)
            async with page(folder, *SOFTWARE) as tab:
                await avatars(tab, f"http://{address}/avatar/")
                await calibrations(tab, f"http://{address}/calibration/")
        finally:
            await runner.cleanup()


async def avatars(tab: Page, url: str) -> None:
    """At a table with bones, the face by night, and on a phone."""
    await tab.open(url, *DESK)
    await tab.until(READY)
    for what in ("table", "Bones", "Whole"):
        await tab.value(BUTTON.format(what))
        await tab.until(READY)
    await shot(tab, "avatar")
    await dark(tab, True)
    for what in ("Bones", "standing"):
        await tab.value(BUTTON.format(what))
        await tab.until(READY)
    for what in ("Face", "Smile"):
        await tab.value(BUTTON.format(what))
    await shot(tab, "avatar-night")
    await dark(tab, False)
    await tab.open(url, *PHONE)
    await tab.until(READY)
    await shot(tab, "avatar-phone")


async def calibrations(tab: Page, url: str) -> None:
    """A body's moves, an eye by night, a hand on a phone."""
    for name, what, size, night, until in (
        ("calibration", "body", DESK, False, "document.querySelector('.say').textContent.startsWith('4')"),
        ("calibration-night", "gaze", DESK, True, "document.querySelector('.say').textContent.startsWith('3')"),
        ("calibration-phone", "left_glove", PHONE, False, "document.querySelector('.say').textContent.startsWith('2')"),
    ):
        await dark(tab, night)
        await tab.open(url, *size)
        await tab.until(f"!!document.querySelector('[data-what=\"aiko {what}\"]')")
        await tab.value(f"document.querySelector('[data-what=\"aiko {what}\"]').click()")
        going = "document.querySelector('.count.go')" if what != "gaze" else "document.querySelector('.live img')"
        await tab.until(f"({until}) && !!{going}")
        await shot(tab, name)
        await tab.value("document.querySelector('#stop')?.click()")


async def dark(tab: Page, night: bool) -> None:
    value = "dark" if night else "light"
    await tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": value}])


async def shot(tab: Page, name: str) -> None:
    await asyncio.sleep(1.5)
    cv2.imwrite(str(HERE / f"{name}.png"), cv2.cvtColor(await tab.picture(), cv2.COLOR_RGB2BGR))


if __name__ == "__main__":
    asyncio.run(main())
