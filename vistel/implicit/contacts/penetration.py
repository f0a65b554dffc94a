"""How deep two fields overlap: delta = max over space of min(F_a, F_b) - T (mathematics M3.4)."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.evaluation.program import compile
from vistel.implicit.graph.shape import Shape

FIRST = 24
"""Samples along a side of the first lattice."""
NEXT = 7
"""Samples along a side of the later lattices."""
ROUNDS = 7
"""Later lattices."""


@dataclass(frozen=True)
class Penetration:
    """depth: delta [field], 0 where the bodies do not overlap; point (3,): where both fields are largest [m]."""

    depth: float
    point: F64


def penetration(a: Shape, b: Shape, threshold: float = THRESHOLD) -> Penetration:
    """delta of two shapes, on lattices that close in on the largest value."""
    p, q = a.bounds, b.bounds
    low, high = np.maximum(p[0], q[0]), np.minimum(p[1], q[1])
    middle = (low + high) / 2
    if np.any(low >= high):
        return Penetration(0.0, middle)
    programs = compile(a, attributes=False), compile(b, attributes=False)
    half, count, best = (high - low) / 2, FIRST, -np.inf
    where = middle
    for _ in range(ROUNDS):
        # Odd counts hold the middle: a later lattice never does worse than the one before.
        lattices = [g.grid(middle - half, middle + half, count + 1 - count % 2, threads=1) for g in programs]
        least = np.minimum(*lattices)
        k = np.unravel_index(int(least.argmax()), least.shape)
        step = 2 * half / (least.shape[0] - 1)
        found = float(least[k])
        if found > best:
            best, where = found, middle - half + np.array(k) * step
        if best < threshold - 0.25 and count == FIRST:
            break  # the realms meet, the bodies are far from it
        middle, half, count = where, 1.5 * step, NEXT
    return Penetration(max(0.0, best - threshold), where)
