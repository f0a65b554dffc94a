"""The room of a conference: the built-in one or one from a file, and what was put into it."""

import hashlib
import json
from dataclasses import replace
from pathlib import Path

from vistel.conference.model import RoomConfig as RoomKeys
from vistel.conference.model import RoomThing
from vistel.conference.room_things import extras_of
from vistel.conference.seats import seats_of
from vistel.space.files.faults import RoomFileError
from vistel.space.files.interior import Interior
from vistel.space.files.load import load_room
from vistel.space.files.place import FromFile, lying, put_into
from vistel.space.joints.json_values import from_joint
from vistel.space.room import meeting_room
from vistel.space.things.json_values import from_thing

__all__ = ["RoomFileError", "interior_of"]


def interior_of(keys: RoomKeys) -> Interior:
    """The room with all that is in it, and what its things look like. Raises RoomFileError (one line)."""
    if keys.file is None:
        out = Interior(meeting_room(keys.seats, extras_of(keys)))
    else:
        out = load_room(keys.file)
        out = replace(out, room=replace(out.room, seats=seats_of(keys)))
        extras = tuple(lying(e.thing(), out) for e in extras_of(keys))
        out = out.with_things((*out.room.things, *extras))
    for entry in keys.things:
        if entry.file is not None:
            out, _ = put_into(out, _of(entry, entry.file))
    return replace(out, room=replace(out.room, source=_source(out))) if keys.from_files else out


def _of(entry: RoomThing, file: Path) -> FromFile:
    colour = None if entry.colour is None else int(entry.colour[1:] + "ff", 16)
    return FromFile(file, entry.id, entry.name, entry.at, entry.turn, entry.fixed, entry.mass, entry.rigidity, colour)


def _source(interior: Interior) -> str:
    """A digest that identifies this room in a snapshot."""
    seats = [[s.position.tolist(), s.heading] for s in interior.room.seats]
    joints = [[from_joint(j) for j in interior.room.joints]] if interior.room.joints else []
    text = json.dumps([seats, [from_thing(t) for t in interior.room.things], *joints])
    return hashlib.sha256(text.encode()).hexdigest()[:32]
