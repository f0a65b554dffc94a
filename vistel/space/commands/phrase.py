"""Commands as short English lines, for a console and for scripts: "bend the red baton 40", "move this left 10 cm".

    line   = verb [which] [the rest]
    which  = this | that | all [words] | [the] words        colour, shape, name or id of a thing; that: pointed at

Lengths are in metres unless cm or mm follows, angles in degrees.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from vistel.space.commands import actions as ask
from vistel.space.commands.actions import Action, Along, Shown, Towards, Where, Which
from vistel.space.commands.create import SHAPES
from vistel.space.commands.reference import COLOURS

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
LONGER = {
    "longer": (1.5, Along.LONGEST),
    "shorter": (1 / 1.5, Along.LONGEST),
    "taller": (1.5, Along.UP),
    "lower": (1 / 1.5, Along.UP),
    "wider": (1.5, Along.ACROSS),
    "narrower": (1 / 1.5, Along.ACROSS),
    "deeper": (1.5, Along.AHEAD),
    "larger": (1.5, None),
    "smaller": (1 / 1.5, None),
}
USAGE = """\
move WHICH right|left|up|down|ahead|back [LENGTH]     put WHICH here|there
turn WHICH DEGREES [up|across|ahead|longest]          scale WHICH FACTOR [longest|up|across|ahead]
larger|smaller|longer|shorter|taller|lower|wider|narrower|deeper WHICH
bend WHICH DEGREES     twist WHICH DEGREES            straighten WHICH
paint WHICH COLOUR     soften WHICH                   harden WHICH
sharpen WHICH          round WHICH                    dent WHICH
align all [WORDS]      hide WHICH                     show [WHICH]
copy WHICH             delete WHICH                   create [COLOUR] SHAPE [LENGTH] [here|there]
select WHICH|nothing   take WHICH | snatch WHICH      release [WHICH]
attach WHICH to WHICH  detach WHICH                   undo     redo     stop     reset"""


class PhraseError(ValueError):
    """A line that is no command; the text says what was expected."""


def read(line: str) -> Action:
    """The action a line asks for. Raises PhraseError."""
    words = line.lower().split()
    if not words:
        raise PhraseError("expected a command, such as: move this left 10 cm")
    verb, rest = words[0], words[1:]
    if verb in LONGER:
        factor, along = LONGER[verb]
        return ask.Scale(_which(rest), factor, along)
    if verb not in _READ:
        raise PhraseError(f"there is no command {verb!r}; there are {', '.join([*_READ, *LONGER])}")
    return _READ[verb](rest)


def _which(words: list[str]) -> Which:
    """Which things words mean."""
    if words in ([], ["this"], ["it"]):
        return ask.THIS
    if words == ["that"]:
        return Which(shown=Shown.POINTED)
    every = words[0] in ("all", "every", "everything")
    rest = [w for w in (words[1:] if every else words) if w not in ("the", "a", "an", "things")]
    shown = {"selected": Shown.SELECTED, "held": Shown.HELD}.get(rest[0]) if rest else None
    rest = rest[1:] if shown else rest
    return Which(name=" ".join(rest), shown=shown, every=every)


def _move(words: list[str]) -> Action:
    words, metres = _length(words, 0.1)
    if not words or words[-1] not in {t.value for t in Towards}:
        raise PhraseError(f"move which way? expected {', '.join(t.value for t in Towards)}")
    return ask.MoveBy(_which(words[:-1]), Towards(words[-1]), metres)


def _put(words: list[str]) -> Action:
    words, where = _where(words)
    return ask.Place(_which(words), where)


def _turn(words: list[str]) -> Action:
    words, about = _along(words)
    words, angle = _number(words, "turn by how many degrees?")
    return ask.Turn(_which(words), math.radians(angle), about or Along.UP)


def _scale(words: list[str]) -> Action:
    words, along = _along(words)
    words, factor = _number(words, "scale by what factor?")
    return ask.Scale(_which(words), factor, along)


def _bend(words: list[str]) -> Action:
    words, angle = _number(words, "bend by how many degrees?")
    return ask.Bend(_which(words), math.radians(angle))


def _twist(words: list[str]) -> Action:
    words, angle = _number(words, "twist by how many degrees?")
    return ask.Twist(_which(words), math.radians(angle))


def _paint(words: list[str]) -> Action:
    if not words or words[-1] not in COLOURS:
        raise PhraseError(f"paint it in what colour? there are {', '.join(COLOURS)}")
    return ask.Paint(_which(words[:-1]), COLOURS[words[-1]])


def _create(words: list[str]) -> Action:
    words, where = _where(words)
    words, length = _length(words, 0.08)
    words = [w for w in words if w not in ("a", "an", "the")]
    colour = COLOURS.get(words[0]) if words else None
    shape = " ".join(words[1:] if colour else words)
    if shape not in SHAPES:
        raise PhraseError(f"create what? there are {', '.join(SHAPES)}")
    return ask.Create(shape, 0.5 * length, colour, where)


def _select(words: list[str]) -> Action:
    return ask.Select(nothing=True) if words == ["nothing"] else ask.Select(_which(words))


def _attach(words: list[str]) -> Action:
    if "to" not in words:
        raise PhraseError("attach it to what? expected: attach WHICH to WHICH")
    k = words.index("to")
    return ask.Attach(_which(words[:k]), _which(words[k + 1 :]))


def _where(words: list[str]) -> tuple[list[str], Where]:
    if words and words[-1] in ("here", "there"):
        return words[:-1], Where(words[-1])
    return words, Where.HERE


def _along(words: list[str]) -> tuple[list[str], Along | None]:
    if len(words) > 1 and words[-1] in {a.value for a in Along}:
        return words[:-1], Along(words[-1])
    return words, None


def _number(words: list[str], question: str) -> tuple[list[str], float]:
    words = words[:-1] if words and words[-1] in ("degrees", "times") else words
    try:
        return words[:-1], float(words[-1])
    except (IndexError, ValueError):
        raise PhraseError(f"{question} expected a number at the end") from None


def _length(words: list[str], default: float) -> tuple[list[str], float]:
    """The words before a length at the end, and the length [m]."""
    text = " ".join(words)
    found = re.search(r"(?:^|\s)(\d+(?:\.\d*)?|\.\d+)\s*(m|cm|mm)?$", text)
    if not found:
        return words, default
    return text[: found.start()].split(), float(found[1]) * UNITS[found[2] or "m"]


_READ: dict[str, Callable[[list[str]], Action]] = {
    "move": _move,
    "put": _put,
    "turn": _turn,
    "scale": _scale,
    "bend": _bend,
    "twist": _twist,
    "straighten": lambda w: ask.Bend(_which(w), 0.0),
    "paint": _paint,
    "soften": lambda w: ask.Harden(_which(w), 0.3),
    "harden": lambda w: ask.Harden(_which(w), 1.0),
    "sharpen": lambda w: ask.Sharpen(_which(w), 0.6),
    "round": lambda w: ask.Sharpen(_which(w), -0.6),
    "dent": lambda w: ask.Dent(_which(w)),
    "align": lambda w: ask.Align(_which(w)),
    "hide": lambda w: ask.Hide(_which(w)),
    "show": lambda w: ask.Show(_which(w)),
    "copy": lambda w: ask.Copy(_which(w)),
    "delete": lambda w: ask.Delete(_which(w)),
    "create": _create,
    "select": _select,
    "take": lambda w: ask.Grip(_which(w)),
    "snatch": lambda w: ask.Grip(_which(w), True),
    "release": lambda w: ask.Release(_which(w)),
    "attach": _attach,
    "detach": lambda w: ask.Detach(_which(w)),
    "undo": lambda w: ask.Undo(),
    "redo": lambda w: ask.Redo(),
    "stop": lambda w: ask.Stop(),
    "reset": lambda w: ask.Reset(),
}
