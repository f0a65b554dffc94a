"""How good the link to the hub is, measured with questions to its clock: round trips, losses, and the rate each way.

The link loses nothing that is asked: what a network loses is sent again, and the answer comes late, and those behind it. So losses
are estimated from answers that come as late as only that makes them.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.v1.service_pb2 import ClockProbe, ClockReply
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, sleep
from vistel.wire.clock_sync import PADDING_BYTES
from vistel.wire.release import release
from vistel.wire.topics import BY_NAME, MESSAGE_VERSION

QUESTIONS = 120
"""For round trips and losses."""
EVERY_S = 0.05
"""Between two of them [s]: about 40 kbit/s each way, which a slow link carries."""
ANSWER_S = 5.0
"""An answer that takes longer is none [s]."""
FIRST_BYTES = 4 << 10
"""With how much a rate is first measured; then with four times as much, and so on."""
MOST_BYTES = 256 << 10
"""With how much it is measured at most."""
CLEAR_S = 0.4
"""A transfer that takes so much longer than a round trip tells the rate [s]."""


@dataclass(frozen=True)
class LinkQuality:
    """round_trip_s: median; jitter_s: what 95 of 100 answers exceed it by at most; loss: part of the packets that was lost, 0 to 1,
    estimated; unanswered: questions; up_bit_s, down_bit_s: at least, to and from the hub; None: not measured."""

    round_trip_s: float
    jitter_s: float
    loss: float
    unanswered: int
    up_bit_s: float | None
    down_bit_s: float | None


async def measure_link(bus: Bus, clock: Clock) -> LinkQuality | None:
    """None where the hub's clock does not answer. Takes some ten seconds on a slow link, and about 0.7 MB."""
    if await _ask(bus, clock) is None:
        return None

    async def asked(after_s: float) -> float | None:
        await sleep(clock, after_s)
        return await _ask(bus, clock)

    answers = await asyncio.gather(*(asked(n * EVERY_S) for n in range(QUESTIONS)))
    took = np.array([s for s in answers if s is not None])
    if not len(took):
        return None
    median = float(np.median(took))
    return LinkQuality(
        round_trip_s=median,
        jitter_s=float(np.percentile(took, 95)) - median,
        loss=_losses(took) / (2 * QUESTIONS),
        unanswered=sum(s is None for s in answers),
        up_bit_s=await _rate(bus, clock, median, up=True),
        down_bit_s=await _rate(bus, clock, median, up=False),
    )


def _losses(took_s: F64) -> int:
    """How many packets were lost of those of questions and answers that took so long, in order.

    A packet that is sent again adds more than a round trip to its own answer at once, and less and less to those behind it. A
    jitter that is several times the delay cannot be told from that.
    """
    least = float(np.percentile(took_s, 10))
    return int(np.count_nonzero(np.diff(took_s, prepend=least) > max(0.6 * least, 0.01)))


async def _rate(bus: Bus, clock: Clock, round_trip_s: float, *, up: bool) -> float | None:
    """Bits a second, at least. None where an answer is missing or shorter than was asked for."""
    size = FIRST_BYTES
    while True:
        parts = max(1, size // PADDING_BYTES)
        each = size // parts
        begun_ns = clock.steady_ns()
        answers = await asyncio.gather(*(_ask(bus, clock, up=each if up else 0, down=0 if up else each) for _ in range(parts)))
        if None in answers:
            return None
        excess_s = (clock.steady_ns() - begun_ns) * 1e-9 - round_trip_s
        if excess_s > CLEAR_S or 4 * size > MOST_BYTES:
            return 8.0 * size / max(excess_s, 1e-3)
        size *= 4


async def _ask(bus: Bus, clock: Clock, up: int = 0, down: int = 0) -> float | None:
    """How long one answer took [s]; None where none came, or a shorter one than was asked for."""
    begun_ns = clock.steady_ns()
    probe = ClockProbe(
        t_client_ns=clock.now_ns(), release=release(), message_version=MESSAGE_VERSION, padding=bytes(up), reply_bytes=down
    )
    reply: ClockReply | None = await bus.query(BY_NAME["clock"], probe, ANSWER_S)
    if reply is None or len(reply.padding) < down:
        return None
    return (clock.steady_ns() - begun_ns) * 1e-9
