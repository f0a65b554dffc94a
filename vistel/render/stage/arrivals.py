"""How late the frames of a stream come, and the shortest delay with which nearly all of them are in time.

A frame is in time when it is there before the point shown passes the frame before it: the picture then moves towards it without a
stop. So what a frame needs is the time from the capture of the one before it to its own arrival: the way over the network, the
interval between two frames, and what was lost between them.
"""

from bisect import bisect_left, bisect_right, insort
from collections import deque
from dataclasses import dataclass
from math import ceil

WINDOW_NS = 10_000_000_000
"""Arrivals that count: bursts that come again within ten seconds are expected again."""
MOST_KEPT = 1024
"""Arrivals kept at most: ten seconds at 100 frames a second."""
PAUSE_NS = 500_000_000
"""After so long without any frame the sender was silent or the link cut ..."""
SETTLING_NS = 250_000_000
"""... and for so long what comes does not count: a link that has been mended lets go what it had kept."""


@dataclass(frozen=True)
class AdaptiveDelay:
    """A delay that follows the network. in_time: the share of frames for which it is long enough; least_ns, most_ns: its bounds,
    behind the capture by a clock that is right."""

    in_time: float = 0.99
    least_ns: int = 0
    most_ns: int = 500_000_000


class Arrivals:
    """What the frames of one stream needed lately."""

    def __init__(self, rule: AdaptiveDelay) -> None:
        self._rule = rule
        self._kept: deque[tuple[int, int]] = deque()
        self._sorted: list[int] = []
        self._last_ns: int | None = None
        self._counts_from_ns = 0

    def anew(self) -> "Arrivals":
        """Nothing known yet, under the same rule."""
        return Arrivals(self._rule)

    def observe(self, before_ns: int | None, received_ns: int) -> None:
        """A frame came at `received_ns`; the one before it was captured at `before_ns`, None: there was none."""
        if self._last_ns is not None and received_ns - self._last_ns > PAUSE_NS:
            self._counts_from_ns = received_ns + SETTLING_NS
        self._last_ns = received_ns
        while self._kept and (received_ns - self._kept[0][0] > WINDOW_NS or len(self._kept) >= MOST_KEPT):
            del self._sorted[bisect_left(self._sorted, self._kept.popleft()[1])]
        if before_ns is not None and received_ns >= self._counts_from_ns:
            self._kept.append((received_ns, received_ns - before_ns))
            insort(self._sorted, received_ns - before_ns)

    def delay_ns(self, fastest_ns: int) -> int:
        """The shortest delay with which the wanted share of frames is in time, within its bounds. fastest_ns: the shortest transit
        lately; negative, or longer than the longest delay, where the sender's clock is off. What needs more than the longest
        delay beyond it is not waited for."""
        rule = self._rule
        right_ns = fastest_ns if fastest_ns < 0 else 0
        counted = bisect_right(self._sorted, max(fastest_ns, 0) + right_ns + rule.most_ns)
        needed_ns = self._sorted[max(0, ceil(rule.in_time * counted) - 1)] if counted else fastest_ns
        return max(right_ns + rule.least_ns, needed_ns)
