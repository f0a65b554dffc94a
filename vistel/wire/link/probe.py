"""Measures what a process's uplink has room for, as long as the process runs."""

from typing import Any

from vistel.v1.service_pb2 import ClockProbe
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, sleep
from vistel.wire.link.uplink import LATE_S, QueueDelay
from vistel.wire.release import release
from vistel.wire.topics import BY_NAME, MESSAGE_VERSION

ASK_S = 0.5
"""From one question to the next [s]."""


async def follow_uplink(bus: Bus, clock: Clock) -> None:
    """Keep `bus.uplink` as the link to the hub is, until cancelled."""
    queue = QueueDelay()
    while True:
        asked_ns = clock.steady_ns()
        probe = ClockProbe(t_client_ns=asked_ns, release=release(), message_version=MESSAGE_VERSION)
        reply: Any = await bus.query(BY_NAME["clock"], probe, LATE_S)
        now_ns = clock.steady_ns()
        if reply is not None and reply.t_client_ns == asked_ns:
            bus.uplink.follow(queue.answered(asked_ns, reply.t_server_ns, now_ns), now_ns)
        elif bus.connected:  # a link that is cut is closed by now
            bus.uplink.follow(queue.unanswered(), now_ns)
        await sleep(clock, ASK_S)
