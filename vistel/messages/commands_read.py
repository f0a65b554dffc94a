"""Messages of commands as actions of the world, by fields of the same names (`description.COMMANDS`)."""

from dataclasses import MISSING, fields
from enum import Enum
from typing import Any, TypeVar

import numpy as np
from google.protobuf.descriptor import FieldDescriptor

from vistel.arrays import F64
from vistel.space.actions import Action
from vistel.space.arguments import Along, Reaction, Shown, Size, Towards, Where, Which
from vistel.space.command_description import COMMANDS
from vistel.v1.geometry_pb2 import Pose, Quaternion, Vec3

IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])
"""The identity quaternion (x, y, z, w)."""
_ENUMS: dict[str, type[Enum]] = {each.__name__: each for each in (Towards, Along, Where, Shown, Size, Reaction)}
"""The value NAME of one of these is in its message ENUM_NAME."""

T = TypeVar("T")


def pose(message: Pose) -> tuple[F64, F64]:
    """position (3,), rotation (4,) quaternion; all zero means identity."""
    rotation = _quaternion(message.rotation)
    return _vector(message.position), rotation if rotation.any() else IDENTITY


def action_of(message: Any) -> Action | None:
    """What a `Command` asks for; None where this world does not know it."""
    kind = message.WhichOneof("action")
    return _read(COMMANDS[kind].action, getattr(message, kind)) if kind in COMMANDS else None


def _read(kind: type[T], message: Any) -> T | None:
    """None where a value is missing that has no default."""
    values: dict[str, Any] = {}
    for f in fields(kind):  # pyright: ignore[reportArgumentType]
        value = _value(f.name, message)
        if value is None and f.default is MISSING:
            return None
        if value is not None:
            values[f.name] = value
    return kind(**values)


def _value(name: str, message: Any) -> Any:
    """Of a field; None: it is absent, or what it holds is not known here."""
    if name == "position":
        return _vector(message.pose.position)
    if name == "rotation":
        return _quaternion(message.pose.rotation) if message.pose.HasField("rotation") else IDENTITY
    field: FieldDescriptor = message.DESCRIPTOR.fields_by_name[name]
    value = getattr(message, name)
    if field.message_type is not None:
        # Some commands can name their thing by its id alone.
        return Which(message.thing) if getattr(message, "thing", "") else _read(Which, value)
    if field.enum_type is not None:
        known = field.enum_type.values_by_number.get(value)
        prefix = f"{field.enum_type.name.upper()}_"
        return _ENUMS[field.enum_type.name].__members__.get(known.name.removeprefix(prefix)) if known else None
    if field.is_repeated:
        return tuple(value)
    return value if not field.has_presence or message.HasField(name) else None


def _vector(v: Vec3) -> F64:
    return np.array([v.x, v.y, v.z], np.float64)


def _quaternion(q: Quaternion) -> F64:
    return np.array([q.x, q.y, q.z, q.w], np.float64)
