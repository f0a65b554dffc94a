"""Between the messages of commands and what may be asked of the world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.space.commands import actions as ask
from vistel.space.commands.actions import Action, Along, Shown, Size, Towards, Where, Which
from vistel.v1 import command_pb2 as pb
from vistel.v1.geometry_pb2 import Pose

IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])
"""The quaternion (x, y, z, w) that turns nothing."""


def pose(message: Pose) -> tuple[F64, F64]:
    """position (3,), rotation (4,) quaternion; all zero means identity."""
    p, q = message.position, message.rotation
    rotation = np.array([q.x, q.y, q.z, q.w], np.float64)
    return np.array([p.x, p.y, p.z], np.float64), rotation if rotation.any() else IDENTITY


def action_of(message: pb.Command) -> Action | None:
    """What a command asks for; None for nothing this world knows."""
    kind = message.WhichOneof("action")
    return None if kind is None else _READ[kind](getattr(message, kind))


def message_of(action: Action, id: str, participant: str) -> pb.Command:
    """A command that asks for an action."""
    out = pb.Command(id=id, participant=participant)
    getattr(out, _FIELD[type(action)]).SetInParent()
    into = getattr(out, _FIELD[type(action)])
    for name, value in vars(action).items():
        _write(into, name, value)
    return out


def _write(into: Any, name: str, value: Any) -> None:
    if isinstance(value, Which):
        getattr(into, name).CopyFrom(_from_which(value))
    elif isinstance(value, Towards | Along | Where):
        setattr(into, name, _CODE[value])
    elif name == "position":
        into.pose.position.x, into.pose.position.y, into.pose.position.z = value.tolist()
    elif name == "rotation":
        q = into.pose.rotation
        q.x, q.y, q.z, q.w = value.tolist()
    elif value is not None:
        setattr(into, name, value)


def _from_which(w: Which) -> pb.Which:
    shown = {how: code for code, how in _SHOWN.items()}
    return pb.Which(
        thing=w.thing,
        name=w.name,
        shape=w.shape,
        colour=w.colour,
        every=w.every,
        shown=shown[w.shown] if w.shown else pb.Which.SHOWN_UNSPECIFIED,
        size=next((code for code, size in _SIZE.items() if size is w.size), pb.Which.SIZE_UNSPECIFIED),
    )


def _which(m: pb.Which) -> Which:
    return Which(m.thing, m.name, m.shape, m.colour, _SHOWN.get(m.shown), m.every, _SIZE.get(m.size))


def _given(m: Any, name: str, default: Any) -> Any:
    return getattr(m, name) if m.HasField(name) else default


def _move_by(m: pb.MoveThingBy) -> ask.MoveBy | None:
    if m.towards not in _TOWARDS:
        return None
    return ask.MoveBy(_which(m.which), _TOWARDS[m.towards], _given(m, "distance", ask.MoveBy.distance))


def _size_colour(m: pb.CreateThing) -> tuple[float, int | None]:
    return _given(m, "size", ask.Create.size), _given(m, "colour", ask.Create.colour)


def _pose_given(m: Pose) -> tuple[F64, F64]:
    """As `pose`; a rotation that is given is left as it is, even if all of it is zero."""
    q = m.rotation
    return pose(m)[0], np.array([q.x, q.y, q.z, q.w], np.float64) if m.HasField("rotation") else IDENTITY


def _named(m: Any) -> Which:
    return Which(m.thing) if m.thing else _which(m.which)


_SHOWN = {
    pb.Which.SHOWN_POINTED: Shown.POINTED,
    pb.Which.SHOWN_LOOKED_AT: Shown.LOOKED_AT,
    pb.Which.SHOWN_SELECTED: Shown.SELECTED,
    pb.Which.SHOWN_HELD: Shown.HELD,
}
_SIZE = {pb.Which.SIZE_LARGEST: Size.LARGEST, pb.Which.SIZE_SMALLEST: Size.SMALLEST}
_TOWARDS = {
    pb.TOWARDS_RIGHT: Towards.RIGHT,
    pb.TOWARDS_LEFT: Towards.LEFT,
    pb.TOWARDS_UP: Towards.UP,
    pb.TOWARDS_DOWN: Towards.DOWN,
    pb.TOWARDS_AHEAD: Towards.AHEAD,
    pb.TOWARDS_BACK: Towards.BACK,
}
_ALONG = {
    pb.ALONG_LONGEST: Along.LONGEST,
    pb.ALONG_UP: Along.UP,
    pb.ALONG_ACROSS: Along.ACROSS,
    pb.ALONG_AHEAD: Along.AHEAD,
    pb.ALONG_GIRTH: Along.GIRTH,
}
_WHERE = {pb.WHERE_HERE: Where.HERE, pb.WHERE_POINTED: Where.POINTED}
_CODE: dict[Towards | Along | Where, int] = {value: code for table in (_TOWARDS, _ALONG, _WHERE) for code, value in table.items()}
_FIELD: dict[type[Any], str] = {
    ask.Move: "move",
    ask.Release: "release",
    ask.Delete: "delete",
    ask.Reset: "reset",
    ask.Select: "select",
    ask.MoveBy: "move_by",
    ask.Place: "place",
    ask.Turn: "turn",
    ask.Scale: "scale",
    ask.Bend: "bend",
    ask.Twist: "twist",
    ask.Paint: "paint",
    ask.Harden: "harden",
    ask.Copy: "copy",
    ask.Create: "create",
    ask.Grip: "grip",
    ask.Attach: "attach",
    ask.Detach: "detach",
    ask.Undo: "undo",
    ask.Redo: "redo",
    ask.Stop: "stop",
    ask.Hide: "hide",
    ask.Show: "show",
    ask.Align: "align",
    ask.Dent: "dent",
    ask.Sharpen: "sharpen",
}

_READ: dict[str, Callable[[Any], Action | None]] = {
    "move": lambda m: ask.Move(_named(m), *_pose_given(m.pose)),
    "release": lambda m: ask.Release(_named(m)),
    "delete": lambda m: ask.Delete(_named(m)),
    "reset": lambda m: ask.Reset(),
    "select": lambda m: ask.Select(_which(m.which), m.nothing),
    "move_by": _move_by,
    "place": lambda m: ask.Place(_which(m.which), _WHERE.get(m.where, Where.HERE)),
    "turn": lambda m: ask.Turn(_which(m.which), m.angle, _ALONG.get(m.about, Along.UP)),
    "scale": lambda m: ask.Scale(_which(m.which), m.factor, _ALONG.get(m.along)),
    "bend": lambda m: ask.Bend(_which(m.which), m.angle),
    "twist": lambda m: ask.Twist(_which(m.which), m.angle),
    "paint": lambda m: ask.Paint(_which(m.which), m.colour),
    "harden": lambda m: ask.Harden(_which(m.which), m.rigidity),
    "copy": lambda m: ask.Copy(_which(m.which)),
    "create": lambda m: ask.Create(m.shape, *_size_colour(m), _WHERE.get(m.where, Where.HERE)),
    "grip": lambda m: ask.Grip(_which(m.which), m.force),
    "attach": lambda m: ask.Attach(_which(m.which), _which(m.to)),
    "detach": lambda m: ask.Detach(_which(m.which)),
    "undo": lambda m: ask.Undo(),
    "redo": lambda m: ask.Redo(),
    "stop": lambda m: ask.Stop(),
    "hide": lambda m: ask.Hide(_which(m.which)),
    "show": lambda m: ask.Show(_which(m.which)),
    "align": lambda m: ask.Align(_which(m.which)),
    "dent": lambda m: ask.Dent(_which(m.which), _given(m, "depth", ask.Dent.depth)),
    "sharpen": lambda m: ask.Sharpen(_which(m.which), m.by),
}
