"""Which place runs which room, so that no place has much more to do than another."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

STEP_CORES = 0.17
"""What a world costs with nobody in it: 60 steps a second (docs/explanation/scale.md)."""
LEAST_RELIEF = 1e-6
"""What a move brings at least [cores]: sums of loads are not exact."""
PERSON_CORES = 0.01
"""What each person adds to it: their part of a step, and reading their motion."""


@dataclass(frozen=True)
class PlacedRoom:
    """A room, how many people take part, the place that leads it (empty: none), and the places where a world of it is."""

    name: str
    people: int
    at: str
    places: frozenset[str]

    @property
    def cores(self) -> float:
        """Processor cores that its world needs."""
        return STEP_CORES + PERSON_CORES * self.people


@dataclass(frozen=True)
class Relocation:
    """A room that is to be moved, and where to."""

    room: str
    place: str


def loads(rooms: Sequence[PlacedRoom]) -> dict[str, float]:
    """The cores that the worlds of each place need, those of places without a room included."""
    found = dict.fromkeys(sorted({place for room in rooms for place in (*room.places, room.at) if place}), 0.0)
    for room in rooms:
        if room.at:
            found[room.at] += room.cores
    return found


def relocations(rooms: Sequence[PlacedRoom], drained: Collection[str] = ()) -> list[Relocation]:
    """Moves after which no place of `drained` leads a room that can be elsewhere, every room is led where that is possible, and no
    further move would make the busier of two places less busy. Each room moves once at most; the same rooms give the same moves."""
    plan = _Plan(rooms, frozenset(drained))
    for room in sorted(rooms, key=lambda room: (-room.cores, room.name)):
        if not room.at or room.at in drained:
            plan.relocate(room, plan.least_busy(room))
    while plan.relieve():
        pass
    return [Relocation(room.name, plan.at[room.name]) for room in rooms if plan.at[room.name] != room.at]


class _Plan:
    """Where rooms are to be."""

    def __init__(self, rooms: Sequence[PlacedRoom], drained: frozenset[str]) -> None:
        self._drained = drained
        self.at = {room.name: room.at for room in rooms}
        self._load = loads(rooms)
        self._settled = {place: [room for room in rooms if room.at == place] for place in self._load.keys() - drained}
        """The rooms of each place that were there at first and have not moved."""

    def least_busy(self, room: PlacedRoom) -> str:
        """Of the other places where a world of it is, the one that has least to do; empty: there is none."""
        return min(sorted(room.places - self._drained - {self.at[room.name]}), key=self._load.__getitem__, default="")

    def relocate(self, room: PlacedRoom, to: str) -> None:
        """Lead it there; empty: leave it."""
        if not to:
            return
        if self.at[room.name]:
            self._load[self.at[room.name]] -= room.cores
        self._load[to] += room.cores
        self.at[room.name] = to

    def relieve(self) -> bool:
        """Make the move that relieves the busiest place most, of those that have a room to give; False where none does."""
        for here in sorted(self._settled, key=lambda place: (-self._load[place], place)):
            better: list[tuple[float, str, str, PlacedRoom]] = []
            for room in self._settled[here]:
                to = self.least_busy(room)
                then = self._load[to] + room.cores if to else float("inf")
                if then < self._load[here] - LEAST_RELIEF:
                    better.append((then, room.name, to, room))
            if better:
                *_, to, room = min(better, key=lambda move: move[:2])
                self._settled[here].remove(room)
                self.relocate(room, to)
                return True
        return False
