"""Conference time: the hub's clock, measured over the bus (Cristian 1989, "Probabilistic clock synchronization").

A probe asks the hub for its time; had the answer been read half-way through the round trip, the error of the offset is at most half
the round trip. Of several probes the one with the shortest round trip is the best, and half of that is the uncertainty reported.
"""

import asyncio
import logging
from dataclasses import dataclass

from google.protobuf.message import DecodeError, Message

from vistel.v1.service_pb2 import ClockOffset, ClockProbe, ClockReply
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, SystemClock
from vistel.wire.topics import BY_NAME

log = logging.getLogger("vistel.clock")

PROBES = 8
PERIOD_S = 5.0
"""Two quartz clocks part by a quarter of a millisecond in that time, at most."""


@dataclass(frozen=True)
class Offset:
    """Add `offset_ns` to the measured clock to get the hub's; wrong by at most `uncertainty_ns`."""

    offset_ns: int
    uncertainty_ns: int


def serve_clock(bus: Bus, clock: Clock) -> None:
    """Answer probes with `clock`'s time: the hub's part."""

    def answer(request: bytes) -> Message:
        probe = ClockProbe()
        try:
            probe.ParseFromString(request)
        except DecodeError:
            log.warning("clock probe ignored reason='%d bytes that are no ClockProbe'", len(request))
        return ClockReply(t_client_ns=probe.t_client_ns, t_server_ns=clock.now_ns())

    bus.serve(BY_NAME["clock"], answer)


async def measure_offset(bus: Bus, clock: Clock, probes: int = PROBES) -> Offset | None:
    """The hub's clock against `clock`, from the best of `probes` round trips; None when the hub does not answer."""
    best: Offset | None = None
    for _ in range(probes):
        sent_ns = clock.now_ns()
        reply: ClockReply | None = await bus.query(BY_NAME["clock"], ClockProbe(t_client_ns=sent_ns))
        back_ns = clock.now_ns()
        if reply is None or reply.t_client_ns != sent_ns:
            continue
        half = (back_ns - sent_ns) // 2
        if best is None or half < best.uncertainty_ns:
            best = Offset(reply.t_server_ns - sent_ns - half, half)
    return best


async def follow_hub(bus: Bus, clock: SystemClock, node: str, period_s: float = PERIOD_S) -> None:
    """Keep `clock` on the hub's time and publish how far it was off, until cancelled.

    A measurement that lies within its own uncertainty corrects nothing: following it would only add its noise.
    """
    publication = bus.publish(BY_NAME["clock_offset"], node=node)
    reachable = True
    while True:
        offset = await measure_offset(bus, clock)
        if (offset is not None) != reachable:
            reachable = offset is not None
            log.warning("clock hub=%s", "answers" if reachable else "silent")
        if offset is not None:
            if abs(offset.offset_ns) > offset.uncertainty_ns:
                clock.adjust(offset.offset_ns)
            message = ClockOffset(node=node, offset_ns=offset.offset_ns, uncertainty_ns=offset.uncertainty_ns)
            message.header.t_ns = clock.now_ns()
            publication.put(message)
        await asyncio.sleep(period_s)
