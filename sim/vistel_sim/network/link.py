"""One direction of a simulated link: when what is sent arrives, if it does. It knows no sockets and no clock of its own.

Datagrams are lost, and some overtake others. A TCP stream loses nothing and keeps its order, so each lost segment holds back all
that follows it: it is sent again one round trip later, then after times that double (RFC 6298, RFC 8985), and the stream is no
faster than its losses allow (Mathis, Semke, Mahdavi and Ott 1997).
"""

import math
import random
from dataclasses import dataclass

SEGMENT_BYTES = 1460
"""Payload of a TCP segment on Ethernet."""
LEAST_TIMEOUT_S = 0.2
"""The shortest retransmission timeout of Linux [s]."""
LONGEST_TIMEOUT_S = 120.0
"""The longest one [s]."""
FIRST_TIMEOUT_S = 1.0
"""The timeout of a segment that opens a connection [s]."""
PROBE = 1.25
"""A lost segment is noticed after this many round trips, while others follow it (RFC 8985: a quarter for reordering)."""
MATHIS = math.sqrt(1.5)
"""Throughput is MATHIS * segment / (round trip * sqrt(loss))."""


@dataclass(frozen=True)
class Conditions:
    """What a link does to what it carries.

    delay_s: the shortest one-way delay; jitter_s: each packet takes up to this much longer, evenly spread, but waits for the one
    before it; loss: the part of packets that is lost, 0 to 1; reorder: the part that does not wait; bits_per_s: of the thinnest
    part; queue_bytes: what waits before that part, beyond it packets are dropped.
    """

    delay_s: float = 0.0
    jitter_s: float = 0.0
    loss: float = 0.0
    reorder: float = 0.0
    bits_per_s: float = math.inf
    queue_bytes: int = 64 * 1024

    def __post_init__(self) -> None:
        parts = 0.0 <= self.loss < 1.0 and 0.0 <= self.reorder <= 1.0
        if not (self.delay_s >= 0.0 and self.jitter_s >= 0.0 and self.bits_per_s > 0.0 and parts):
            raise ValueError(f"expected delays of 0 s or more, parts of packets from 0 to below 1, a rate above 0: {self}")

    @property
    def round_trip_s(self) -> float:
        """There and back, on average, over two such directions [s]."""
        return 2.0 * self.delay_s + self.jitter_s


class Link:
    """One direction. Times are seconds of any clock that never goes back."""

    def __init__(self, conditions: Conditions, rng: random.Random) -> None:
        self.conditions = conditions
        self._rng = rng
        self._free_s = -math.inf
        self._last_s = -math.inf
        self._cut_s: float | None = None

    @property
    def is_cut(self) -> bool:
        """Whether nothing passes."""
        return self._cut_s is not None

    def cut(self, now_s: float) -> None:
        """From now on nothing passes."""
        self._cut_s = now_s if self._cut_s is None else self._cut_s

    def heal(self, now_s: float) -> float:
        """From now on all passes. Returns when a stream that waits notices: its retransmissions have become rare."""
        since, self._cut_s = self._cut_s, None
        if since is None:
            return now_s
        again, timeout = since, max(LEAST_TIMEOUT_S, self.conditions.round_trip_s)
        while again < now_s:
            again += timeout
            timeout = min(2.0 * timeout, LONGEST_TIMEOUT_S)
        return again

    def datagram(self, size: int, now_s: float) -> float | None:
        """When a datagram of `size` bytes arrives that is sent now; None: never."""
        c = self.conditions
        if self.is_cut or self.waiting_bytes(now_s) > c.queue_bytes:
            return None
        left_s = self._pass(size, c.bits_per_s, now_s)
        if self._rng.random() < c.loss:
            return None
        arrives_s = left_s + c.delay_s + self._rng.uniform(0.0, c.jitter_s)
        if self._rng.random() < c.reorder:
            return arrives_s
        self._last_s = max(self._last_s, arrives_s)
        return self._last_s

    def segment(self, size: int, now_s: float) -> float:
        """When a segment of a TCP stream arrives, at most SEGMENT_BYTES, that is sent now. It never overtakes another one."""
        c = self.conditions
        arrives_s = self._pass(size, self.stream_bits_per_s(), now_s) + c.delay_s + self._rng.uniform(0.0, c.jitter_s)
        wait_s = PROBE * c.round_trip_s
        while self._rng.random() < c.loss:
            arrives_s += wait_s
            wait_s = min(max(LEAST_TIMEOUT_S, 2.0 * wait_s), LONGEST_TIMEOUT_S)
        self._last_s = max(self._last_s, arrives_s)
        return self._last_s

    def first(self, now_s: float) -> float:
        """When the segment arrives that opens a TCP connection, which is small: a lost one is sent again after 1, 2, 4 s ...
        (RFC 6298)."""
        c, wait_s = self.conditions, FIRST_TIMEOUT_S
        while self._rng.random() < c.loss:
            now_s += wait_s
            wait_s *= 2.0
        return now_s + c.delay_s + self._rng.uniform(0.0, c.jitter_s)

    def stream_bits_per_s(self) -> float:
        """What one TCP stream gets through."""
        c = self.conditions
        slowing = c.round_trip_s * math.sqrt(c.loss)
        return min(c.bits_per_s, MATHIS * 8.0 * SEGMENT_BYTES / slowing) if slowing else c.bits_per_s

    def waiting_bytes(self, now_s: float) -> float:
        """What waits before the thinnest part."""
        waits_s = self._free_s - now_s
        return waits_s * self.conditions.bits_per_s / 8.0 if waits_s > 0.0 else 0.0

    def _pass(self, size: int, bits_per_s: float, now_s: float) -> float:
        """When the last bit has left the thinnest part."""
        self._free_s = max(self._free_s, now_s) + 8.0 * size / bits_per_s
        return self._free_s
