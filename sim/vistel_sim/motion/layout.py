"""The room of a choreography: heights of tables, distances of seats, the baton."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from vistel.arrays import F64
from vistel.conference.model import RoomConfig as RoomKeys
from vistel.conference.room_things import extras_of
from vistel.conference.seats import seat_place
from vistel.space.files.faults import RoomFileError
from vistel.space.files.surfaces import height_at
from vistel.space.room import BATON, TABLE_HEIGHT, Room, Seat, meeting_room
from vistel.space.things.things import Thing

LAP = 0.60
"""Height of the hands of who sits at no table [m]."""
ARMS_MEET = 1.6
"""Largest distance of seats from which people reach each other's hands [m]."""
NEAR_ENOUGH = 0.75
"""Largest distance from the seat of a thing that can be taken [m]."""


@dataclass(frozen=True, eq=False)
class Layout:
    """room: at its beginning; height: (x, z) [m] -> height of what stands there [m], 0 for nothing."""

    room: Room
    height: Callable[[float, float], float]

    @property
    def seats(self) -> int:
        return len(self.room.seats)

    def table(self, place: F64) -> float:
        """Height at which hands lie at a point (3,): on what stands there, else in the lap [m]."""
        return max(LAP, self.height(float(place[0]), float(place[2])))

    def thing(self, thing_id: str) -> Thing | None:
        """The loose thing of that id, if there is one."""
        found = self.room.by_id.get(thing_id)
        return None if found is None or found.fixed else found

    def baton_for(self, seat: F64) -> Thing | None:
        """The baton, if there is one that can be taken from a seat at (3,)."""
        baton = self.thing(BATON)
        return baton if baton is not None and _apart(baton.position, seat) < NEAR_ENOUGH else None

    def meet(self, a: F64, b: F64) -> bool:
        """Whether people on seats at a and b (3,) reach each other's hands."""
        return _apart(a, b) <= ARMS_MEET


def built_in(seats: int) -> Layout:
    """The built-in meeting room."""
    return Layout(meeting_room(seats), lambda x, z: TABLE_HEIGHT)


def layout_of(keys: RoomKeys) -> Layout:
    """The room of a conference. If its files are missing, only the seats are known, and tables are as high as the built-in
    one."""
    if not keys.from_files:
        return Layout(meeting_room(keys.seats, extras_of(keys)), lambda x, z: TABLE_HEIGHT)
    from vistel.conference.rooms import interior_of  # noqa: PLC0415  only for rooms from files

    try:
        whole = interior_of(keys)
    except RoomFileError:  # the renderer reports it
        seats = tuple(Seat(*seat_place(keys, n)) for n in range(keys.seats))
        return Layout(Room(seats, ()), lambda x, z: TABLE_HEIGHT)
    if not any(t.fixed for t in whole.room.things):
        return Layout(whole.room, lambda x, z: TABLE_HEIGHT)
    known: dict[tuple[float, float], float] = {}

    def height(x: float, z: float) -> float:
        if (x, z) not in known:
            known[x, z] = height_at(whole.room.things, whole.models, x, z)
        return known[x, z]

    return Layout(whole.room, height)


def _apart(a: F64, b: F64) -> float:
    return math.hypot(float(a[0] - b[0]), float(a[2] - b[2]))
