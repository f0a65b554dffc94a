"""Measures what a process's uplink has room for, as long as the process runs."""

import asyncio
from typing import Any

from vistel.v1.service_pb2 import ClockProbe
from vistel.wire import background
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, sleep, within
from vistel.wire.link.uplink import QueueDelay
from vistel.wire.release import release
from vistel.wire.topics import BY_NAME, MESSAGE_VERSION

ASK_S = 0.25
"""From one question to the next [s]."""
LATE_S = 2.0
"""A question that nobody has answered for so long is asked again [s]."""
LOOK_S = 0.1
"""A question that waits for its answer says so often how long the queue is at least [s]."""
TELLING_S = 0.2
"""It is only believed above this: a busy machine answers late, too [s]."""


async def follow_uplink(bus: Bus, clock: Clock) -> None:
    """Keep `bus.uplink` as the link to the hub is, until cancelled."""
    queue = QueueDelay()
    while True:
        asked_ns = clock.steady_ns()
        probe = ClockProbe(t_client_ns=asked_ns, release=release(), message_version=MESSAGE_VERSION)
        asking = background.start(bus.query(BY_NAME["clock"], probe, LATE_S), "uplink question")
        try:
            reply = await _answer(asking, bus, queue, clock, asked_ns)
        finally:
            asking.cancel()
        now_ns = clock.steady_ns()
        if reply is not None and reply.t_client_ns == asked_ns:
            bus.uplink.follow(queue.answered(asked_ns, reply.t_server_ns, now_ns), now_ns)
        await sleep(clock, ASK_S)


async def _answer(asking: asyncio.Task[Any], bus: Bus, queue: QueueDelay, clock: Clock, asked_ns: int) -> Any:
    while True:
        try:
            async with within(clock, LOOK_S):
                return await asyncio.shield(asking)
        except TimeoutError:
            now_ns = clock.steady_ns()
            waits_s = queue.waiting(asked_ns, now_ns)
            if waits_s > TELLING_S and bus.connected:  # a link that is cut is closed by now
                bus.uplink.follow(waits_s, now_ns)
