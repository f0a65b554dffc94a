"""The page of a log: how soon a moment is seen, what that costs in memory, and whether figures are where the renderer has them."""

import asyncio
import contextlib
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
import psutil

from benchmarks.logs.long_log import MEETING, large_log, long_log
from benchmarks.pages.chromium import SIZE, Page, browser, drawn_by, first, heap_mb, is_software
from benchmarks.progress import part, skipped
from benchmarks.row import Row, at_most, ratio_at_most
from vistel.arrays import F64
from vistel.conference.model import Conference
from vistel.render.config import render_config
from vistel.render.figures.people import load_figure
from vistel.render.film.film import instants, records_of
from vistel.wire import event_loop
from vistel.wire.log import LogReader

HOUR_S = 3600.0
LARGE_BYTES = 10**9
ROOM_FOR_IT = 3
"""Times as much is to be free on the disk."""
SCRUBS = 60
"""With the mouse, over the whole hour and back; memory is looked at after a third of them, and after all."""
MOVES = 12
"""Of the mouse in each, at 60 a second."""
OPENINGS = 3
BEGIN_S = 3.0
"""Where the page of a log is opened: everybody is there [s]."""
MOMENTS = 20
"""At which joints are compared."""
MOST_APART_M = 1e-3
GROWS = 1.1
"""Memory that is bounded grows by no more, from a third of the scrubs to all of them."""
_NOTE = """(() => {
  window.pictures = [];
  window.released = 0;
  window.vistel.pictures((tMs, atMs) => {
    window.pictures.push([tMs, atMs]);
    if (window.pictures.length > 200) window.pictures.shift();
  });
  addEventListener("pointerup", () => (window.released = performance.now()), true);
})()"""
_OF_PLAYHEAD = "window.pictures.findLast(([tMs]) => Math.abs(tMs - %r - 1e3 * window.vistelTravel.t()) < 2)"
"""The newest picture of the moment where the playhead is."""
RESTS_M = 1e-7
"""Who moves less between two looks has come to rest."""
_LOOK_S = 0.2


@dataclass
class _Found:
    """scrubs_ms: from the mouse's release to the pixels of the moment; server_mb, page_mb: after some of them, and after all."""

    renderer: str = ""
    size: int = 0
    scrubs_ms: list[float] = field(default_factory=list[float])
    server_mb: list[float] = field(default_factory=list[float])
    page_mb: list[float] = field(default_factory=list[float])
    opened: list[float] = field(default_factory=list[float])
    read: list[float] = field(default_factory=list[float])


def rows() -> Iterator[Row]:
    """Figures of the page of a log."""
    with tempfile.TemporaryDirectory(prefix="vistel-") as name:
        folder = Path(name)
        yield from _hour(folder)
        yield from _large(folder)
    yield from _apart()


def _hour(folder: Path) -> Iterator[Row]:
    with part("writing an hour"):
        log = long_log(folder / "hour.mcap", HOUR_S)
    found = _Found(size=log.stat().st_size)
    with part("scrubbing", SCRUBS) as done:
        event_loop.run(_scrub(log, found, done))
    log.unlink()
    case = f"an hour of two people, {found.size / 1e6:.0f} MB, {SIZE[0]}x{SIZE[1]}, drawn by {found.renderer}"
    judged = not is_software(found.renderer)
    p95 = float(np.percentile(found.scrubs_ms, 95))
    yield Row("console", case, "released to pixels, p50", "ms", float(np.median(found.scrubs_ms)))
    yield Row("console", case, "released to pixels, p95", "ms", p95, target=at_most(200.0), judged=judged)
    peer = f"after {SCRUBS // 3} of {SCRUBS} scrubs"
    for what, (some, every) in (("server's memory", found.server_mb), ("page's objects", found.page_mb)):
        yield Row("console", case, what, "MB", every, peer, some, target=ratio_at_most(GROWS))


def _large(folder: Path) -> Iterator[Row]:
    if shutil.disk_usage(folder).free < ROOM_FOR_IT * LARGE_BYTES:
        skipped("a log of 1 GB", f"less than {ROOM_FOR_IT} GB are free at {folder}")
        return
    with part("writing a gigabyte"):
        log = large_log(folder / "large.mcap", LARGE_BYTES)
    found = _Found(size=log.stat().st_size)
    with part("opening it", OPENINGS) as done:
        event_loop.run(_open(log, found, done))
    for _ in range(OPENINGS):
        began = time.perf_counter()
        reader = LogReader(log)
        found.read.append(time.perf_counter() - began)
    hours = (reader.end_ns - reader.begin_ns) / 3.6e12
    log.unlink()
    case = f"{hours:.1f} h of two people, {found.size / 1e9:.2f} GB"
    yield Row("console", case, "its index read", "s", np.median(found.read))
    judged = not is_software(found.renderer)
    yield Row("console", case, "opened to the first moment", "s", np.median(found.opened), target=at_most(2.0), judged=judged)


@contextlib.asynccontextmanager
async def _served(log: Path) -> AsyncIterator[tuple[str, psutil.Process]]:
    """The address of its page, and the process that serves it."""
    command = [sys.executable, "-m", "vistel_cli.main", "replay", str(log), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        try:
            assert process.stdout is not None
            while " at http" not in (line := await asyncio.to_thread(process.stdout.readline)):
                if not line:
                    raise RuntimeError(f"vistel replay ended with {await asyncio.to_thread(process.wait)}")
            yield f"{line.split(' at ')[1].split()[0]}#t={BEGIN_S:g}", psutil.Process(process.pid)
        finally:
            process.terminate()


async def _scrub(log: Path, found: _Found, done) -> None:
    with tempfile.TemporaryDirectory() as name:
        async with _served(log) as (url, server), browser(Path(name)) as tab:
            await tab.open(url, *SIZE)
            found.renderer = await drawn_by(tab)
            begin_ms = await _noted(tab)
            places = np.random.default_rng(1).uniform(0.02, 0.98, SCRUBS + 1)
            for n, (begin, end) in enumerate(pairwise(places)):
                found.scrubs_ms.append(await _drag(tab, begin, end, begin_ms))
                done()
                if n + 1 in (SCRUBS // 3, SCRUBS):
                    found.server_mb.append(server.memory_info().rss / 1e6)
                    found.page_mb.append(await heap_mb(tab))


async def _noted(tab: Page) -> float:
    """From now on the page keeps which pictures it has shown. Of which conference time that of the log's beginning is [ms]."""
    await first(tab, "figures")
    await tab.value(_NOTE)
    at = await tab.until(f"window.pictures.length && window.vistelTravel.t() === {BEGIN_S} && window.pictures.at(-1)[0]")
    return at - 1e3 * BEGIN_S


async def _drag(tab: Page, begin: float, end: float, begin_ms: float) -> float:
    """The playhead is dragged from one share of the log to another and let go while the hand moves. Milliseconds from there to the
    picture of that moment. begin_ms: of the conference, of the picture of the log's beginning."""
    x, y, width, height = await tab.value(
        "((r) => [r.x, r.y, r.width, r.height])(document.querySelector('.tracks').getBoundingClientRect())"
    )
    await tab.value("window.released = 0")
    await _mouse(tab, "mousePressed", x + begin * width, y + height / 2)
    for n in range(1, MOVES + 1):
        await asyncio.sleep(1 / 60)
        await _mouse(tab, "mouseMoved", x + (begin + (end - begin) * n / MOVES) * width, y + height / 2)
    await _mouse(tab, "mouseReleased", x + end * width, y + height / 2)
    shown = _OF_PLAYHEAD % begin_ms
    return await tab.until(f"((found) => found && window.released && Math.max(1e-3, found[1] - window.released))({shown})")


async def _mouse(tab: Page, kind: str, x: float, y: float) -> None:
    await tab.call(
        "Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=int(kind != "mouseReleased"), clickCount=1
    )


async def _open(log: Path, found: _Found, done) -> None:
    """In a browser that has been there before."""
    with tempfile.TemporaryDirectory() as name:
        async with _served(log) as (url, _), browser(Path(name)) as tab:
            await tab.open(url, *SIZE)
            await first(tab, "figures")
            found.renderer = await drawn_by(tab)
            for _ in range(OPENINGS):
                await tab.open("about:blank", *SIZE)
                await tab.open(url, *SIZE)
                found.opened.append(await first(tab, "room"))
                await first(tab, "figures")
                done()


def _apart() -> Iterator[Row]:
    with part("joints"):
        worst, count = event_loop.run(_compare())
    case = f"{MOMENTS} moments of the meeting, {count} joints"
    target = at_most(1e3 * MOST_APART_M)
    yield Row("console", case, "joints beside the renderer's, p50", "mm", 1e3 * float(np.median(worst)))
    yield Row("console", case, "joints beside the renderer's, most", "mm", 1e3 * max(worst), target=target)


async def _compare() -> tuple[list[float], int]:
    """The most by which a joint of somebody in the page is away from the same in the renderer, at each moment [m], and how many
    joints were compared. A hand that has just taken a thing moves to it, from where it was when one began to look."""
    reader = LogReader(MEETING)
    length_s = (reader.end_ns - reader.begin_ns) * 1e-9
    worst, count = list[float](), 0
    with tempfile.TemporaryDirectory() as name:
        async with _served(MEETING) as (url, _), browser(Path(name)) as tab:
            await tab.open(url, 480, 320)
            begin_ms = await _noted(tab)
            for t in np.round(np.linspace(0.5, length_s - 0.5, MOMENTS), 3):
                await tab.value(f"window.vistelTravel.goTo({t})")
                await tab.until(_OF_PLAYHEAD % begin_ms)
                for who, wanted in _drawn(reader, float(t)).items():
                    apart = np.linalg.norm(await _settled(tab, who) - wanted, axis=1)
                    worst, count = [*worst, float(apart.max())], count + len(apart)
    return worst, count


async def _settled(tab: Page, who: str) -> F64:
    """Where somebody's joints are once they rest, (joints, 3) [m]."""
    before = np.full((1, 3), np.inf)
    while True:
        now = np.array(await tab.value(f"window.vistel.joints({who!r})"))
        if before.shape == now.shape and np.abs(now - before).max() < RESTS_M:
            return now
        before = now
        await asyncio.sleep(_LOOK_S)


def _drawn(reader: LogReader, t: float) -> dict[str, F64]:
    """Where the renderer has everybody's joints at a moment of a log, (joints, 3) [m]."""
    conference = Conference.model_validate(reader.conference)
    config = render_config(conference, conference.sites[0])
    delay_s = conference.playout.recorded_s
    now_ns = reader.begin_ns + round((t + delay_s) * 1e9)
    (instant,) = instants(delay_s, records_of(reader, now_ns, now_ns + 1), now_ns, now_ns + 10**9, 1.0)
    out: dict[str, F64] = {}
    for person in instant.people:
        figure = load_figure(person.about, files=config.avatars)
        out[person.about.name] = figure.pose(person.posture).joints.position
    return out
