"""Spans of time in which something was so, and for how long two logs differ in them."""

from collections.abc import Hashable, Iterable
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)


class Intervals(Generic[Key]):
    """When each of some states held: `edges` has the times [s] at which it began, ended, began again, in turn."""

    def __init__(self) -> None:
        self.edges: dict[Key, list[float]] = {}
        self._now: frozenset[Key] = frozenset()

    def note(self, t: float, now: frozenset[Key]) -> None:
        """From `t` [s] on, which is later than the last, the states `now` hold and no others."""
        if now != self._now:
            for key in now ^ self._now:
                self.edges.setdefault(key, []).append(t)
            self._now = now

    def within(self, key: Key, begin: float, end: float) -> list[float]:
        """The edges of a state, an even number, cut to `begin` .. `end` [s]."""
        edges = self.edges.get(key, [])
        whole = [*edges, end] if len(edges) % 2 else edges
        return [min(max(t, begin), end) for t in whole]


def seconds(edges: Iterable[float]) -> float:
    """How long something held [s]: the sum of its spans. Of the edges of two together: how long only one of them did."""
    times = sorted(edges)
    return sum(times[1::2]) - sum(times[::2])
