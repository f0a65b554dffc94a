"""Measures what a process's uplink has room for, as long as the process runs."""

import asyncio
import logging
from collections.abc import Callable
from typing import Any

from vistel.v1.service_pb2 import ClockProbe
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, sleep
from vistel.wire.link.longer_way import LONG_BYTES, LongerWay
from vistel.wire.link.queue_delay import NEWEST, QueueDelay
from vistel.wire.release import release
from vistel.wire.topics import BY_NAME, MESSAGE_VERSION
from vistel.wire.uplink import SOON, Uplink

log = logging.getLogger("vistel.uplink")

LOOK_S = 0.1
"""From one look at questions that wait for their answers to the next [s]."""
LOOKS = 3
"""From one question to the next; one, while it is found out whether more has room."""
PATIENCE_S = 2.0
"""So long an answer is awaited [s]."""


async def follow_uplink(bus: Bus, clock: Clock, measured: Callable[[Uplink], None] = lambda _: None) -> None:
    """Keep `bus.uplink` as the link to the hub is, until cancelled. measured: called after each answer."""
    queue, way, waiting = QueueDelay(), LongerWay(), set[int]()

    async def ask(asked_ns: int, long: bool) -> None:
        nonlocal queue
        probe = ClockProbe(t_client_ns=asked_ns, release=release(), message_version=MESSAGE_VERSION)
        probe.padding = bytes(LONG_BYTES if long else 0)
        reply: Any = await bus.query(BY_NAME["clock"], probe, PATIENCE_S)
        waiting.discard(asked_ns)
        now_ns = clock.steady_ns()
        if reply is None or reply.t_client_ns != asked_ns:
            return
        if way.answered(long, queue.longer(asked_ns, reply.t_server_ns, now_ns), now_ns):
            log.info("uplink wide queue_ms=%.0f reason='the way became longer'", bus.uplink.queue_s * 1e3)
            queue = QueueDelay()
            bus.uplink.begin_anew()
        newest = SOON if bus.uplink.tries(now_ns) else NEWEST
        if not long:
            bus.uplink.follow(queue.answered(asked_ns, reply.t_server_ns, now_ns, newest), now_ns)
        measured(bus.uplink)

    async with asyncio.TaskGroup() as asking:
        while True:
            asked_ns = clock.steady_ns()
            waiting.add(asked_ns)
            asking.create_task(ask(asked_ns, way.asks_long(bus.uplink.in_vain, asked_ns)))
            for _ in range(1 if bus.uplink.tries(asked_ns) else LOOKS):
                await sleep(clock, LOOK_S)
                now_ns = clock.steady_ns()
                waits_s = queue.waiting(min(waiting), now_ns) if waiting else 0.0
                if waits_s and bus.connected:  # a link that is cut is closed by now
                    bus.uplink.follow(waits_s, now_ns)
