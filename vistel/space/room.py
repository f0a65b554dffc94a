"""The built-in meeting room: a round table, chairs, and things on the table to take and hand over.

Room frame: right-handed, metres, Y up, floor at y = 0, table centre at x = z = 0.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vistel.arrays import F64
from vistel.space.boards.board import SHAPE as BOARD
from vistel.space.boards.board import board, facing_middle
from vistel.space.joints.joint import Joint
from vistel.space.things.things import Z_UP, GraspAxis, PhysicsMaterial, Thing, ThingPrimitive

TABLE_HEIGHT = 0.72
"""Height of the table's upper surface above the floor [m]."""
TABLE_THICKNESS = 0.03
CHAIR_HEIGHT = 0.425
"""Height of a chair's seat above the floor [m]."""
SEAT_GAP = 0.28
"""From the table's edge to the seats' centres [m]."""
ELBOW_ROOM = 0.60
"""Least arc between two seats [m]."""
MOST_ROUND = 40
"""Seats round one table, which then fills the room; of more, TABLE_SEATS are at a table and the others in rows round it."""
TABLE_SEATS = 14
ROW_GAP = 0.8
"""From one row of seats to the next [m]."""
ROOM_RADIUS = 4.0
"""Things are kept within this distance of the table's centre [m]."""
HALF_WIDTH = 4.05
"""From the middle of the built-in room to each of its walls [m]."""

BATON = "baton"
"""Id of the thing that is handed over; it starts on a rest high enough for fingers to close round it."""
BATON_RADIUS = 0.012
"""[m]."""


@dataclass(frozen=True)
class Seat:
    """A seat: position (3,) on the floor [m]; heading about +Y, 0 faces +Z [rad]."""

    position: F64
    heading: float


SHAPES = ("ball", "lump", "bar", BOARD)


@dataclass(frozen=True)
class Extra:
    """A thing that a conference file puts on the table.

    shape: "ball", "lump" (a loaf, twice as long as wide) or "bar" (six times); size: its radius [m]; rigidity: 0 as
    soft as flesh .. 1 rigid; mass [kg]; colour: 0xRRGGBBAA; x, z: where on the table [m]; material. A "board" stands on the floor
    at x, z, and faces the table's centre; the rest says nothing of it.
    Raises ValueError for values out of range.
    """

    id: str
    name: str
    shape: str
    size: float
    mass: float
    rigidity: float
    colour: int
    x: float
    z: float
    material: PhysicsMaterial = field(default_factory=PhysicsMaterial)

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise ValueError(f"shape: expected one of {', '.join(SHAPES)}, got {self.shape!r}")
        if not (0.005 <= self.size <= 0.15 and 0.005 <= self.mass <= 20.0 and 0.0 <= self.rigidity <= 1.0):
            raise ValueError("expected a size of 0.005 to 0.15 m, a mass of 0.005 to 20 kg, a rigidity of 0 to 1")
        if not math.hypot(self.x, self.z) < ROOM_RADIUS:
            raise ValueError(f"x, z: expected a place within {ROOM_RADIUS:g} m of the table's centre")

    def thing(self) -> Thing:
        """The thing, lying on the table; a board on the floor."""
        if self.shape == BOARD:
            return facing_middle(board(self.id, self.name), self.x, self.z)
        r = self.size
        half = {"ball": 0.0, "lump": r, "bar": 5.0 * r}[self.shape]
        body = _bar((-half, 0.0, 0.0), (half, 0.0, 0.0), r, r) if half else ThingPrimitive("sphere", (r,))
        axes = (GraspAxis(_at(0, 0, 0), _at(1, 0, 0), r),) if half else ()
        place = _at(self.x, TABLE_HEIGHT + r, self.z)
        return Thing(
            self.id,
            self.name,
            self.shape,
            (body,),
            self.mass,
            1.0 - self.rigidity,
            self.colour,
            place,
            axes=axes,
            material=self.material,
        )


@dataclass(frozen=True, eq=False)
class Room:
    """A room at its beginning: seats, and things in a fixed order; extras: the things that the conference file added; joints: on
    which some things hang.

    source: digest of its files, empty for the built-in room; shell: whether it has the built-in floor, walls and ceiling.
    """

    seats: tuple[Seat, ...]
    things: tuple[Thing, ...]
    extras: tuple[Extra, ...] = ()
    source: str = ""
    shell: bool = True
    joints: tuple[Joint, ...] = ()

    @cached_property
    def by_id(self) -> dict[str, Thing]:
        """Things by their ids."""
        return {thing.id: thing for thing in self.things}

    def thing(self, thing_id: str) -> Thing:
        """The thing with that id. Raises KeyError."""
        return self.by_id[thing_id]


def seat_radius(seats: int) -> float:
    """Distance from the table's centre of the seats at it [m]; grows when more people need elbow room."""
    return max(0.78, ELBOW_ROOM * (seats if seats <= MOST_ROUND else TABLE_SEATS) / (2.0 * math.pi))


def table_radius(seats: int) -> float:
    """Radius of the table [m]: 0.5 for up to eight people."""
    return seat_radius(seats) - SEAT_GAP


def seat_pose(seats: int, index: int) -> tuple[F64, float]:
    """Position (3,) on the floor under seat `index` of `seats` [m] and heading [rad], facing the centre.

    Seat 0 is at -Z and faces +Z; the others follow with rising heading, row by row. Raises ValueError for no such seat.
    """
    if not 0 <= index < seats:
        raise ValueError(f"seat: expected 0 to {seats - 1}, got {index}")
    first, radius, row = 0, seat_radius(seats), seats if seats <= MOST_ROUND else TABLE_SEATS
    while index >= first + row:
        first, radius = first + row, radius + ROW_GAP
        row = min(seats - first, math.floor(2.0 * math.pi * radius / ELBOW_ROOM))
    heading = 2.0 * math.pi * (index - first) / row
    # + 0.0 turns -0.0 into 0.0, so that equal places print and hash alike.
    position = np.array([-radius * math.sin(heading), 0.0, -radius * math.cos(heading)]) + 0.0
    return position, heading


def meeting_room(seats: int = 3, extras: Sequence[Extra] = ()) -> Room:
    """A table with `seats` chairs; on it a baton on a rest, a ball, a box, a can, a ring, a cone, a tile, and extras.

    Raises ValueError for an extra whose id another thing has.
    """
    places = tuple(Seat(*seat_pose(seats, i)) for i in range(seats))
    spread = table_radius(seats) / 0.5
    fixed = (_table(table_radius(seats)), *(_chair(i, seat) for i, seat in enumerate(places)))
    things = fixed + _loose_things(spread) + tuple(e.thing() for e in extras)
    ids = [t.id for t in things]
    if len(set(ids)) < len(ids):
        twice = next(i for i in ids if ids.count(i) > 1)
        raise ValueError(f"things: {twice!r} stands in the room already; give it another id")
    return Room(places, things, tuple(extras))


def _turn(axis: tuple[float, float, float], angle: float) -> F64:
    s = math.sin(angle / 2.0)
    return np.array([axis[0] * s, axis[1] * s, axis[2] * s, math.cos(angle / 2.0)])


def _at(x: float, y: float, z: float) -> F64:
    return np.array([x, y, z], np.float64)


def _disc(radius: float, half_height: float, centre: F64, e1: float = 0.1) -> ThingPrimitive:
    return ThingPrimitive("superellipsoid", (radius, radius, half_height, e1, 1.0), centre, Z_UP)


def _bar(a: tuple[float, float, float], b: tuple[float, float, float], ra: float, rb: float) -> ThingPrimitive:
    return ThingPrimitive("cone_sphere", (*a, *b, ra, rb))


def _table(radius: float) -> Thing:
    top = _disc(radius, TABLE_THICKNESS / 2.0, _at(0.0, TABLE_HEIGHT - TABLE_THICKNESS / 2.0, 0.0))
    column = _bar((0.0, 0.05, 0.0), (0.0, TABLE_HEIGHT - 0.06, 0.0), 0.045, 0.035)
    foot = _disc(0.22, 0.015, _at(0.0, 0.015, 0.0), e1=0.4)
    return Thing("table", "round table", "table", (top, column, foot), 0.0, 0.0, 0xB08254FF, _at(0, 0, 0))


def _chair(index: int, seat: Seat) -> Thing:
    """In the seat's frame: the seat under the person, the back behind (-Z), four legs."""
    middle = _at(0.0, CHAIR_HEIGHT - 0.022, 0.0)
    cushion = ThingPrimitive("superellipsoid", (0.21, 0.20, 0.022, 0.4, 0.35), middle, Z_UP)
    lean = _turn((1.0, 0.0, 0.0), -math.radians(8.0))
    back = ThingPrimitive("superellipsoid", (0.19, 0.16, 0.016, 0.4, 0.4), _at(0.0, 0.72, -0.235), lean)
    legs = tuple(
        _bar((x * 0.16, CHAIR_HEIGHT - 0.04, z * 0.15), (x * 0.19, 0.012, z * 0.18), 0.016, 0.012)
        for x in (-1.0, 1.0)
        for z in (-1.0, 1.0)
    )
    posts = tuple(_bar((x * 0.15, CHAIR_HEIGHT - 0.03, -0.17), (x * 0.15, 0.64, -0.225), 0.013, 0.011) for x in (-1.0, 1.0))
    return Thing(
        f"chair-{index}",
        f"chair {index + 1}",
        "chair",
        (cushion, back, *legs, *posts),
        0.0,
        0.1,
        0x46566BFF,
        seat.position,
        _turn((0.0, 1.0, 0.0), seat.heading),
    )


def _loose_things(spread: float) -> tuple[Thing, ...]:
    """The things on the table, clear of the resting hands; `spread` stretches the layout with the table."""
    top = TABLE_HEIGHT

    def place(x: float, height: float, z: float) -> F64:
        return _at(x * spread, top + height, z * spread)

    return (
        *_baton_on_rest(place(-0.05, 0.055, -0.18), 0.055),
        _ball(place(0.14, 0.038, -0.06)),
        _box(place(0.03, 0.030, 0.0)),
        _can(place(0.10, 0.055, 0.10)),
        _ring(place(-0.13, 0.011, -0.03)),
        _cone(place(-0.06, 0.0, 0.12)),
        _tile(place(0.01, 0.009, 0.24)),
    )


def _baton_on_rest(centre: F64, height: float) -> tuple[Thing, Thing]:
    """The baton's axis lies `height` above the table, so that fingers close under it clear of the table."""
    half, radius, tip = 0.088, BATON_RADIUS, 0.005
    # Posts in two pairs form notches: each tip stands `radius + tip` from the baton's axis, 50 degrees aside.
    aside = math.radians(50.0)
    beside, below = (radius + tip) * math.sin(aside), (radius + tip) * math.cos(aside)
    posts = tuple(
        _bar((x, 0.006 - height, z * 1.6 * beside), (x, -below, z * beside), 0.007, tip)
        for x in (-0.078, 0.078)
        for z in (-1.0, 1.0)
    )
    rest = Thing("rest", "baton rest", "rest", posts, 0.0, 0.0, 0x5A4636FF, centre)
    bar = _bar((-half, 0.0, 0.0), (half, 0.0, 0.0), radius, radius)
    axis = GraspAxis(_at(0, 0, 0), _at(1, 0, 0), radius)
    return rest, Thing(BATON, "red baton", "baton", (bar,), 0.08, 0.05, 0xC23B32FF, centre, axes=(axis,))


def _ball(centre: F64) -> Thing:
    body = ThingPrimitive("sphere", (0.038,))
    return Thing("ball", "yellow ball", "ball", (body,), 0.12, 0.35, 0xE8B923FF, centre)


def _box(centre: F64) -> Thing:
    body = ThingPrimitive("superellipsoid", (0.045, 0.030, 0.032, 0.2, 0.2))
    axes = (GraspAxis(_at(0, 0, 0), _at(1, 0, 0), 0.031), GraspAxis(_at(0, 0, 0), _at(0, 1, 0), 0.038))
    turn = _turn((0.0, 1.0, 0.0), math.radians(20.0))
    return Thing("box", "blue box", "box", (body,), 0.25, 0.02, 0x2F6DB5FF, centre, turn, axes)


def _can(centre: F64) -> Thing:
    body = ThingPrimitive("superellipsoid", (0.032, 0.032, 0.055, 0.1, 1.0))
    axes = (GraspAxis(_at(0, 0, 0), _at(0, 0, 1), 0.032),)
    return Thing("can", "green can", "cylinder", (body,), 0.30, 0.02, 0x3F9C5AFF, centre, Z_UP, axes)


def _ring(centre: F64) -> Thing:
    tube, radius = 0.011, 0.046
    body = ThingPrimitive("supertoroid", (tube, tube, tube, radius / tube, 1.0, 1.0))
    axes = tuple(
        GraspAxis(_at(x * radius, y * radius, 0.0), _at(-y, x, 0.0), tube)
        for x, y in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
    )
    return Thing("ring", "violet ring", "ring", (body,), 0.07, 0.10, 0x8A56B0FF, centre, Z_UP, axes)


def _cone(foot: F64) -> Thing:
    """Lies on its side: its axis leans by the angle whose sine is (big - small) / length."""
    big, small, length = 0.034, 0.009, 0.085
    middle = 0.34 * length
    lean = math.asin((big - small) / length)
    body = _bar((-middle, 0.0, 0.0), (length - middle, 0.0, 0.0), big, small)
    position = foot + _at(0.0, big - middle * math.sin(lean), 0.0)
    axes = (GraspAxis(_at(0, 0, 0), _at(1, 0, 0), 0.026),)
    turn = _turn((0.0, 0.0, 1.0), -lean)
    return Thing("cone", "orange cone", "cone", (body,), 0.09, 0.05, 0xE0762BFF, position, turn, axes)


def _tile(centre: F64) -> Thing:
    angles = [k * math.pi / 3.0 for k in range(6)]
    corners = (c for a in angles for c in (0.042 * math.cos(a), 0.0, 0.042 * math.sin(a)))
    body = ThingPrimitive("rounded_polygon", (0.009, *corners))
    return Thing("tile", "white tile", "tile", (body,), 0.14, 0.0, 0xD9D4C7FF, centre)
