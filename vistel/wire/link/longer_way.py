"""Whether messages that take longer than before wait in a queue, or go a longer way.

A long question takes longer than a short one by what its bytes take to pass the thinnest part of the link. Where that is next to
nothing the link has room, and to send less makes nothing quicker: the way became longer, or others fill the link.
"""

from itertools import pairwise
from statistics import median

LONG_BYTES = 1000
"""Of padding in a long question: with what is round it, it is still one packet."""
LONG_ONES = 5
"""So many are compared, each with the short ones before and after it: a queue grows or shrinks meanwhile."""
SAME_S = 0.012
"""A link on which LONG_BYTES take longer is thin: below 670 kbit/s, about what a site with devices and a voice sends [s]."""
PATIENCE_NS = 3_000_000_000
"""What took longer for so long is tried; where it was a queue, the next trial waits twice as long, up to LONGEST_NS [ns]."""
LONGEST_NS = 96_000_000_000


class LongerWay:
    """Chooses which questions are long, and judges by their answers."""

    def __init__(self) -> None:
        self._patience_ns = PATIENCE_NS
        self._since_ns: int | None = None
        self._begin_trial()

    def _begin_trial(self) -> None:
        self._asks_long = False
        self._took = list[tuple[bool, float]]()
        """Of each question: whether it was long, and what it took beyond the shortest way known [s]."""

    def asks_long(self, in_vain: bool, now_ns: int) -> bool:
        """Whether the next question shall be long. in_vain: something gives way, and yet messages take longer than before."""
        if not in_vain:
            self._since_ns, self._patience_ns = None, PATIENCE_NS
            self._begin_trial()
            return False
        if self._since_ns is None:
            self._since_ns = now_ns
        self._asks_long = not self._asks_long and now_ns - self._since_ns >= self._patience_ns
        return self._asks_long

    def answered(self, long: bool, took_s: float, now_ns: int) -> bool:
        """Whether the way is found to be longer, by the answer to one more question, which took `took_s` more than the shortest."""
        if self._since_ns is None or now_ns - self._since_ns < self._patience_ns:
            return False
        self._took.append((long, took_s))
        more_s = [
            long_s - 0.5 * (before_s + after_s)
            for ((before, before_s), (is_long, long_s)), (_, (after, after_s)) in pairwise(pairwise(self._took))
            if is_long and not before and not after
        ]
        if len(more_s) < LONG_ONES:
            return False
        self._begin_trial()
        self._since_ns, self._patience_ns = now_ns, min(2 * self._patience_ns, LONGEST_NS)
        return median(more_s) < SAME_S
