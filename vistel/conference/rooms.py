"""The room of a conference: the built-in one or one from a file, and what was put into it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from vistel.arrays import F64
from vistel.conference.model import Room as RoomKeys
from vistel.conference.model import RoomThing
from vistel.space.files.faults import RoomFileError
from vistel.space.files.interior import Interior
from vistel.space.files.load import load_room, load_seats
from vistel.space.files.place import FromFile, lying, put_into
from vistel.space.room import Seat, meeting_room, seat_pose
from vistel.space.things.json_values import from_thing

__all__ = ["RoomFileError", "interior_of", "seat_place", "seats_of"]


def interior_of(keys: RoomKeys) -> Interior:
    """The room with all that is in it, and what its things look like. Raises RoomFileError (one line)."""
    if keys.file is None:
        out = Interior(meeting_room(keys.seats, keys.extras()))
    else:
        out = load_room(keys.file)
        out = replace(out, room=replace(out.room, seats=seats_of(keys)))
        extras = tuple(lying(e.thing(), out) for e in keys.extras())
        out = out.with_things((*out.room.things, *extras))
    for entry in keys.things:
        if entry.file is not None:
            out, _ = put_into(out, _of(entry, entry.file))
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


def _of(entry: RoomThing, file: Path) -> FromFile:
    colour = None if entry.colour is None else int(entry.colour[1:] + "ff", 16)
    return FromFile(file, entry.id, entry.name, entry.at, entry.turn, entry.fixed, entry.mass, entry.rigidity, colour)


def _source(interior: Interior) -> str:
    """What tells this room from others in a snapshot."""
    seats = [[s.position.tolist(), s.heading] for s in interior.room.seats]
    text = json.dumps([seats, [from_thing(t) for t in interior.room.things]])
    return hashlib.sha256(text.encode()).hexdigest()[:32]
