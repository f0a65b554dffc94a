"""10,000 people in 2,000 rooms: a simulation of how many cores they need and how evenly `vistel world spread` places them.

Simulated is what there are not the machines for: rooms begin and end at random, each with worlds at two places or three, a place
being one process on one core. What a room costs is measured (docs/explanation/scale.md) and an input here. Where a room is led is
decided by the product's own rule (`vistel.conference.placement`). The peer leads each room at the first of its places for all its
life.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from statistics import median

import numpy as np

from benchmarks.progress import part
from benchmarks.row import NONE_AT_ALL, Row, at_most
from vistel.conference.placement import PERSON_CORES, STEP_CORES, PlacedRoom, loads, relocations

ROOMS, PEOPLE_MEAN = 2000, 5.0
"""Rooms at a time, and the mean of those in one; at least two, at most twelve."""
LIFE_MIN, LASTING_MIN, SETTLE_MIN = 60.0, 240, 60
"""Mean life of a room, length of the simulation, and what of it does not count [minutes]."""
SPREAD_MIN = 10
"""How often rooms are spread [minutes]."""
FILLED = 0.6
"""Share of all cores that are needed."""
STEP_S = 1.0 / 60.0
STEPS_S, PLACES_LOOKED_AT, STEP_VARIES = 20.0, 60, 0.3
"""Steps are simulated so long, at so many places; standard deviation of the logarithm of a step's time."""
ROUTER_CORES_OF_5 = 0.08
"""Measured; it grows with those who send times those who receive."""
WORLDS = (2, 3)
"""At how many places there are worlds of a room."""
PEER = "first place, never moved"


def run() -> Iterator[Row]:
    """One row after the other."""
    for worlds in WORLDS:
        yield from _case(worlds)


def _case(worlds: int) -> Iterator[Row]:
    case = f"10,000 people in 2,000 rooms, simulated, worlds at {worlds} places for each"
    with part(f"worlds at {worlds} places"):
        ours, theirs = _Rooms(worlds, spread=True), _Rooms(worlds, spread=False)
        for minute in range(LASTING_MIN):
            for each in (ours, theirs):
                each.minute(minute)
        late = [float(np.percentile(each.late_ms(), 99)) for each in (ours, theirs)]
        left, taken = ours.drained()
    people = sum(room.people for room in ours.rooms.values())
    routers = sum(ROUTER_CORES_OF_5 * room.people * (room.people + 1) / 30.0 for room in ours.rooms.values())
    yield Row("rooms", case, "people at the end", "", people)
    yield Row("rooms", case, "worlds", "cores", sum(room.cores for room in ours.rooms.values()))
    yield Row("rooms", case, "routers", "cores", routers)
    yield Row("rooms", case, "places", "", ours.places)
    for share, metric in ((1.0, "busiest place"), (0.99, "99 of 100 places")):
        a, b = (float(np.quantile(each.seen, share)) for each in (ours, theirs))
        yield Row("rooms", case, f"{metric}, needed", "cores", a, PEER, b, target=at_most(1.0))
    yield Row("rooms", case, "moves of a room in an hour", "", ours.moves / (ROOMS * LASTING_MIN / 60.0))
    yield Row("rooms", case, "a step is done after, p99", "ms", late[0], PEER, late[1], target=at_most(1e3 * STEP_S))
    yield Row("rooms", case, "rooms left at a place that is drained", "", left, target=NONE_AT_ALL)
    yield Row("rooms", case, "a plan for all rooms", "ms", taken)


class _Rooms:
    """Rooms that come and go; the same for both, but where they are led."""

    def __init__(self, worlds: int, *, spread: bool) -> None:
        self._worlds, self._spread, self._rng = worlds, spread, np.random.default_rng(7)
        self.places = math.ceil(ROOMS * (STEP_CORES + PERSON_CORES * PEOPLE_MEAN) / FILLED)
        self.rooms: dict[str, PlacedRoom] = {}
        self.moves, self._number = 0, 0
        self.seen: list[float] = []
        """The load of each place at each minute that counts."""
        for _ in range(ROOMS):
            self._begin()

    def minute(self, minute: int) -> None:
        """Some rooms end, some begin; now and then all are spread."""
        ends = self._rng.random(len(self.rooms)) < 1.0 - math.exp(-1.0 / LIFE_MIN)
        self.rooms = {name: room for (name, room), over in zip(self.rooms.items(), ends, strict=True) if not over}
        for _ in range(int(self._rng.poisson(ROOMS / LIFE_MIN))):
            self._begin()
        if self._spread and minute % SPREAD_MIN == 0:
            for move in relocations([*self.rooms.values()]):
                self.rooms[move.room] = replace(self.rooms[move.room], at=move.place)
                self.moves += 1
        if minute >= SETTLE_MIN:
            load = loads([*self.rooms.values()])
            self.seen += [*load.values(), *([0.0] * (self.places - len(load)))]

    def _begin(self) -> None:
        self._number += 1
        places = [f"place-{n}" for n in self._rng.choice(self.places, self._worlds, replace=False)]
        people = int(np.clip(1 + self._rng.geometric(1.0 / (PEOPLE_MEAN - 1.0)), 2, 12))
        room = PlacedRoom(f"room-{self._number}", people, places[0], frozenset(places))
        if self._spread:
            load = loads([*self.rooms.values()])
            room = replace(room, at=min(places, key=lambda place: load.get(place, 0.0)))
        self.rooms[room.name] = room

    def late_ms(self) -> np.ndarray:
        """From when steps are due to when they are done, at some of the places: rooms take turns on a core."""
        rng = np.random.default_rng(11)
        at: dict[str, list[PlacedRoom]] = {}
        for room in self.rooms.values():
            at.setdefault(room.at, []).append(room)
        busiest = sorted(at.values(), key=lambda rooms: -sum(room.cores for room in rooms))
        late: list[float] = []
        for rooms in busiest[:: max(1, len(busiest) // PLACES_LOOKED_AT)]:
            steps = sorted(
                (float(due), room.cores * STEP_S)
                for room in rooms
                for due in rng.random() * STEP_S + STEP_S * np.arange(STEPS_S / STEP_S)
            )
            varied = rng.lognormal(-0.5 * STEP_VARIES**2, STEP_VARIES, len(steps))
            free = 0.0
            for (due, takes), factor in zip(steps, varied, strict=True):
                free = max(free, due) + takes * factor
                late.append(1e3 * (free - due))
        return np.array(late)

    def drained(self) -> tuple[int, float]:
        """Empties ten places, each by itself. How many rooms stayed, and the median time of a plan [ms]."""
        left, taken = 0, list[float]()
        for n in range(10):
            began = time.perf_counter()
            moves = {move.room: move.place for move in relocations([*self.rooms.values()], [f"place-{n}"])}
            taken.append(1e3 * (time.perf_counter() - began))
            left += sum(moves.get(room.name, room.at) == f"place-{n}" for room in self.rooms.values())
        return left, median(taken)
