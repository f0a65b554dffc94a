"""From a hand's move to another site's pixels over a simulated link, through a router with certificates, as QUIC carries it.

The site of whoever moves is behind the link, the one whose pixels are read beside the router. What a link adds is what is more than
without it, beyond its shortest one-way delay.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.conferences.hand_conference import MOVED_HAND
from benchmarks.conferences.hand_watch import SETTLE_S, Legs, nodes, sites, until_complete, watch
from benchmarks.progress import part
from benchmarks.row import Row, at_most
from benchmarks.wire.linked_sites import HUB, NAME, linked_sites
from vistel.wire import event_loop
from vistel.wire.clock import SystemClock, sleep
from vistel_sim.network import Conditions

NOTHING = Conditions()
DELAYS_S = 0.020, 0.080
JITTERS_S = 0.0, 0.010, 0.030
JUDGED_S = 0.030
"""The jitter for which what a link adds is judged."""
WANTED_MS = 45.0
_SITES = 2


def rows() -> Iterator[Row]:
    """Each delay with each jitter, and no link."""
    found = event_loop.run(_measure([NOTHING, *(Conditions(d, j) for d in DELAYS_S for j in JITTERS_S)]))
    without = found.pop(NOTHING)
    yield from _pixels("no link", without)
    for link, legs in found.items():
        case = f"a link of {1e3 * link.delay_s:.0f} ms one way, {1e3 * link.jitter_s:.0f} ms jitter"
        yield from _pixels(case, legs)
        added = float(np.median(legs.pixels) - np.median(without.pixels)) - 1e3 * link.delay_s
        target = at_most(WANTED_MS) if link.jitter_s == JUDGED_S else None
        yield Row("latency", case, "more than without it, beyond its delay, p50", "ms", added, target=target)


def _pixels(case: str, legs: Legs) -> Iterator[Row]:
    for q in (50, 95):
        yield Row("latency", case, f"byte at the device to pixels, p{q}", "ms", float(np.percentile(legs.pixels, q)))
    yield Row("latency", case, "playout: capture to the moment shown, p50", "ms", float(np.median(legs.playout)))


async def _measure(links: list[Conditions]) -> dict[Conditions, Legs]:
    clock, names = SystemClock(), [f"site-{n}" for n in range(_SITES)]
    found = dict[Conditions, Legs]()
    labels = [f"{HUB}/world", f"{HUB}/recorder", *nodes(_SITES, 1)]
    async with linked_sites(sites(_SITES, 1), names, labels, NOTHING, clock, devices=MOVED_HAND) as there:
        with part("a hand's moves over links", len(links)) as done:
            await until_complete(there.observer, _SITES)
            for conditions in links:
                there.links[names[0]].change(conditions)
                await sleep(clock, SETTLE_S)
                found[conditions] = Legs()
                await watch(there.observer, clock, found[conditions], NAME)
                done()
    return found
