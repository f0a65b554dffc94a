"""From what a sentence means to what is asked of the world."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum

from vistel.space.commands import actions as ask
from vistel.space.commands.actions import Action, Along, Shown, Size, Towards, Where, Which
from vistel.space.commands.create import SHAPES
from vistel.space.commands.reference import COLOURS
from vistel.speech.grammar import Meaning


class Remark(Enum):
    """What is said to whoever listens, not to the world."""

    YES = "yes"
    NO = "no"
    AGAIN = "again"
    WAKE = "wake"


class MeaningError(ValueError):
    """Tags that ask for nothing; the text says what is missing or unknown."""


MOVES = {"": 0.1, "little": 0.03, "more": 0.3}
"""By how much things are moved, by the tag "degree" [m]."""
FACTORS = {"": 1.5, "little": 1.2, "more": 2.0}
TURNS = {"": 45.0, "little": 15.0, "more": 90.0}
"""Degrees; for bending and twisting as well."""
CREATED = {"": 0.04, "large": 0.07, "small": 0.02}
"""Half of the extent of a new thing, by the tag "size" [m]."""
EDGES = {"": 0.6, "little": 0.3, "more": 1.0}
"""Shares of the way to as sharp, or as round, as can be."""
DENTS = {"": 0.3, "little": 0.15, "more": 0.5}
"""Shares of half of a thing's smallest extent."""
SOFTNESS = {"": (0.3, 1.0), "little": (0.4, 0.8), "more": (0.0, 1.0)}
"""Rigidity when softer and when harder."""


def asked_for(meaning: Meaning) -> Action | Remark:
    """What a meaning asks for. Raises MeaningError."""
    verb = str(meaning.get("do", ""))
    if not verb and meaning.get("wake"):
        return Remark.WAKE
    if verb not in _DO:
        raise MeaningError(f"do: expected one of {', '.join(_DO)}, got {verb!r}" if verb else "do: nothing is asked for")
    return _DO[verb](meaning)


def _which(m: Meaning, role: str = "") -> Which:
    def tag(key: str) -> str:
        return str(m.get(role + key, ""))

    shown = Shown.POINTED if "that" in (tag("which"), tag("shown")) else None
    size = {"": None, "large": Size.LARGEST, "small": Size.SMALLEST}.get(tag("size"))
    return Which(tag("thing"), tag("name"), tag("shape"), tag("colour"), shown, every=bool(m.get(role + "every")), size=size)


def _number(m: Meaning, key: str, table: dict[str, float]) -> float:
    """What was said outright, else by degree."""
    value = m.get(key)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    degree = str(m.get("degree", ""))
    if degree not in table:
        raise MeaningError(f"degree: expected one of {', '.join(k for k in table if k)}, got {degree!r}")
    return table[degree]


def _towards(m: Meaning) -> Towards:
    try:
        return Towards(str(m.get("towards", "")))
    except ValueError:
        raise MeaningError(f"towards: expected one of {', '.join(t.value for t in Towards)}, got {m.get('towards')!r}") from None


def _where(m: Meaning) -> Where:
    return Where.POINTED if m.get("where") == "there" else Where.HERE


def _turn(m: Meaning) -> Action:
    angle = math.radians(_number(m, "degrees", TURNS))
    about = _ABOUT.get(str(m.get("along", "")), Along.UP)
    if "towards" in m:
        # To the right is clockwise from above; ahead is over its far edge.
        sign, about = _SENSE[_towards(m)]
        angle *= sign
    return ask.Turn(_which(m), angle, about)


_ABOUT = {"up": Along.UP, "across": Along.ACROSS, "longest": Along.LONGEST}
_SENSE = {
    Towards.RIGHT: (-1.0, Along.UP),
    Towards.LEFT: (1.0, Along.UP),
    Towards.UP: (1.0, Along.ACROSS),
    Towards.DOWN: (-1.0, Along.ACROSS),
    Towards.AHEAD: (-1.0, Along.ACROSS),
    Towards.BACK: (1.0, Along.ACROSS),
}


def _scale(m: Meaning) -> Action:
    factor = _number(m, "factor", FACTORS)
    if m.get("change") == "down":
        factor = 1.0 / factor
    along = str(m.get("along", "longest"))
    if along not in _ALONG:
        raise MeaningError(f"along: expected one of {', '.join(_ALONG)}, got {along!r}")
    return ask.Scale(_which(m), factor, _ALONG[along])


_ALONG = {"all": None, "longest": Along.LONGEST, "up": Along.UP, "across": Along.ACROSS, "ahead": Along.AHEAD, "girth": Along.GIRTH}


def _paint(m: Meaning) -> Action:
    name = str(m.get("paint", ""))
    if name not in COLOURS:
        raise MeaningError(f"paint: expected one of {', '.join(COLOURS)}, got {name!r}")
    return ask.Paint(_which(m), COLOURS[name])


def _create(m: Meaning) -> Action:
    shape, colour, size = (str(m.get(key, "")) for key in ("shape", "colour", "size"))
    if shape not in SHAPES:
        raise MeaningError(f"shape: expected one of {', '.join(SHAPES)}, got {shape!r}")
    if colour and colour not in COLOURS:
        raise MeaningError(f"colour: expected one of {', '.join(COLOURS)}, got {colour!r}")
    if size not in CREATED:
        raise MeaningError(f"size: expected large or small, got {size!r}")
    return ask.Create(shape, CREATED[size], COLOURS.get(colour), _where(m))


def _harden(m: Meaning) -> Action:
    soft, hard = SOFTNESS.get(str(m.get("degree", "")), SOFTNESS[""])
    return ask.Harden(_which(m), soft if m.get("change") == "down" else hard)


def _sharpen(m: Meaning) -> Action:
    by = _number(m, "by", EDGES)
    return ask.Sharpen(_which(m), -by if m.get("change") == "down" else by)


_DO: dict[str, Callable[[Meaning], Action | Remark]] = {
    "move": lambda m: ask.MoveBy(_which(m), _towards(m), _number(m, "metres", MOVES)),
    "place": lambda m: ask.Place(_which(m), _where(m)),
    "turn": _turn,
    "flip": lambda m: ask.Turn(_which(m), math.pi, Along.ACROSS),
    "tip": lambda m: ask.Turn(_which(m), -0.5 * math.pi, Along.ACROSS),
    "scale": _scale,
    "double": lambda m: ask.Scale(_which(m), 2.0),
    "halve": lambda m: ask.Scale(_which(m), 0.5),
    "bend": lambda m: ask.Bend(_which(m), math.radians(_number(m, "degrees", TURNS))),
    "twist": lambda m: ask.Twist(_which(m), math.radians(_number(m, "degrees", TURNS))),
    "straighten": lambda m: ask.Bend(_which(m), 0.0),
    "paint": _paint,
    "harden": _harden,
    "sharpen": _sharpen,
    "dent": lambda m: ask.Dent(_which(m), _number(m, "depth", DENTS)),
    "align": lambda m: ask.Align(_which(m)),
    "hide": lambda m: ask.Hide(_which(m)),
    "show": lambda m: ask.Show(_which(m)),
    "copy": lambda m: ask.Copy(_which(m)),
    "create": _create,
    "delete": lambda m: ask.Delete(_which(m)),
    "attach": lambda m: ask.Attach(_which(m), _which(m, "to.")),
    "detach": lambda m: ask.Detach(_which(m)),
    "select": lambda m: ask.Select(_which(m)),
    "deselect": lambda m: ask.Select(nothing=True),
    "grip": lambda m: ask.Grip(_which(m)),
    "release": lambda m: ask.Release(_which(m)),
    "undo": lambda m: ask.Undo(),
    "redo": lambda m: ask.Redo(),
    "stop": lambda m: ask.Stop(),
    "reset": lambda m: ask.Reset(),
    "again": lambda m: Remark.AGAIN,
    "yes": lambda m: Remark.YES,
    "no": lambda m: Remark.NO,
}
VERBS = tuple(_DO)
"""What the tag "do" may be."""
