"""Several rooms in one process, each with its own world, bus and disk. One that fails begins again from its disk; others go on."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from dataclasses import dataclass
from typing import Any

from vistel.wire import background
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, sleep
from vistel.wire.zenoh.bus import BusError
from vistel_services.world.service import Config, run

log = logging.getLogger("vistel.world")

AGAIN_FIRST_S = 0.1
"""Wait before a room that failed is started again; it doubles each time."""
AGAIN_MOST_S = 5.0
"""Longest such wait."""
STEADY_S = 10.0
"""A room that ran for less has failed early, and waits longer each time."""

Open = Callable[[], Awaitable[Bus]]
Beside = Callable[[Bus], Coroutine[Any, Any, None]]


@dataclass(frozen=True)
class Served:
    """One room. open: a new bus of its conference, for each time it begins; beside: what else runs as long as it does."""

    name: str
    config: Config
    clock: Clock
    open: Open
    beside: Beside | None = None


async def serve(rooms: Sequence[Served]) -> None:
    """Run all of them until cancelled."""
    async with asyncio.TaskGroup() as group:
        for room in rooms:
            group.create_task(_keep(room), name=f"room {room.name}")


async def _keep(room: Served) -> None:
    wait_s = AGAIN_FIRST_S
    while True:
        began_ns = room.clock.now_ns()
        try:
            await _one_life(room)
        except Exception as e:
            wait_s = AGAIN_FIRST_S if room.clock.now_ns() - began_ns > STEADY_S * 1e9 else wait_s
            said = isinstance(e, background.TaskFailedError | BusError)
            log.error("room failed room=%s again_in_s=%.1f reason=%r", room.name, wait_s, str(e), exc_info=None if said else e)
        await sleep(room.clock, wait_s)
        wait_s = min(AGAIN_MOST_S, 2 * wait_s)


async def _one_life(room: Served) -> None:
    bus = await room.open()
    try:
        async with background.service(f"room {room.name}") as beside:
            if room.beside is not None:
                beside.start(room.beside(bus), "beside")
            await run(room.config, bus, room.clock)
    finally:
        await bus.close()
