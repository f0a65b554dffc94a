"""The console's page of a conference that goes on: how soon it shows the room, how late, and for how many."""

import asyncio
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.pages.chromium import SIZE, Page, browser, bytes_loaded, drawn_by, first, is_software
from benchmarks.pages.live_conference import LiveConference, cores_of, live_conference, told_by
from benchmarks.progress import part
from benchmarks.row import Row, at_least, at_most, ratio_at_least, ratio_at_most
from vistel.wire import event_loop
from vistel.wire.topics import BY_NAME

COLD, WARM = 3, 5
"""Openings of the page that are measured; medians count."""
WATCHED_S = 30.0
"""How long pictures of one page are looked after, once it shows everybody."""
COUNTS = (1, 10, 50)
"""Viewers at once."""
VIEWED_S = 10.0
"""For each of these."""
RATE_HZ = 30.0
AS_FAST = 0.95
"""Share of the rate with one viewer that everybody else keeps with many."""
_SETTLED_S = 3.0
_NOTE_PICTURES = """(() => {
  window.noted = [];
  window.vistel.pictures((tMs, atMs) => window.noted.push(performance.timeOrigin + atMs - tMs));
})()"""


@dataclass
class _Found:
    """cold, warm: seconds; late_ms: from the gateway's time of a frame to the pixels that show it."""

    software: bool = True
    renderer: str = ""
    cold: list[float] = field(default_factory=list[float])
    known: list[float] = field(default_factory=list[float])
    warm: list[float] = field(default_factory=list[float])
    whole: list[float] = field(default_factory=list[float])
    bytes: tuple[int, int] = 0, 0
    late_ms: list[float] = field(default_factory=list[float])
    pictures_per_s: float = 0.0
    viewed: dict[int, dict[str, float]] = field(default_factory=dict[int, dict[str, float]])
    idle: float = 0.0


def rows() -> Iterator[Row]:
    """Figures of the live page."""
    found = event_loop.run(_measure())
    judged = not found.software
    at = f"three live sites, {SIZE[0]}x{SIZE[1]}, drawn by {found.renderer}"
    yield Row("console", at, "opened to the room, first of all", "s", np.median(found.cold), target=at_most(4.0), judged=judged)
    yield Row("console", at, "the same, everybody's own figure", "s", np.median(found.whole))
    yield Row("console", at, "opened to the room, a new browser", "s", np.median(found.known), target=at_most(4.0), judged=judged)
    yield Row("console", at, "opened to the room, once more", "s", np.median(found.warm), target=at_most(1.5), judged=judged)
    p95 = float(np.percentile(found.late_ms, 95))
    yield Row("console", at, "frame at the gateway to pixels, p50", "ms", float(np.median(found.late_ms)))
    yield Row("console", at, "frame at the gateway to pixels, p95", "ms", p95, target=at_most(80.0), judged=judged)
    yield Row("console", at, "pictures", "1/s", found.pictures_per_s, target=at_least(0.95 * RATE_HZ), judged=judged)
    page, shown = found.bytes
    yield Row("console", at, "the page as it is sent", "MB", page / 1e6, target=at_most(1.0))
    yield Row("console", at, "room, things and figures", "MB", shown / 1e6)
    yield from _of_viewers(found)


def _of_viewers(found: _Found) -> Iterator[Row]:
    one, some, many = (found.viewed[count] for count in COUNTS)
    case = f"{COUNTS[-1]} viewers at {many['least_per_s']:.0f} frames/s or more, whose process takes {many['load']:.2f} cores"
    yield Row("console", case, "gateway", "cores", many["gateway"], target=at_most(1.0))
    each, each_of_some = many["gateway"] / COUNTS[-1], some["gateway"] / COUNTS[1]
    yield Row("console", case, "for a viewer, beside ten", "cores", each, "of ten", each_of_some, target=ratio_at_most(1.0))
    yield Row("console", case, "gateway for one", "cores", one["gateway"])
    yield Row("console", case, "gateway, nobody watching", "cores", found.idle)
    yield Row("console", case, "to a viewer", "kbit/s", many["kbit_s"])
    yield Row("console", case, "gateway to one who watches, p95", "ms", many["probe_p95_ms"], "one viewer", one["probe_p95_ms"])
    for what, key in (("frames of one", "probe_per_s"), ("steps of the world", "steps_per_s"), ("motions", "motions_per_s")):
        yield Row("console", case, what, "1/s", many[key], "one viewer", one[key], target=ratio_at_least(AS_FAST))


async def _measure() -> _Found:
    found = _Found()
    async with live_conference("console") as live:
        with part("the first opening, which makes what is kept"):
            await _open(live, found, None)
        with part("openings", COLD) as done:
            for _ in range(COLD):
                await live.open_gateway()
                await _open(live, found, found.cold)
                done()
        with part("pictures"), tempfile.TemporaryDirectory() as name:
            async with browser(Path(name)) as tab:
                await _watch(live, tab, found)
        await asyncio.sleep(_SETTLED_S)
        found.idle = await cores_of(live.gateway, VIEWED_S)
        with part("viewers", len(COUNTS)) as done:
            for count in COUNTS:
                found.viewed[count] = await _viewed(live, count)
                done()
    return found


async def _open(live: LiveConference, found: _Found, into: list[float] | None) -> None:
    """A browser that has never been there opens the page; into: where its time is kept."""
    with tempfile.TemporaryDirectory() as name:
        async with browser(Path(name)) as tab:
            await tab.open(live.url, *SIZE)
            took, whole = await first(tab, "room"), await first(tab, "figures")
            if into is not None:
                into.append(took)
                found.whole.append(whole)
                found.bytes = await bytes_loaded(tab)


async def _watch(live: LiveConference, tab: Page, found: _Found) -> None:
    await tab.open(live.url, *SIZE)
    found.known.append(await first(tab, "room"))
    found.renderer = await drawn_by(tab)
    found.software = is_software(found.renderer)
    for _ in range(WARM):
        await first(tab, "figures")
        await tab.call("Page.reload")
        await tab.until("performance.timeOrigin > Date.now() - 60_000 && !performance.getEntriesByName('figures').length")
        found.warm.append(await first(tab, "room"))
    await first(tab, "figures")
    await asyncio.sleep(_SETTLED_S)
    await tab.value(_NOTE_PICTURES)
    await asyncio.sleep(WATCHED_S)
    found.late_ms = [late - live.clock.machine_off_ns * 1e-6 for late in await tab.value("window.noted")]
    found.pictures_per_s = len(found.late_ms) / WATCHED_S


async def _viewed(live: LiveConference, count: int) -> dict[str, float]:
    """What `count` viewers, one of them in a process of its own, cost the gateway and everybody else."""
    counting = asyncio.create_task(_of_others(live, VIEWED_S))
    async with asyncio.TaskGroup() as group:
        probe = group.create_task(_viewers(live.url, 1))
        many = group.create_task(_viewers(live.url, count - 1)) if count > 1 else None
        await asyncio.sleep(_SETTLED_S)
        used = await cores_of(live.gateway, VIEWED_S - _SETTLED_S)
    one = probe.result()
    out = {"gateway": used, "probe_per_s": one["frames_per_s"], "probe_p95_ms": one["age_p95_ms"]}
    return (many.result() if many is not None else one) | out | await counting


async def _viewers(url: str, count: int) -> dict[str, float]:
    return await told_by("light_viewers", url, str(count), str(VIEWED_S))


async def _of_others(live: LiveConference, seconds: float) -> dict[str, float]:
    """How fast the world steps, and what another site receives of each person, meanwhile."""
    motions = live.bus.subscribe(BY_NAME["motion"], queue_all=True, polled=True)
    states = live.bus.subscribe(BY_NAME["world_state"], queue_all=True, polled=True)
    await asyncio.sleep(seconds)
    steps = [sample.message.step for sample in states.take()]
    count = len(motions.take())
    motions.close()
    states.close()
    return {"steps_per_s": (max(steps) - min(steps)) / seconds if steps else 0.0, "motions_per_s": count / seconds}
