"""Any bytes at all, a hundred thousand times each: parsers neither fail nor invent, and find the next record.

Hypothesis draws what is spliced and a seed; each drawn case is cut, spliced and flipped in many ways. `make fuzz` draws a
million: VISTEL_FUZZ_EXAMPLES says how many inputs each parser gets.
"""

from __future__ import annotations

import math
import os
import random
from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

VARIANTS = 500
CASES = max(1, int(os.environ.get("VISTEL_FUZZ_EXAMPLES", "100000")) // VARIANTS)
fuzz = settings(max_examples=CASES, deadline=None, database=None, suppress_health_check=[HealthCheck.too_slow])

Case = tuple[list[bytes], int]
"""Pieces and a seed."""


class Parser(Protocol):
    def feed(self, data: bytes, t_ns: int, /) -> Sequence[object]: ...


def pieces(*known: bytes, longest: int = 24) -> st.SearchStrategy[Case]:
    """Known bytes and any, up to six of them."""
    some = st.one_of(st.sampled_from(known), st.binary(max_size=longest))
    return st.tuples(st.lists(some, max_size=6), st.integers(0, 2**32))


def variants(case: Case) -> Iterator[bytes]:
    """The pieces as they are, then in other orders, cut, with bytes changed."""
    parts, seed = case
    rand = random.Random(seed).random  # the one drawing that costs little
    yield b"".join(parts)
    for _ in range(VARIANTS - 1):
        picked = [p[int(rand() * (len(p) + 1)) :] if rand() < 0.3 else p for p in parts if rand() < 0.8]
        for i in range(len(picked) - 1, 0, -1):
            j = int(rand() * (i + 1))
            picked[i], picked[j] = picked[j], picked[i]
        out = bytearray().join(picked)
        if out:
            for _ in range(int(rand() * 3)):
                out[int(rand() * len(out))] = int(rand() * 256)
        yield bytes(out)


def check(parser: Parser, garbage: bytes, record: bytes, sound: Callable[[object], bool], opening: bytes = b"") -> None:
    """What is found in `garbage`, read in two parts, is sound; of three records after it at least the last two are found.

    opening: what a device says once, before its records.
    """
    feed = parser.feed
    third = len(garbage) // 3
    for found in (feed(garbage[:third], 10**9), feed(garbage[third:], 2 * 10**9)):
        for one in found:
            assert sound(one), (garbage, one)
    first, second, last = feed(opening + record, 3 * 10**9), feed(record, 3 * 10**9 + 1), feed(record, 3 * 10**9 + 2)
    assert len(first) + len(second) + len(last) >= 2, garbage
    assert len(last) == 1 and sound(last[0]), garbage


def true_pose(position: Sequence[float], rotation: Sequence[float], most_m: float) -> bool:
    """Finite, not farther away than `most_m`, and a unit quaternion: comparisons with NaN are false."""
    x, y, z = position
    return abs(x) <= most_m and abs(y) <= most_m and abs(z) <= most_m and abs(math.hypot(*rotation) - 1.0) < 1e-9
