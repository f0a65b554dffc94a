"""Puts things into a room: on fixed things, or on the floor."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, rotation_y
from vistel.space.commands.reshape import painted
from vistel.space.files.interior import Interior
from vistel.space.files.load import load_things
from vistel.space.files.surfaces import height_at, in_room, pieces_of
from vistel.space.joints.joint import Joint, JointFrame
from vistel.space.room import TABLE_HEIGHT
from vistel.space.things.things import Thing


@dataclass(frozen=True)
class FromFile:
    """A thing from a file, to put into a room. id: of the thing, or before the ids of several; name: for people, "": the file's;
    at: x, z [m]; turn: about the vertical [degrees]; fixed, mass [kg], rigidity, colour 0xRRGGBBAA: None: as in the file."""

    file: Path
    id: str
    name: str = ""
    at: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    fixed: bool | None = None
    mass: float | None = None
    rigidity: float | None = None
    colour: int | None = None


def put_into(interior: Interior, new: FromFile) -> tuple[Interior, tuple[str, ...]]:
    """The room with it, on what stands fixed there, or on the floor if all of it stands fast; and the ids of its things.

    Raises RoomFileError (one line).
    """
    found = load_things(new.file, fixed=new.fixed)
    turn = rotation_y(math.radians(new.turn))
    low, high = _box(found)
    middle = 0.5 * (low + high) * (1.0, 0.0, 1.0)
    x, z = new.at
    stands = all(t.fixed for t in found.room.things)
    floor = 0.0 if stands else height_at(interior.room.things, interior.models, x, z)
    out: list[Thing] = []
    alone = len(found.room.things) == 1
    for t in found.room.things:
        spot = turn @ (t.position - middle - (0.0, low[1], 0.0)) + (x, floor, z)
        placed = replace(
            t,
            id=new.id if alone else f"{new.id}-{t.id}",
            name=(new.name or new.id) if alone else f"{new.name} {t.name}".strip(),
            position=spot,
            rotation=quaternion_from_matrix(np.ascontiguousarray(turn @ matrix_from_quaternion(t.rotation))),
            mass=t.mass if new.mass is None or t.fixed else new.mass,
            compliance=t.compliance if new.rigidity is None else 1.0 - new.rigidity,
        )
        out.append(placed if new.colour is None else painted(placed, new.colour))
    ids = {t.id: placed.id for t, placed in zip(found.room.things, out, strict=True)}
    origin = np.array((x, floor, z)) - turn @ np.array((middle[0], low[1], middle[2]))
    joints = tuple(_brought(j, new.id, ids, turn, origin) for j in found.room.joints)
    joined = replace(interior, room=replace(interior.room, joints=(*interior.room.joints, *joints)))
    whole = joined.with_things((*interior.room.things, *out), found.models)
    notes = (*interior.notes, *(f"{new.id}: {note}" for note in found.notes))
    return replace(whole, notes=notes), tuple(t.id for t in out)


def _brought(j: Joint, prefix: str, ids: Mapping[str, str], turn: F64, origin: F64) -> Joint:
    """The joint of a file between things that have these ids now; turn (3, 3), origin (3,): how the file stands in the room."""
    button = j.button and replace(j.button, lights=ids.get(j.button.lights, ""))
    out = replace(j, id=f"{prefix}-{j.id}", thing=ids[j.thing], base=ids.get(j.base, ""), button=button)
    if j.base:
        return out
    frame = JointFrame(turn @ j.on_base.point + origin, quaternion_from_matrix(np.ascontiguousarray(turn @ j.on_base.matrix)))
    return replace(out, on_base=frame)


def lying(thing: Thing, interior: Interior) -> Thing:
    """A thing for the built-in table, on what stands in this room at its place."""
    x, y, z = thing.position.tolist()
    height = height_at(interior.room.things, interior.models, x, z)
    return replace(thing, position=np.array([x, y - TABLE_HEIGHT + height, z]))


def _box(interior: Interior) -> tuple[F64, F64]:
    """Lowest and highest corner of all that is drawn of a room's things [m]."""
    every = np.concatenate([in_room(t, p.surface) for t in interior.room.things for p in pieces_of(t, interior.models)])
    return every.min(axis=0), every.max(axis=0)
