"""How late the page of another guest has what a guest shows live: a tab whose colour changes at known moments is shown from a
browser, and decoded where a page without a browser gets it. Drawing the panel comes after that, with the page's next picture."""

import asyncio
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.pages.chromium import Page, browser, missing
from benchmarks.pages.guest_seats import LOOK_S, link_to, seated
from benchmarks.pages.live_conference import guest, live_conference
from benchmarks.progress import part, skipped
from benchmarks.row import Row, at_most
from vistel.protocol.pages.screen_parts import parts_of
from vistel.render.stage.screens import DecodedScreens
from vistel.session.screens import picture_of
from vistel.wire import background, event_loop

MOST_MS = 200.0
CHANGES = 40
EVERY_MS = 730
"""From one colour to the next, which is no multiple of the time from one picture to the next."""
LEVELS = 40, 215
"""Of red, green and blue: three digits of two, eight colours."""
_TITLE = "Shown"
_TAB = (
    f"data:text/html,<title>{_TITLE}</title><body><script>let last=-1;const draw=()=>{{const n=Math.floor(Date.now()/{EVERY_MS});"
    f"if(n!==last){{last=n;const of=b=>(n>>b)&1?{LEVELS[1]}:{LEVELS[0]};"
    "document.body.style.background=`rgb(${of(0)},${of(1)},${of(2)})`}}setTimeout(draw,4)}};draw()</script>"
)
_PATIENCE_S = 120.0
_SIZE = (640, 400)
_CAPTURING = f"--auto-select-tab-capture-source-by-title={_TITLE}"
"""As if somebody had chosen that tab in the browser's dialogue."""


def rows() -> Iterator[Row]:
    """Figures of a live screen."""
    if why := missing():
        skipped("a live screen", why)
        return
    late_ms, codec, kbit_s = event_loop.run(background.as_service("screen", _measure()))
    case = f"a tab shown live with {codec}, decoded at another guest's page, {len(late_ms)} changes"
    yield Row("guest", case, "change in the tab to the picture, median", "ms", float(np.median(late_ms)), target=at_most(MOST_MS))
    yield Row("guest", case, "the same, nine in ten", "ms", float(np.percentile(late_ms, 90)))
    yield Row("guest", case, "up-link", "kbit/s", kbit_s)


class _Seen:
    """What the other page has decoded. late_ms: of each colour that was seen, when it was first."""

    def __init__(self) -> None:
        self._decoded, self._count, self._colour = DecodedScreens(), 0, -1
        self.late_ms: list[float] = []

    def take(self, message: bytes) -> None:
        """A picture as it comes."""
        name, picture = picture_of(message)
        for piece in parts_of(replace(picture, number=self._count)):
            self._decoded.receive(name, piece, 0)
        self._count += 1
        self._decoded.settle()
        now_ms = time.time() * 1e3
        shown = self._decoded.shown(0).get(name)
        if shown is None:
            return
        high, wide = shown.rgb.shape[:2]
        middle = shown.rgb[high // 3 : high // 2, wide // 3 : wide // 2].mean(axis=(0, 1))
        colour = sum(int(level > 0.5 * sum(LEVELS)) << bit for bit, level in enumerate(middle))
        if colour == self._colour:
            return
        if self._colour >= 0:
            newest = int(now_ms // EVERY_MS)
            number = newest - (newest - colour) % 8  # the last time that it was this colour
            self.late_ms.append(now_ms - number * EVERY_MS)
        self._colour = colour


async def _measure() -> tuple[list[float], str, float]:
    """How late each change was seen [ms], the codec, and what went up [kbit/s]."""
    with tempfile.TemporaryDirectory(prefix="vistel-") as folder:
        async with live_conference("screen", guests=2) as live, seated(live, 2) as other, browser(Path(folder), _CAPTURING) as tab:
            await tab.call("Target.createTarget", url=_TAB, newWindow=True)
            async with asyncio.timeout(_PATIENCE_S):
                await _show(tab, f"{live.url}join#{link_to(live, 1)}")
            seen = _Seen()
            other.sees = seen.take
            began, sent = time.monotonic(), await _sent(tab)
            with part("changes of colour", CHANGES) as done:
                async with asyncio.timeout(_PATIENCE_S + CHANGES * EVERY_MS * 1e-3):
                    counted = 0
                    while counted < CHANGES:
                        if len(seen.late_ms) > counted:
                            counted += 1
                            done()
                        else:
                            await asyncio.sleep(LOOK_S)
            kbit_s = (await _sent(tab) - sent) * 8e-3 / (time.monotonic() - began)
            return seen.late_ms, await tab.value("window.guest.sharing.sent.codec"), kbit_s


async def _show(tab: Page, link: str) -> None:
    """Enter, and show the tab."""
    await tab.open(link, *_SIZE)
    await tab.until("document.querySelector('.people button[aria-current=true]')")
    await tab.click(".people button[aria-current=true]")
    await tab.until(f"window.guest?.me() === {guest(1)!r}")
    await tab.click("#add summary")
    await tab.click("#share-screen")
    await tab.until("window.guest.sharing.sent.pictures > 10")


async def _sent(tab: Page) -> float:
    return float(await tab.value("window.guest.sharing.sent.bytes"))
