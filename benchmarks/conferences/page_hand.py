"""From a hand's move to the pixels of the console's page in Chromium, as Chromium itself takes them off the page."""

import asyncio
import base64
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from benchmarks.conferences.hand_conference import HandConference, hand_conference
from benchmarks.conferences.hand_watch import CHANGED, FIRST_BYTE_NS, LEAST, READY_S, SECONDS, SETTLE_S, moves_seen, nodes, sites
from benchmarks.pages.chromium import Page, browser, drawn_by, first, is_software
from benchmarks.progress import part
from benchmarks.row import Row, at_most
from vistel.arrays import U8
from vistel.wire import event_loop
from vistel.wire.clock import sleep
from vistel.wire.zenoh.endpoints import free_port

SIZE = (800, 520)
"""Of the page [px]."""
WANTED_MS = (90.0, 130.0)
_SITES = 2


def rows() -> Iterator[Row]:
    """Judged where a graphics card draws the page."""
    try:
        renderer, late_ms, rate = event_loop.run(_measure())
    except RuntimeError as e:  # no browser, no pages, or nothing seen
        yield Row("latency", f"the console's page: {e}", "byte at the device to pixels, p50", "ms", float("nan"), judged=False)
        return
    case, judged = f"the console's page, {SIZE[0]}x{SIZE[1]}, drawn by {renderer}", not is_software(renderer)
    for q, wanted in zip((50, 95), WANTED_MS, strict=True):
        value = float(np.percentile(late_ms, q))
        yield Row("latency", case, f"byte at the device to pixels, p{q}", "ms", value, target=at_most(wanted), judged=judged)
    yield Row("latency", case, "pictures", "1/s", rate)


async def _measure() -> tuple[str, list[float], float]:
    """What draws, how late each move is seen [ms], and pictures a second."""
    port = free_port("tcp")
    sections = f'[console]\nat = "127.0.0.1:{port}"\n' + sites(_SITES, 1)
    labels = ["hub/world", "hub/console", *(n for n in nodes(_SITES, 1) if n.endswith("/capture"))]
    with part("a hand's moves in a page", 1) as done, tempfile.TemporaryDirectory() as name:
        async with hand_conference(sections, labels) as there, browser(Path(name)) as tab:
            async with asyncio.timeout(READY_S):
                await tab.open(f"http://127.0.0.1:{port}/", *SIZE)
                while not await tab.value("Boolean(window.vistel)"):
                    await sleep(there.clock, 1.0)  # until the console listens
                    await tab.open(f"http://127.0.0.1:{port}/", *SIZE)
                await first(tab, "figures")
            await sleep(there.clock, SETTLE_S)
            shown, drawn = await _shown(there, tab), await drawn_by(tab)
        done()
    late_ms = [(seen_ns - move_ns - FIRST_BYTE_NS) * 1e-6 for move_ns, seen_ns in moves_seen(shown, CHANGED, LEAST)]
    return drawn, late_ms, len(shown) / SECONDS


async def _shown(there: HandConference, tab: Page) -> list[tuple[int, U8]]:
    """Pictures of the page, brightness, with the conference time at which Chromium had each."""
    pictures: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
    shown = list[tuple[int, U8]]()
    tab.events["Page.screencastFrame"] = pictures.put_nowait
    await tab.call("Page.startScreencast", format="jpeg", quality=70)
    end_ns = there.clock.now_ns() + round(SECONDS * 1e9)
    while there.clock.now_ns() < end_ns:
        picture = await asyncio.wait_for(pictures.get(), READY_S)
        await tab.call("Page.screencastFrameAck", sessionId=picture["sessionId"])
        at_ns = round(1e9 * picture["metadata"]["timestamp"]) - there.clock.machine_off_ns
        grey = cv2.imdecode(np.frombuffer(base64.b64decode(picture["data"]), np.uint8), cv2.IMREAD_GRAYSCALE)
        shown.append((at_ns, np.asarray(grey, np.uint8)))
    await tab.call("Page.stopScreencast")
    return shown
