"""Whole sites over links that delay, jitter and lose: devices, posture, voices, pictures, a world and a recorder.

How late people are in the pictures of the others, as renderers report it; beside it, the same meeting over links that do nothing.
"""

import asyncio
from collections.abc import Iterator

import numpy as np

from benchmarks.progress import part
from benchmarks.row import Row, at_most
from benchmarks.wire.linked_sites import HUB, linked_sites
from vistel.wire.bus import Subscription
from vistel.wire.clock import Clock, SystemClock, sleep
from vistel.wire.topics import BY_NAME
from vistel_sim.network import Conditions

DELAY_S = 0.050
NOTHING, BAD = Conditions(), Conditions(DELAY_S, 0.050, 0.05)
READY_S = 240.0
SETTLED_S, SECONDS = 10.0, 30.0
SITE = """
[[sites]]
name = "{site}"
[[sites.participants]]
name = "{person}"
[sites.display]
width = 320
height = 180
video = false
[sites.audio]
loudspeaker = "none"
"""


def rows(counts: tuple[int, ...] = (3,)) -> Iterator[Row]:
    """Each number of sites, over good and bad links."""
    for count in counts:
        good, bad = asyncio.run(_meet(count))
        case = f"{count} whole sites, 50 ms one way, 50 ms jitter, 5 % loss"
        for name, percent, limit in (("median", 50, 60.0), ("p99", 99, 110.0)):
            value, plain = (1e3 * float(np.percentile(delays, percent)) for delays in (bad[0], good[0]))
            metric = f"people in the others' pictures, beyond one way, {name}"
            yield Row("apart", case, metric, "ms", value - 1e3 * DELAY_S, "no link", plain, target=at_most(limit))
        yield Row("apart", case, "pictures of each site", "1/s", bad[1], "no link", good[1])


async def _meet(count: int) -> list[tuple[list[float], float]]:
    """Of good links and of bad ones: how late people are seen [s], and pictures a second."""
    clock, sites = SystemClock(), [f"site-{n}" for n in range(count)]
    sections = "".join(SITE.format(site=s, person=f"person-{n}") for n, s in enumerate(sites))
    nodes = [f"{HUB}/world", f"{HUB}/recorder", *(f"{s}/{label}" for s in sites for label in ("capture", "renderer"))]
    async with linked_sites(sections, sites, nodes, NOTHING, clock) as there:
        reports = there.observer.subscribe(BY_NAME["image_delay"], queue_all=True)
        with part(f"{count} whole sites", 3) as done:
            async with asyncio.timeout(READY_S):
                seen = set[str]()
                while len(seen) < count:
                    await sleep(clock, 0.5)
                    seen |= {s.message.site for s in reports.take() if len(s.message.streams) == count}
            done()
            found = [await _watch(reports, clock)]
            done()
            for link in there.links.values():
                link.change(BAD)
            found.append(await _watch(reports, clock))
            done()
        return found


async def _watch(reports: Subscription, clock: Clock) -> tuple[list[float], float]:
    await sleep(clock, SETTLED_S)
    reports.take()
    await sleep(clock, SECONDS)
    messages = [s.message for s in reports.take()]
    own = {f"site-{n}": f"person-{n}" for n in range(len({m.site for m in messages}))}
    delays = [stream.delay_s for m in messages for stream in m.streams if stream.participant != own[m.site]]
    return delays, float(np.mean([m.frames_per_s for m in messages]))
