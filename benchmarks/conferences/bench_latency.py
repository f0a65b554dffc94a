"""From a hand's move to another site's pixels: a tracker simulated at its wire, real processes, one machine.

The first person moves a hand at known times (`moved_hand`), and what others see of it is watched (`hand_watch`): at sites of this
machine, in the console's page, over links that delay and jitter, and when it touches somebody.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.conferences import linked_hand, page_hand, touching_hands
from benchmarks.conferences.hand_conference import hand_conference
from benchmarks.conferences.hand_watch import Legs, nodes, sites, until_complete, watch
from benchmarks.progress import part
from benchmarks.row import Row, at_most
from vistel.wire import event_loop

ROUNDS = 2
"""Each kind of playout is measured so often, by turns."""
WANTED_MS = {1: (60.0, 90.0), 3: (110.0, 150.0)}
"""p50 and p95 by sites that draw: byte at the device to pixels."""


def run() -> Iterator[Row]:
    """One and three sites drawing, with the delay that follows the network and with the fixed one of before; then the page, links
    and a touch."""
    for drawing in (1, 3):
        before, now = Legs(), Legs()
        for _ in range(ROUNDS):
            for delay, found in (("0.1", before), ('"auto"', now)):
                event_loop.run(_measure(drawing, delay, found))
        case = f"{drawing} of 3 sites drawing, 640x360" if drawing > 1 else "1 of 2 sites drawing, 640x360"
        legs = {
            "device: capture to the byte that is read": (before.device, now.device),
            "filter: the move to the same in the motion, by capture time": (before.filtered, now.filtered),
            "solve, bus: byte to motion at another site": (before.solved, now.solved),
            "playout: capture to the moment shown": (before.playout, now.playout),
            "draw: sampled to the picture": (before.draw, now.draw),
            "byte at the device to pixels": (before.pixels, now.pixels),
        }
        for name, (theirs, ours) in legs.items():
            for q, at in ((50, 0), (95, 1)):
                target = at_most(WANTED_MS[drawing][at]) if "pixels" in name else None
                peer_value = float(np.percentile(theirs, q))
                value = float(np.percentile(ours, q))
                yield Row("latency", case, f"{name}, p{q}", "ms", value, "0.1 s of playout", peer_value, target=target)
        yield Row("latency", case, "pictures", "1/s", np.median(now.rate), "0.1 s of playout", float(np.median(before.rate)))
    yield from page_hand.rows()
    yield from linked_hand.rows()
    yield from touching_hands.rows()


async def _measure(drawing: int, delay: str, found: Legs) -> None:
    count = max(2, drawing)
    sections = f"[playout]\ndelay = {delay}\n" + sites(count, drawing)
    with part(f"{drawing} sites drawing, delay {delay}", 1) as done:
        async with hand_conference(sections, ["hub/world", "hub/recorder", *nodes(count, drawing)]) as there:
            await until_complete(there.bus, count)
            await watch(there.bus, there.clock, found)
        done()
