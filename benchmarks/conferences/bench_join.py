"""How long somebody who comes late waits for the room, over the real bus, while everybody moves.

Wall time from the opening of the door to the conference, and from the door being open, to the first state of the room that can
be drawn; each is checked against the sender's checksum a second later. The world and its people run in processes of their own.
"""

import asyncio
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.conferences.join_room import CONFERENCE
from benchmarks.row import Row, at_most
from vistel.wire import event_loop
from vistel.wire.clock import SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener
from vistel.wire.zenoh.bus import Router, ZenohBus

ROOMS = ((3, 50), (20, 500))
TIMES = 12
START_S = 120.0
SECONDS = 0.5
POLL_S = 0.005


@dataclass
class Joins:
    """Seconds; steps a second that the world did meanwhile; bytes of an answer."""

    with_door: list[float] = field(default_factory=list[float])
    from_door: list[float] = field(default_factory=list[float])
    checked: int = 0
    steps_s: float = 0.0
    answer: int = 0


def run() -> Iterator[Row]:
    for people, things in ROOMS:
        found = measure(people, things)
        case = f"{people} people, {things} things, {len(found.from_door)} joins; the world did {found.steps_s:.0f} steps a second"
        worst = max(found.with_door)
        yield Row("join", case, "door opened to room known, median", "s", float(np.median(found.with_door)))
        yield Row("join", case, "the same, worst", "s", worst, target=at_most(SECONDS))
        yield Row("join", case, "door open to room known, median", "s", float(np.median(found.from_door)))
        yield Row("join", case, "found right by the checksum", "joins", float(found.checked))
        yield Row("join", case, "answer", "kB", found.answer / 1000)


def measure(people: int, things: int) -> Joins:
    """Joins of one room."""
    router = Router.open()
    with tempfile.TemporaryDirectory(prefix="vistel-") as folder:
        program = [sys.executable, "-m", "benchmarks.conferences.join_room"]
        rest = [router.endpoint, str(people), str(things), folder]
        root = Path(__file__).resolve().parents[2]
        processes = [subprocess.Popen([*program, what, *rest], cwd=root) for what in ("world", "people")]
        try:
            return event_loop.run(_joins(router.endpoint, people))
        finally:
            for process in processes:
                process.kill()
                process.wait()
            router.close()


async def _joins(endpoint: str, people: int) -> Joins:
    clock, out = SystemClock(), Joins()
    watching = await ZenohBus.open(conference=CONFERENCE, site="watching", clock=clock, endpoints=[endpoint])
    listener = WorldListener(watching, clock)
    newest = 0, 0
    began = time.monotonic()
    while newest[1] < people:
        await asyncio.sleep(0.05)
        for now, _ in listener.take():
            newest = now.step, len(now.participants)
        if time.monotonic() - began > START_S:
            raise RuntimeError("the room did not come up")
    await asyncio.sleep(3.0)  # until a tenth of the things is on the move
    first, began = (listener.take() or [None])[-1], time.monotonic()
    for n in range(TIMES):
        await _join(endpoint, f"late-{n}", clock, out)
    last = listener.take()[-1]
    assert first is not None
    out.steps_s = (last[0].step - first[0].step) / (time.monotonic() - began)
    answer = await watching.query(BY_NAME["world_snapshot"], None, 3.0)
    out.answer = answer.ByteSize() if answer is not None else 0
    listener.close()
    await watching.close()
    return out


async def _join(endpoint: str, site: str, clock: SystemClock, out: Joins) -> None:
    began = time.monotonic()
    bus = await ZenohBus.open(conference=CONFERENCE, site=site, clock=clock, endpoints=[endpoint])
    opened = time.monotonic()
    listener = WorldListener(bus, clock)
    while not listener.take():
        await asyncio.sleep(POLL_S)
    known = time.monotonic()
    out.with_door.append(known - began)
    out.from_door.append(known - opened)
    while time.monotonic() - known < 1.3:
        await asyncio.sleep(POLL_S)
        listener.take()
    out.checked += listener.right
    listener.close()
    await bus.close()


if __name__ == "__main__":
    for row in run():
        print(row)
