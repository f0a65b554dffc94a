"""From the tags of a sentence to an action of the world, by the descriptions of its commands."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from vistel.space.actions import Action
from vistel.space.arguments import Along, Shown, Size, Towards, Where, Which
from vistel.space.command_description import COMMANDS, AxisName, ColourName, Command, Length, Parameter, Quantity, ShapeName, Spoken
from vistel.space.commands.names import COLOURS, SHAPES
from vistel.speech.grammar import Meaning


class Remark(Enum):
    """Tags for the recogniser itself, not for the world."""

    YES = "yes"
    NO = "no"
    AGAIN = "again"
    WAKE = "wake"


@dataclass(frozen=True)
class Correction:
    """Another thing was meant than the one that was taken. which: what was said of it; a noun that was not said stays."""

    which: Which


class MeaningError(ValueError):
    """Tags that give no action; the text says what is missing or unknown."""


REMARKS: Mapping[str, Remark] = {r.value: r for r in (Remark.AGAIN, Remark.YES, Remark.NO)}
"""By the tag "do"."""


def verbs() -> dict[str, tuple[Command, Spoken]]:
    """Commands by the tag "do", and how that asks for them."""
    return {spoken.do: (command, spoken) for command in COMMANDS.values() for spoken in command.spoken}


CORRECT = "correct"
"""The tag "do" of a correction."""


def asked_for(meaning: Meaning) -> Action | Remark | Correction:
    """What a meaning asks for. Raises MeaningError."""
    do = str(meaning.get("do", ""))
    if not do and meaning.get("wake"):
        return Remark.WAKE
    if do in REMARKS:
        return REMARKS[do]
    if do == CORRECT:
        return Correction(_described(meaning, ""))
    known = verbs()
    if not do:
        raise MeaningError("do: nothing is asked for")
    command, spoken = known[do] if do in known else _unknown("do", do, [*known, *REMARKS, CORRECT])
    values = dict(spoken.fixed)
    for parameter in command.parameters.values():
        if parameter.name not in values and (read := _READ.get(parameter.kind)) is not None:
            value = read(meaning, parameter)
            if value is not None or not parameter.optional:
                values[parameter.name] = value
    action = command.action(**values)
    return spoken.towards(action, _towards(meaning)) if spoken.towards and "towards" in meaning else action


def _unknown(tag: str, got: object, expected: Iterable[str]) -> Any:
    raise MeaningError(f"{tag}: expected one of {', '.join(e for e in expected if e)}, got {got!r}")


def _named(m: Meaning, tag: str, known: Mapping[str, Any]) -> Any:
    name = str(m.get(tag, ""))
    return known[name] if name in known else _unknown(tag, name, known)


def _which(m: Meaning, parameter: Parameter) -> Which:
    return _described(m, "" if parameter.name == "which" else f"{parameter.name}.")


def _described(m: Meaning, role: str) -> Which:
    """The things that the tags of a role describe."""

    def tag(key: str) -> str:
        return str(m.get(role + key, ""))

    shown = Shown.POINTED if "that" in (tag("which"), tag("shown")) else None
    size = {"": None, "large": Size.LARGEST, "small": Size.SMALLEST}.get(tag("size"))
    return Which(tag("thing"), tag("name"), tag("shape"), tag("colour"), shown, every=bool(m.get(role + "every")), size=size)


def _quantity(m: Meaning, parameter: Parameter) -> float:
    """The number that was said, else the one for the degree that was said."""
    quantity: Quantity = parameter.detail
    down = m.get("change") == "down"
    value = m.get(quantity.tag) if quantity.tag else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        value = _named(m, quantity.by, quantity.down if down and quantity.down else quantity.amounts)
    if down and quantity.opposite:
        value = quantity.opposite(value)
    return float(value) * quantity.unit


def _towards(m: Meaning, _: Parameter | None = None) -> Towards:
    return _named(m, "towards", {t.value: t for t in Towards})


def _where(m: Meaning, _: Parameter) -> Where:
    return Where.POINTED if m.get("where") == "there" else Where.HERE


def _axis(m: Meaning, parameter: Parameter) -> Along | None:
    said = parameter.detail.said
    if "along" not in m:
        return said and Along(said)
    return _named(m, "along", {"all": None, **{a.value: a for a in Along}})


def _colour(m: Meaning, parameter: Parameter) -> int | None:
    tag = parameter.detail.tag
    return None if parameter.optional and not m.get(tag) else _named(m, tag, COLOURS)


def _shape(m: Meaning, _: Parameter) -> str:
    return _named(m, "shape", {shape: shape for shape in SHAPES})


_READ: dict[type[Any], Callable[[Meaning, Parameter], Any]] = {
    Which: _which,
    Towards: _towards,
    Where: _where,
    AxisName: _axis,
    Quantity: _quantity,
    Length: _quantity,
    ColourName: _colour,
    ShapeName: _shape,
}
