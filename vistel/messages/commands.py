"""Actions of the world as messages of commands, by fields of the same names (`description.COMMANDS`). Loads no mathematics."""

from enum import Enum
from typing import Any, cast

from google.protobuf.message import Message

from vistel.space.actions import Action
from vistel.space.arguments import Which
from vistel.space.command_description import COMMANDS
from vistel.v1 import command_pb2 as pb


def message_of(action: Action, id: str, participant: str) -> pb.Command:
    """A command that asks for an action."""
    out = pb.Command(id=id, participant=participant)
    write_action(action, out)
    return out


def command_text(message: pb.Command) -> str:
    """What a command asks, in the words of its message: "move thing"."""
    return (message.WhichOneof("action") or "command").replace("_", " ")


def write_action(action: Action, out: Message) -> None:
    """Make a `Command` ask for an action."""
    name = next(each.name for each in COMMANDS.values() if each.action is type(action))
    into = getattr(out, name)
    into.SetInParent()
    _write(action, into)


def _write(source: Any, into: Any) -> None:
    for name, value in cast("dict[str, Any]", vars(source)).items():
        if value is None:
            continue
        if isinstance(value, Which):
            _write(value, getattr(into, name))
            getattr(into, name).SetInParent()
        elif isinstance(value, Enum):
            kind = into.DESCRIPTOR.fields_by_name[name].enum_type
            setattr(into, name, kind.values_by_name[f"{kind.name.upper()}_{value.name}"].number)
        elif isinstance(value, tuple):
            getattr(into, name).extend(value)
        elif name in ("position", "rotation"):
            part = getattr(into.pose, name)
            for axis, number in zip("xyzw", value.tolist(), strict=False):
                setattr(part, axis, number)
        else:
            setattr(into, name, value)
