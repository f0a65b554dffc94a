"""A crowd in one room: what router and world cost, how late motion is, what a site receives, and how each grows.

Headless senders (`vistel sim crowd`) run on the same machine. Where they are the bottleneck themselves, a figure is not judged.
"""

import asyncio
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.conferences.world_steps import LoadedWorld, WorldLoad
from benchmarks.progress import part
from benchmarks.row import Row, at_least, at_most
from vistel.conference.model import CROWD
from vistel.v1.motion_pb2 import Motion
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_cli.run.crowd.load import CrowdLoad, measure
from vistel_services.world.received import InputCollector
from vistel_sim.crowd import crowd_conference
from vistel_sim.crowd.loops import THIN, motion_loops

PEOPLE = (5, 10, 20, 50, 100)
SECONDS = 6.0
STEPS, SETTLE = 90, 60
"""Of a world alone: how many are measured, after how many."""
ALONE_THINGS = 10
STEPS_HZ = 59.0
MOST_CORES, MOST_MS, MOST_MBIT = 2.0, 20.0, 2.0


def run() -> Iterator[Row]:
    """One row after the other."""
    with part("world alone"):
        alone = [_step_ms(count) for count in PEOPLE]
    for count, ms in zip(PEOPLE, alone, strict=True):
        yield Row("crowd", f"{count} people, world alone", "a step, processor time, median", "ms", ms)
    yield Row("crowd", "world alone", f"exponent of a step, {PEOPLE[0]} to {PEOPLE[-1]} people", "", _exponent(PEOPLE, alone))
    yield Row("crowd", "world alone", "reading one motion, processor time", "us", asyncio.run(_reading_us()))
    loads: list[CrowdLoad] = []
    for count in PEOPLE:
        with part(f"{count} people"):
            loads.append(asyncio.run(measure(count, SECONDS)))
        yield from _rows(loads[-1], last=count == PEOPLE[-1])
    good = [load for load in loads if not load.void]
    case = f"growth from {good[0].people} to {good[-1].people} people" if len(good) > 1 else ""
    for metric, values in (
        ("router", [load.router_cores for load in good]),
        ("received by a site", [load.megabits_per_s for load in good]),
        ("motion p99", [load.motion_part_ms(99) for load in good]),
    ):
        if case:
            yield Row("crowd", case, f"exponent of {metric}", "", _exponent([load.people for load in good], values))


def _rows(load: CrowdLoad, *, last: bool) -> Iterator[Row]:
    """last: the targets are those of the largest crowd."""
    case = f"{load.people} people" + (f", void: {load.void}" if load.void else "")
    both = load.router_cores + load.world_cores
    delivered = load.messages_per_s * load.people
    for metric, unit, value, target in (
        ("router", "cores", load.router_cores, None),
        ("world", "cores", load.world_cores, None),
        ("router and world", "cores", both, at_most(MOST_CORES)),
        ("steps of the world", "1/s", load.steps_per_s, at_least(STEPS_HZ)),
        ("motion, sent to received, median", "ms", load.motion_part_ms(50), None),
        ("motion, sent to received, p99", "ms", load.motion_part_ms(99), at_most(MOST_MS)),
        ("received by a site", "Mbit/s", load.megabits_per_s, at_most(MOST_MBIT)),
        ("received by a site", "messages/s", load.messages_per_s, None),
        ("router, of each message delivered", "us", 1e6 * load.router_cores / delivered, None),
        ("sending processes", "cores", sum(load.sender_cores), None),
    ):
        yield Row("crowd", case, metric, unit, value, target=target if last else None, judged=not load.void)


def _exponent(people: tuple[int, ...] | list[int], values: list[float]) -> float:
    """The slope of a straight line, both axes logarithmic."""
    return float(np.polyfit(np.log(people), np.log(values), 1)[0])


def _step_ms(people: int) -> float:
    """A step of a world that hears as its service does: of a crowd, those who reach for nothing ten times a second."""
    scene = LoadedWorld(WorldLoad(people, ALONE_THINGS))
    took_ms: list[float] = []
    for step in range(SETTLE + STEPS):
        inputs = scene.inputs()
        if people > CROWD:
            near = scene.world.reaching
            heard = (m for k, m in enumerate(inputs.motions) if m.participant in near or (step + k) % THIN == 0)
            inputs = replace(inputs, motions=tuple(heard))
        began = time.thread_time()
        scene.take(inputs)
        took_ms.append((time.thread_time() - began) * 1e3)
    return float(np.median(took_ms[SETTLE:]))


async def _reading_us() -> float:
    """From the bytes of a message to what a step takes of it."""
    (loop,) = motion_loops(crowd_conference(1), range(1))
    network = MemoryNetwork()
    bus = network.bus("crowd", "hub", SystemClock(), stale_after_ns=None)
    inbox, collector = bus.subscribe(BY_NAME["motion"], queue_all=True, polled=True), InputCollector()
    key = BY_NAME["motion"].format(conference="crowd", site="site-0", participant="person-0")
    took_us: list[float] = []
    for k, frame in enumerate(loop.full, 1):
        message = Motion(frame=frame)
        message.header.version, message.header.seq, message.header.t_ns = 1, k, k * 1_000_000_000 // 60
        payload = message.SerializeToString()
        began = time.thread_time()
        network.send(BY_NAME["motion"], key, payload)
        for sample in inbox.take():
            collector.motion(sample)
        took_us.append((time.thread_time() - began) * 1e6)
    return float(np.median(took_us))
