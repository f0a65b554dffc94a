"""Changes of a room by command lines, as in `vistel world edit`."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, rotation_y
from vistel.space.commands.reshape import painted
from vistel.space.files.cells import cells_of
from vistel.space.files.faults import RoomFileError
from vistel.space.files.interior import Interior
from vistel.space.files.model import bulk_of_mesh
from vistel.space.files.place import FromFile, lying, put_into
from vistel.space.joints.joint import Joint, hanging_on
from vistel.space.room import Extra, Seat
from vistel.space.things.things import PhysicsMaterial, Thing

Changed = tuple[Interior, str]

HEAVIEST = 50.0
"""Greatest mass of a thing [kg]."""
FARTHEST = 50.0
"""Greatest distance of a thing from the room's origin, along each axis [m]."""
_SLOW = 0.5
"""Time constant of what becomes viscoelastic without saying how slow it is [s]."""
_ID = re.compile(r"^[a-z0-9][a-z0-9_-]{0,62}$")
_COLOUR = re.compile(r"^#[0-9a-fA-F]{6}$")


def edited(interior: Interior, words: Sequence[str]) -> tuple[Interior, list[str]]:
    """The room after the changes, and one line for each. Raises RoomFileError, one line, for the first that cannot be done."""
    told: list[str] = []
    step: list[str] = []
    for word in (*words, "then"):
        if word != "then":
            step.append(word)
            continue
        if not step:
            raise RoomFileError(f"expected a change: {', '.join(_VERBS)}")
        if step[0] not in _VERBS:
            raise RoomFileError(f"{step[0]}: expected {', '.join(_VERBS)}")
        if len(step) < 2:
            raise RoomFileError(f"{step[0]}: expected what it is about after it, such as: {step[0]} baton")
        try:
            interior, line = _VERBS[step[0]](interior, step[1:])
        except RoomFileError:
            raise
        except ValueError as fault:
            raise RoomFileError(f"{' '.join(step)}: {fault}") from fault
        told.append(line)
        step = []
    return interior, told


def _set(interior: Interior, words: list[str]) -> Changed:
    name, given = words[0], _pairs(words[1:], tuple(_KEYS))
    if not given:
        raise RoomFileError(f"set {name}: expected KEY=VALUE, with {', '.join(_KEYS)}")
    if "id" in given and name == "all":
        raise RoomFileError("set all id=: each thing must have its own")
    meant = {t.id for t in interior.room.things} if name == "all" else {interior.thing(name).id}
    things: list[Thing] = []
    for t in interior.room.things:
        new = t
        for key, value in given.items() if t.id in meant else ():
            try:
                new = _KEYS[key](new, value, interior)
            except ValueError as fault:
                raise RoomFileError(f"{t.id}: {key}={value}: {fault}") from fault
        things.append(new)
    renamed = {old.id: new.id for old, new in zip(interior.room.things, things, strict=True)}
    joints = tuple(_renamed(j, renamed) for j in interior.room.joints)
    interior = replace(interior, room=replace(interior.room, joints=joints))
    return interior.with_things(tuple(things)), f"{name}: {', '.join(f'{k} {v}' for k, v in given.items())}"


def _renamed(j: Joint, to: Mapping[str, str]) -> Joint:
    """The joint of things that have other ids now."""
    button = j.button and replace(j.button, lights=to.get(j.button.lights, ""))
    return replace(j, thing=to[j.thing], base=to.get(j.base, ""), button=button)


def _move(interior: Interior, words: list[str]) -> Changed:
    t, given = interior.thing(words[0]), _pairs(words[1:], ("to", "by", "turn"))
    position, rotation = t.position, t.rotation
    if "to" in given:
        position = _numbers(given["to"], 3)
    if "by" in given:
        position = position + _numbers(given["by"], 3)
    if "turn" in given:
        turn = rotation_y(math.radians(_number(given["turn"], -3600.0, 3600.0)))
        rotation = quaternion_from_matrix(np.ascontiguousarray(turn @ matrix_from_quaternion(rotation)))
    if not given:
        raise RoomFileError(f"move {t.id}: expected to=X,Y,Z, by=X,Y,Z or turn=DEGREES")
    own = next((j for j in interior.room.joints if j.thing == t.id), None)
    if own is not None:
        raise RoomFileError(f"move {t.id}: {t.id} hangs on the joint {own.id}; move {own.base or 'the joint, in another program'}")
    r = matrix_from_quaternion(rotation) @ matrix_from_quaternion(t.rotation).T

    def along(x: Thing) -> Thing:
        turned = quaternion_from_matrix(np.ascontiguousarray(r @ matrix_from_quaternion(x.rotation)))
        return replace(x, position=position + r @ (x.position - t.position), rotation=turned)

    carried = hanging_on(interior.room.joints, t.id)
    moved = replace(t, position=position, rotation=rotation)
    things = tuple(moved if x is t else along(x) if x.id in carried else x for x in interior.room.things)
    return interior.with_things(things), f"{t.id}: at {_spot(position)}"


def _add(interior: Interior, words: list[str]) -> Changed:
    name = words[0]
    if not _ID.match(name):
        raise RoomFileError(f"add {name}: expected an id of small letters, digits and dashes")
    keys = ("shape", "size", "elasticity", "file", "fixed", "turn", "at", "mass", "rigidity", "colour", "name")
    given = _pairs(words[1:], keys)
    x, z = _numbers(given.get("at", "0,0"), 2).tolist()
    mass = _number(given["mass"], 0.001, HEAVIEST) if "mass" in given else None
    rigidity = _number(given["rigidity"], 0.0, 1.0) if "rigidity" in given else None
    colour = _colour(given["colour"]) if "colour" in given else None
    if "file" in given:
        if given.get("fixed") not in (None, "yes", "no"):
            raise RoomFileError(f"fixed={given['fixed']}: expected yes or no")
        fixed = None if "fixed" not in given else given["fixed"] == "yes"
        turn = _number(given.get("turn", "0"), -3600.0, 3600.0)
        new = FromFile(Path(given["file"]), name, given.get("name", ""), (x, z), turn, fixed, mass, rigidity, colour)
        out, ids = put_into(interior, new)
        return out, f"added {', '.join(ids)}"
    extra = Extra(
        name,
        given.get("name", name),
        given.get("shape", "ball"),
        _number(given.get("size", "0.04"), 0.005, 0.15),
        0.2 if mass is None else mass,
        0.3 if rigidity is None else rigidity,
        colour or 0xB5A48FFF,
        x,
        z,
        _material(PhysicsMaterial(), given.get("elasticity", "elastic")),
    )
    thing = lying(extra.thing(), interior)
    return interior.with_things((*interior.room.things, thing)), f"added {name} at {_spot(thing.position)}"


def _remove(interior: Interior, words: list[str]) -> Changed:
    gone = {interior.thing(name).id for name in words}
    return interior.with_things(tuple(t for t in interior.room.things if t.id not in gone)), f"removed {', '.join(words)}"


def _seat(interior: Interior, words: list[str]) -> Changed:
    seats = list(interior.room.seats)
    new = words[0] == "new"
    if not new and not (words[0].isdecimal() and int(words[0]) < len(seats)):
        raise RoomFileError(f"seat {words[0]}: expected new, or one of 0 to {len(seats) - 1}")
    n = len(seats) if new else int(words[0])
    if words[1:] == ["remove"] and not new:
        del seats[n]
        line = f"seat {n} removed"
    else:
        given = _pairs(words[1:], ("at", "heading"))
        if "at" not in given and (new or not given):
            raise RoomFileError(f"seat {words[0]}: expected at=X,Z and heading=DEGREES (0 faces +Z)")
        x, z = _numbers(given["at"], 2).tolist() if "at" in given else seats[n].position[[0, 2]].tolist()
        old = 0.0 if new else seats[n].heading
        heading = math.radians(_number(given["heading"], -360.0, 360.0)) if "heading" in given else old
        seats[n:] = [Seat(np.array([x, 0.0, z]), heading), *seats[n + 1 :]]
        line = f"seat {n} at {x:g}, {z:g}"
    return replace(interior, room=replace(interior.room, seats=tuple(seats))), line


_VERBS: dict[str, Callable[[Interior, list[str]], Changed]] = {
    "set": _set,
    "move": _move,
    "add": _add,
    "remove": _remove,
    "seat": _seat,
}


def _mass(t: Thing, value: str, interior: Interior) -> Thing:
    return replace(t, mass=_number(value, 0.0, HEAVIEST))


def _density(t: Thing, value: str, interior: Interior) -> Thing:
    mass = _number(value, 1.0, 25000.0) * _volume(t, interior)
    if not 0.0 < mass <= HEAVIEST:
        raise ValueError(f"it would weigh {mass:.1f} kg, expected at most {HEAVIEST:g}")
    return replace(t, mass=mass)


def _volume(t: Thing, interior: Interior) -> float:
    """Of the polymeshes it looks like [m^3]."""
    total = 0.0
    for look in t.looks:
        model = interior.models[look.model]
        vertices = model.vertices.astype(np.float64) @ look.matrix.T
        if model.closed:
            total += abs(bulk_of_mesh(vertices, model.triangles).volume)
        else:
            cells = cells_of(vertices, model.triangles)
            total += float(cells.filled.sum()) * cells.size**3
    if total == 0.0:
        raise ValueError("only of things with a polymesh the volume is known; set its mass")
    return total


def _material(old: PhysicsMaterial, elasticity: str) -> PhysicsMaterial:
    slow = old.recovery or (_SLOW if elasticity == "viscoelastic" else 0.0)
    return replace(old, elasticity=elasticity, recovery=slow)


def _named(t: Thing, value: str, interior: Interior) -> Thing:
    if not _ID.match(value):
        raise ValueError("expected small letters, digits and dashes")
    return replace(t, id=value)


_KEYS: dict[str, Callable[[Thing, str, Interior], Thing]] = {
    "mass": _mass,
    "density": _density,
    "rigidity": lambda t, v, _: replace(t, compliance=1.0 - _number(v, 0.0, 1.0)),
    "elasticity": lambda t, v, _: replace(t, material=_material(t.material, v)),
    "recovery": lambda t, v, _: replace(t, material=replace(t.material, recovery=_number(v, 0.0, 3600.0))),
    "sticky": lambda t, v, _: replace(t, material=replace(t.material, sticky=_number(v, 0.0, 0.1))),
    "bears": lambda t, v, _: replace(t, material=replace(t.material, bears=_number(v, 0.01, 200.0))),
    "colour": lambda t, v, _: painted(t, _colour(v)),
    "shape": lambda t, v, _: replace(t, shape=v),
    "name": lambda t, v, _: replace(t, name=v),
    "id": _named,
}


def _pairs(words: Sequence[str], keys: tuple[str, ...]) -> dict[str, str]:
    out: dict[str, str] = {}
    for word in words:
        key, equals, value = word.partition("=")
        if not equals or key not in keys or not value:
            raise RoomFileError(f"{word}: expected KEY=VALUE with one of {', '.join(keys)}")
        out[key] = value
    return out


def _number(text: str, low: float, high: float) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        raise RoomFileError(f"{text}: expected a number from {low:g} to {high:g}")
    return value


def _numbers(text: str, count: int) -> F64:
    parts = text.split(",")
    if len(parts) != count:
        raise RoomFileError(f"{text}: expected {count} numbers with commas between them, metres")
    return np.array([_number(part, -FARTHEST, FARTHEST) for part in parts])


def _colour(text: str) -> int:
    if not _COLOUR.match(text):
        raise RoomFileError(f"{text}: expected a colour such as #c23b32")
    return int(text[1:] + "ff", 16)


def _spot(position: F64) -> str:
    return ", ".join(f"{v:.3f}" for v in position.tolist())
