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
from vistel.wire.clock import STEP_NS, Clock, SystemClock
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


def serve_clock(bus: Bus, clock: Clock, rank: int = 0) -> None:
    """Answer probes with `clock`'s time: the hub's part. rank: clocks of a lower rank come first, and this one answers while none
    of them is there."""
    first: set[str] = set()

    def seen(site: str, token: str, alive: bool) -> None:
        kind, _, number = token.partition("-")
        if site == bus.site and kind == "clock" and number.isdigit() and int(number) < rank:
            (first.add if alive else first.discard)(token)

    def answer(request: bytes) -> Message | None:
        if first:
            return None
        probe = ClockProbe()
        try:
            probe.ParseFromString(request)
        except DecodeError:
            log.warning("clock probe ignored reason='%d bytes that are no ClockProbe'", len(request))
        return ClockReply(t_client_ns=probe.t_client_ns, t_server_ns=clock.now_ns())

    bus.serve(BY_NAME["clock"], answer)
    bus.announce(f"clock-{rank}")
    bus.watch_presence(seen)


async def measure_offset(bus: Bus, clock: Clock, probes: int = PROBES) -> Offset | None:
    """The hub's clock against `clock`, from the best of `probes` round trips; None when the hub does not answer."""
    best: Offset | None = None
    missed = 0
    for _ in range(probes):
        sent_ns = clock.now_ns()
        reply: ClockReply | None = await bus.query(BY_NAME["clock"], ClockProbe(t_client_ns=sent_ns))
        back_ns = clock.now_ns()
        missed += reply is None
        if missed > 1 and best is None:
            return None
        if reply is None or reply.t_client_ns != sent_ns:
            continue
        half = (back_ns - sent_ns) // 2
        if best is None or half < best.uncertainty_ns:
            best = Offset(reply.t_server_ns - sent_ns - half, half)
    return best


async def set_clock(bus: Bus, clock: SystemClock) -> Offset | None:
    """Measure once and correct `clock`; None when the hub does not answer. A clock that is set at once is told.

    A measurement that lies within its own uncertainty corrects nothing: following it would only add its noise.
    """
    offset = await measure_offset(bus, clock)
    if offset is not None and abs(offset.offset_ns) > offset.uncertainty_ns:
        clock.adjust(offset.offset_ns)
        if abs(offset.offset_ns) > STEP_NS:
            log.warning(
                "clock set by_s=%.3f uncertainty_s=%.3f %s", offset.offset_ns * 1e-9, offset.uncertainty_ns * 1e-9, why(clock)
            )
    return offset


def why(clock: SystemClock) -> str:
    """What a person does about a machine whose time differs from the conference's."""
    ahead_s = clock.machine_off_ns * 1e-9
    if abs(ahead_s) < STEP_NS * 1e-9:
        return "reason='the machine slept, or the hub was started again'"
    told = f"this machine is {abs(ahead_s):.1f} s {'ahead of' if ahead_s > 0 else 'behind'} the hub"
    return f"reason='{told}' mend='here it is corrected; set the time of the machine that is wrong: timedatectl set-ntp true'"


async def follow_hub(bus: Bus, clock: SystemClock, node: str, period_s: float = PERIOD_S) -> None:
    """Keep `clock` on the hub's time and publish how far it was off, until cancelled."""
    publication = bus.publish(BY_NAME["clock_offset"], node=node)
    reachable = True
    while True:
        offset = await set_clock(bus, clock)
        if (offset is not None) != reachable:
            reachable = offset is not None
            mend = "" if reachable else " mend='no clock is there; start one: vistel site clock FILE'"
            log.warning("clock hub=%s%s", "answers" if reachable else "silent", mend)
        if offset is not None:
            message = ClockOffset(node=node, offset_ns=offset.offset_ns, uncertainty_ns=offset.uncertainty_ns)
            message.header.t_ns = clock.now_ns()
            publication.put(message)
        await asyncio.sleep(period_s)
