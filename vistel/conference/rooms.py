"""The room of a conference: the built-in one or one from a file, and what was put into it."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vistel.conference.model import Room as RoomKeys
from vistel.conference.model import RoomThing
from vistel.figure.rotation import matrix_from_quaternion, quaternion_from_matrix, rotation_y
from vistel.space.commands.reshape import painted
from vistel.space.files.faults import RoomFileError
from vistel.space.files.interior import Interior
from vistel.space.files.load import load_room, load_seats, load_things
from vistel.space.files.surfaces import height_at, in_room, pieces_of
from vistel.space.room import TABLE_HEIGHT, Seat, meeting_room, seat_pose
from vistel.space.thing_json import from_thing
from vistel.space.things import Thing

__all__ = ["RoomFileError", "interior_of", "seat_place", "seats_of"]

F64 = NDArray[np.float64]


def interior_of(keys: RoomKeys) -> Interior:
    """The room with all that is in it, and what its things look like. Raises RoomFileError (one line)."""
    if keys.file is None:
        out = Interior(meeting_room(keys.seats, keys.extras()))
    else:
        out = load_room(keys.file)
        out = replace(out, room=replace(out.room, seats=seats_of(keys)))
        extras = tuple(_lying(e.thing(), out) for e in keys.extras())
        out = out.with_things((*out.room.things, *extras))
    for entry in keys.things:
        if entry.file is not None:
            out = _with_file(out, entry)
    return replace(out, room=replace(out.room, source=_source(out))) if keys.from_files else out


def seats_of(keys: RoomKeys) -> tuple[Seat, ...]:
    """The seats: those of the room's file; where it has none, or there is no file, those round the built-in table."""
    if keys.file is not None and (own := _seats_in(keys.file, _stamp(keys.file))):
        return own
    return tuple(Seat(*seat_pose(keys.seats, i)) for i in range(keys.seats))


def seat_place(keys: RoomKeys, index: int) -> tuple[F64, float]:
    """Position (3,) on the floor under a seat [m] and heading [rad]. Raises ValueError for no such seat."""
    seats = seats_of(keys) if keys.file is not None else ()
    if not seats:
        return seat_pose(keys.seats, index)
    if not 0 <= index < len(seats):
        raise ValueError(f"seat: expected 0 to {len(seats) - 1}, got {index}")
    return seats[index].position, seats[index].heading


@lru_cache(4)
def _seats_in(file: Path, stamp: int) -> tuple[Seat, ...]:
    return load_seats(file)


def _stamp(file: Path) -> int:
    try:
        return file.stat().st_mtime_ns
    except OSError:
        return 0


def _with_file(interior: Interior, entry: RoomThing) -> Interior:
    """The room with what is in the file of `entry`."""
    assert entry.file is not None
    found = load_things(entry.file, fixed=entry.fixed)
    things = found.room.things
    turn = rotation_y(math.radians(entry.turn))
    low, high = _box(found)
    middle = 0.5 * (low + high) * (1.0, 0.0, 1.0)
    x, z = entry.at
    stands = all(t.fixed for t in things)
    floor = 0.0 if stands else height_at(interior.room.things, interior.models, x, z)
    out: list[Thing] = []
    for t in things:
        spot = turn @ (t.position - middle - (0.0, low[1], 0.0)) + (x, floor, z)
        name = (entry.name or entry.id) if len(things) == 1 else f"{entry.name} {t.name}".strip()
        out.append(replace(
            t, id=entry.id if len(things) == 1 else f"{entry.id}-{t.id}", name=name, position=spot,
            rotation=quaternion_from_matrix(turn @ matrix_from_quaternion(t.rotation)),
            mass=t.mass if entry.mass is None or t.fixed else entry.mass,
            compliance=t.compliance if entry.rigidity is None else 1.0 - entry.rigidity,
        ))  # fmt: skip
    if entry.colour is not None:
        out = [painted(t, int(entry.colour[1:] + "ff", 16)) for t in out]
    whole = interior.with_things((*interior.room.things, *out), found.models)
    return replace(whole, notes=(*interior.notes, *(f"{entry.id}: {note}" for note in found.notes)))


def _box(interior: Interior) -> tuple[F64, F64]:
    """Lowest and highest corner of all that is drawn of a room's things [m]."""
    points = [in_room(t, p.surface) for t in interior.room.things for p in pieces_of(t, interior.models)]
    every = np.concatenate(points)
    return every.min(axis=0), every.max(axis=0)


def _lying(thing: Thing, interior: Interior) -> Thing:
    """A thing for the built-in table, on what stands in this room at its place."""
    x, _, z = thing.position.tolist()
    height = height_at(interior.room.things, interior.models, x, z)
    return replace(thing, position=np.array([x, thing.position[1] - TABLE_HEIGHT + height, z]))


def _source(interior: Interior) -> str:
    """What tells this room from others in a snapshot."""
    seats = [[s.position.tolist(), s.heading] for s in interior.room.seats]
    text = json.dumps([seats, [from_thing(t) for t in interior.room.things]])
    return hashlib.sha256(text.encode()).hexdigest()[:32]
