"""wrinkle-studio.png: the page of `vistel wrinkle studio`, as Chromium shows it."""

import asyncio
import sys
import tempfile
from pathlib import Path

import cv2
from aiohttp import web

from vistel.figure.people.builtin import builtin_avatar
from vistel.wrinkle.wrinkle_sets import wrinkle_sets
from vistel_cli.studio.pages import studios
from vistel_cli.studio.wrinkles.opened import Opened
from vistel_cli.studio.wrinkles.server import WrinkleStudio

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests"))
from browser import page

OUT = Path(__file__).with_name("wrinkle-studio.png")
READY = "!!window.studio && window.studio.link.idle && window.studio.state.sets.length > 0"
SOFTWARE = ("--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader")


async def main() -> None:
    """Serves the built-in person, selects a point of the star at the elbow, and looks at the page."""
    avatar = builtin_avatar("builtin:person=carla", name="eva", height=1.70)
    with tempfile.TemporaryDirectory() as folder:
        opened = Opened(avatar, Path(folder) / "eva.usda", "builtin:person=carla", wrinkle_sets())
        hosts: set[str] = set()
        parts = {"avatar": web.Application(), "wrinkles": WrinkleStudio(opened).app(), "calibration": web.Application()}
        runner = web.AppRunner(studios(parts, hosts, "wrinkles"))
        await runner.setup()
        try:
            await web.TCPSite(runner, "127.0.0.1", 0).start()
            hosts.add(f"127.0.0.1:{runner.addresses[0][1]}")
            async with page(Path(folder), *SOFTWARE) as tab:
                await tab.open(f"http://{next(iter(hosts))}/", 1440, 900)
                await tab.until(READY)
                await tab.value("void window.studio.state.select({ wrinkle: 1, branch: 2, point: 1 })")
                await tab.until(READY)
                await asyncio.sleep(1.0)
                cv2.imwrite(str(OUT), cv2.cvtColor(await tab.picture(), cv2.COLOR_RGB2BGR))
        finally:
            await runner.cleanup()


if __name__ == "__main__":
    asyncio.run(main())
