"""A crowd in one room: what router and world cost, how late motion is, what a site receives, and how each grows.

Headless senders (`vistel sim crowd`) run on the same machine. Where they are the bottleneck themselves, a figure is not judged.
"""

import asyncio
from collections.abc import Iterator

import numpy as np

from benchmarks.progress import part
from benchmarks.row import Row, at_least, at_most
from vistel_cli.run.crowd_load import CrowdLoad, measure

PEOPLE = (5, 10, 20, 50, 100)
SECONDS = 10.0
STEPS_HZ = 59.0
MOST_CORES, MOST_MS, MOST_MBIT = 2.0, 20.0, 2.0


def run() -> Iterator[Row]:
    """One row after the other."""
    loads: list[CrowdLoad] = []
    for count in PEOPLE:
        with part(f"{count} people"):
            loads.append(asyncio.run(measure(count, SECONDS)))
        yield from _rows(loads[-1], last=count == PEOPLE[-1])
    good = [load for load in loads if not load.void]
    for metric, values in (
        ("router", [load.router_cores for load in good]),
        ("world", [load.world_cores for load in good]),
        ("received", [load.megabits_per_s for load in good]),
        ("motion p99", [load.motion_part_ms(99) for load in good]),
    ):
        if len(good) > 1:
            exponent = np.polyfit(np.log([load.people for load in good]), np.log(values), 1)[0]
            yield Row(
                "crowd", f"growth from {good[0].people} to {good[-1].people} people", f"exponent of {metric}", "", float(exponent)
            )


def _rows(load: CrowdLoad, *, last: bool) -> Iterator[Row]:
    """last: the targets are those of the largest crowd."""
    case = f"{load.people} people" + (f", void: {load.void}" if load.void else "")
    both = load.router_cores + load.world_cores
    for metric, unit, value, target in (
        ("router", "cores", load.router_cores, None),
        ("world", "cores", load.world_cores, None),
        ("router and world", "cores", both, at_most(MOST_CORES)),
        ("steps of the world", "1/s", load.steps_per_s, at_least(STEPS_HZ)),
        ("motion, sent to received, median", "ms", load.motion_part_ms(50), None),
        ("motion, sent to received, p99", "ms", load.motion_part_ms(99), at_most(MOST_MS)),
        ("received by a site", "Mbit/s", load.megabits_per_s, at_most(MOST_MBIT)),
        ("received by a site", "messages/s", load.messages_per_s, None),
        ("sending processes", "cores", sum(load.sender_cores), None),
    ):
        yield Row("crowd", case, metric, unit, value, target=target if last else None, judged=not load.void)
