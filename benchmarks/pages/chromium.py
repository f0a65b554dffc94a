"""A headless Chromium as a person's browser: opened, measured, and whether it draws with a graphics card."""

import contextlib
import shutil
import sys
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from browser import Page, page

from vistel_services.console import bundle

SIZE = (1440, 900)
"""Of the page [px]: a laptop's."""
_PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
_WITH_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--enable-precise-memory-info")
_RENDERER = """(() => {
  const gl = document.createElement("canvas").getContext("webgl2");
  const told = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl ? String(gl.getParameter(told?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER)) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return name;
})()"""


def missing() -> str:
    """Why there is no browser to be had; empty where there is."""
    if bundle.bundle_missing():
        return "the pages have not been made: make web"
    return "" if any(map(shutil.which, _PROGRAMS)) else f"no browser here; it needs one of {', '.join(_PROGRAMS)}"


@contextlib.asynccontextmanager
async def browser(folder: Path, *more: str) -> AsyncIterator[Page]:
    """A tab of a browser that has never seen a page, if `folder` is new. Raises RuntimeError where there is none to be had."""
    if why := missing():
        raise RuntimeError(why)
    async with page(folder, *_WITH_GL, *more) as tab:
        yield tab


async def drawn_by(tab: Page) -> str:
    """What draws WebGL in this browser, as it says itself; empty: nothing does."""
    return await tab.value(_RENDERER)


def is_software(renderer: str) -> bool:
    """Whether that is the processor."""
    return any(name in renderer.lower() for name in ("swiftshader", "llvmpipe", "software"))


async def first(tab: Page, mark: str) -> float:
    """Seconds from the opening of the address to the first picture of a kind: "room" or "figures" (clients/web/console/room.ts)."""
    return 1e-3 * await tab.until(f"performance.getEntriesByName({mark!r})[0]?.startTime")


async def bytes_loaded(tab: Page) -> tuple[int, int]:
    """What has crossed the network for the page itself, and for what it shows, such as avatars, headers included."""
    entries: list[list[Any]] = await tab.value(
        "[...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')]"
        ".map((e) => [new URL(e.name).pathname, e.transferSize])"
    )
    shown = sum(size for path, size in entries if path.startswith("/asset/"))
    return sum(size for _, size in entries) - shown, shown


async def heap_mb(tab: Page) -> float:
    """What the page's own objects take once rubbish is gone [MB]."""
    await tab.call("HeapProfiler.collectGarbage")
    return (await tab.call("Runtime.getHeapUsage"))["usedSize"] / 1e6
