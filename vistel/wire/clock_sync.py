"""Conference time: the hub's clock, measured over the bus (Cristian 1989, "Probabilistic clock synchronization").

A probe asks the hub for its time; had the answer been read half-way through the round trip, the error of the offset is at most half
the round trip. Of several probes the one with the shortest round trip is the best, and half of that is the uncertainty reported.
"""

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass

from google.protobuf.message import DecodeError, Message

from vistel.v1.service_pb2 import ClockOffset, ClockProbe, ClockReply, SiteDigest
from vistel.wire.bus import Bus
from vistel.wire.clock import STEP_NS, Clock, SystemClock
from vistel.wire.owners import Owners
from vistel.wire.release import objection, release
from vistel.wire.topics import BY_NAME, MESSAGE_VERSION

log = logging.getLogger("vistel.clock")

PROBES = 8
PERIOD_S = 5.0
"""Two quartz clocks part by a quarter of a millisecond in that time, at most."""


MOST_STRANGERS = 16
"""Versions of sites that cannot be understood, which are told."""
PADDING_BYTES = 32 << 10
"""The longest padding of an answer."""
PADDING_BYTES_PER_S = 1 << 20
"""Of all answers together: what asks for more than that is no check of a link."""


@dataclass(frozen=True)
class Offset:
    """Add `offset_ns` to the measured clock to get the hub's; wrong by at most `uncertainty_ns`. objection: why this machine cannot
    meet a hub of that version, empty where it can."""

    offset_ns: int
    uncertainty_ns: int
    objection: str = ""


class ClocksBefore:
    """The clocks of a lower rank than a clock's own: true while one of them is there."""

    def __init__(self, bus: Bus, rank: int) -> None:
        self._site, self._rank = bus.site, rank
        self._there: set[str] = set()
        bus.watch_presence(self._seen)

    def __bool__(self) -> bool:
        return bool(self._there)

    def _seen(self, site: str, token: str, alive: bool) -> None:
        kind, _, number = token.partition("-")
        if site == self._site and kind == "clock" and number.isdigit() and int(number) < self._rank:
            (self._there.add if alive else self._there.discard)(token)


def serve_clock(bus: Bus, clock: Clock, rank: int = 0, owners: Owners | None = None) -> ClocksBefore:
    """Answer probes with `clock`'s time: the hub's part. rank: clocks of a lower rank, which are returned, come first, and this one
    answers while none of them is there. owners: of the hub's conference file, told to who asks."""
    first = ClocksBefore(bus, rank)
    strangers: set[str] = set()
    paddings = _Paddings(clock)

    def answer(request: bytes) -> Message | None:
        if first:
            return None
        probe = ClockProbe()
        try:
            probe.ParseFromString(request)
        except DecodeError:
            log.warning("clock probe ignored reason='%d bytes that are no ClockProbe'", len(request))
        theirs = probe.release[:32]
        if probe.message_version not in (0, MESSAGE_VERSION) and theirs not in strangers and len(strangers) < MOST_STRANGERS:
            strangers.add(theirs)
            log.error("site not understood release=%r here=%s reason='its messages differ' mend='update it'", theirs, release())
        now_ns = clock.now_ns()
        here = release()
        return ClockReply(
            t_client_ns=probe.t_client_ns,
            t_server_ns=now_ns,
            release=here,
            message_version=MESSAGE_VERSION,
            padding=paddings.take(probe.reply_bytes),
            sites=[SiteDigest(site=s, digest=d) for s, d in owners.digests().items()] if probe.sites and owners else (),
        )

    bus.serve(BY_NAME["clock"], answer)
    bus.announce(f"clock-{rank}")
    return first


class _Paddings:
    """Makes answers long, PADDING_BYTES_PER_S of them all together."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._left, self._filled_ns = float(PADDING_BYTES_PER_S), clock.steady_ns()

    def take(self, wanted: int) -> bytes:
        """As many bytes as are wanted, or as may be given now."""
        now_ns = self._clock.steady_ns()
        self._left = min(PADDING_BYTES_PER_S, self._left + (now_ns - self._filled_ns) * 1e-9 * PADDING_BYTES_PER_S)
        self._filled_ns = now_ns
        given = min(wanted, PADDING_BYTES, int(self._left))
        self._left -= given
        return bytes(given)


async def measure_offset(bus: Bus, clock: Clock, probes: int = PROBES) -> Offset | None:
    """The hub's clock against `clock`, from the best of `probes` round trips; None when the hub does not answer."""
    best: Offset | None = None
    missed = 0
    for _ in range(probes):
        sent_ns = clock.now_ns()
        probe = ClockProbe(t_client_ns=sent_ns, release=release(), message_version=MESSAGE_VERSION)
        reply: ClockReply | None = await bus.query(BY_NAME["clock"], probe)
        back_ns = clock.now_ns()
        missed += reply is None
        if missed > 1 and best is None:
            return None
        if reply is None or reply.t_client_ns != sent_ns:
            continue
        half = (back_ns - sent_ns) // 2
        if best is None or half < best.uncertainty_ns:
            best = Offset(reply.t_server_ns - sent_ns - half, half, objection(reply.release, reply.message_version))
    return best


async def other_sites(bus: Bus, owners: Owners) -> list[str]:
    """Sites to which the hub's conference file gives other people and things than `owners`, or that only one of both has. Empty
    where the hub does not say."""
    reply: ClockReply | None = await bus.query(BY_NAME["clock"], ClockProbe(sites=True, message_version=MESSAGE_VERSION))
    if reply is None or not reply.sites:
        return []
    here, there = owners.digests(), {each.site: each.digest for each in reply.sites}
    return sorted(site for site in here.keys() | there.keys() if here.get(site) != there.get(site))


async def set_clock(bus: Bus, clock: SystemClock, probes: int = PROBES) -> Offset | None:
    """Measure once and correct `clock`; None when the hub does not answer. A clock that is set at once is told.

    A measurement that lies within its own uncertainty corrects nothing: following it would only add its noise.
    """
    offset = await measure_offset(bus, clock, probes)
    if offset is not None and abs(offset.offset_ns) > offset.uncertainty_ns:
        clock.adjust(offset.offset_ns)
        if abs(offset.offset_ns) > STEP_NS:
            log.warning("clock set by_s=%.3f %s", offset.offset_ns * 1e-9, _why(clock))
    return offset


def machine_is_off(clock: SystemClock) -> str:
    """By how much the machine's own time differs from the conference's; empty where by less than STEP_NS."""
    ahead_s = clock.machine_off_ns * 1e-9
    off = abs(ahead_s) > STEP_NS * 1e-9
    return f"this machine's time is {abs(ahead_s):.1f} s {'ahead of' if ahead_s > 0 else 'behind'} the hub's" if off else ""


def _why(clock: SystemClock) -> str:
    if off := machine_is_off(clock):
        return f'reason="{off}" mend="corrected here; set the time of the machine that is wrong: timedatectl set-ntp true"'
    return "reason='the machine slept, or the hub was started again'"


async def follow_hub(
    bus: Bus, clock: SystemClock, node: str, period_s: float = PERIOD_S, measured: Callable[[Offset], object] = lambda _: None
) -> None:
    """Keep `clock` on the hub's time, publish how far it was off and tell `measured`, until cancelled."""
    publication = bus.publish(BY_NAME["clock_offset"], node=node)
    reachable, told = True, ""
    while True:
        offset = await set_clock(bus, clock)
        if (offset is not None) != reachable:
            reachable = offset is not None
            mend = "" if reachable else " mend='no clock is there; start one: vistel site clock FILE'"
            log.warning("clock hub=%s%s", "answers" if reachable else "silent", mend)
        if offset is not None:
            if offset.objection != told:
                told = offset.objection
                log.error("hub not understood reason=%r", told)
            message = ClockOffset(node=node, offset_ns=offset.offset_ns, uncertainty_ns=offset.uncertainty_ns)
            message.header.t_ns = clock.now_ns()
            publication.put(message)
            measured(offset)
        await asyncio.sleep(period_s)
