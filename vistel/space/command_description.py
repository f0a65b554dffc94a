"""How a command is described: its parameters, the lines that people type for it and the words that they say.

A dataclass under `@command` is the whole description. What follows from it: the message (`vistel.messages.commands`, by the names
of class and fields), the console and its list of commands (`phrase`), what spoken words mean (`vistel.speech.meaning`) and the
verbs of the grammar (`vistel.speech.grammar_file`). What the command does is a function under `context.performs`.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields
from types import NoneType
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints


class Action:
    """Something that may be asked of the world: a frozen dataclass under `@command`."""


@dataclass(frozen=True)
class Quantity:
    """A number.

    placeholder: its name in the list of commands.
    question: what a line that lacks it is answered.
    amounts: the number by the value of the tag `by`, "" where a sentence has no such tag.
    tag: that gives the number itself; None: no tag does.
    unit: one typed or spoken unit, in that of the action.
    down: the amounts where a sentence has the tag change = "down"; None: `amounts`.
    opposite: the function of a number, or of one of `amounts`, that applies with that tag.
    """

    placeholder: str
    question: str
    amounts: Mapping[str, float]
    tag: str | None = None
    by: str = "degree"
    unit: float = 1.0
    down: Mapping[str, float] | None = None
    opposite: Callable[[float], float] | None = None


@dataclass(frozen=True)
class Length(Quantity):
    """A length: typed in metres unless cm or mm follows."""


@dataclass(frozen=True)
class ColourName:
    """A colour 0xRRGGBBAA by its name. tag: of what was said."""

    tag: str


@dataclass(frozen=True)
class AxisName:
    """An `Along`, or None for all directions. said: where what was said names none; None: the field's default."""

    said: str | None = None


@dataclass(frozen=True)
class ShapeName:
    """The name of a shape that can be created."""


@dataclass(frozen=True)
class Parameter:
    """A field of an action. kind: what it holds; detail: a Quantity, ColourName, AxisName or ShapeName, of which kind is the
    class, else None; optional: it has a default."""

    name: str
    kind: type[Any]
    detail: Any
    optional: bool


@dataclass(frozen=True)
class Typed:
    """A line of the console. verb: its first words; rest: literal words and FIELDS in their order, [FIELDS] that may be left out;
    fixed: fields that the verb itself gives."""

    verb: str
    rest: tuple[str, ...]
    fixed: Mapping[str, Any]


@dataclass(frozen=True)
class Phrase:
    """A verb in the grammar: of a class, with its alternatives in kana, kanji (in the order of kana) and English, and its tags."""

    group: str
    name: str
    kana: tuple[str, ...]
    kanji: tuple[str, ...]
    english: tuple[str, ...]
    means: Mapping[str, str | float | bool]


@dataclass(frozen=True)
class Spoken:
    """A value of the tag "do". phrases: those that have it; fixed: fields that the verb itself gives; towards: what a direction
    (`Towards`) that is said beside it makes of the action."""

    do: str
    phrases: tuple[Phrase, ...]
    fixed: Mapping[str, Any]
    towards: Callable[[Any, Any], Any] | None


@dataclass(frozen=True)
class Command:
    """A command. name: of its field in the message `Command`."""

    name: str
    action: type[Action]
    parameters: Mapping[str, Parameter]
    typed: tuple[Typed, ...]
    spoken: tuple[Spoken, ...]


COMMANDS: dict[str, Command] = {}
"""Every command, by the name of its field in the message `Command`."""

A = TypeVar("A", bound=Action)


def command(*ways: Typed | Spoken) -> Callable[[type[A]], type[A]]:
    """Describes the dataclass below it as a command that is asked for in these ways."""

    def described(action: type[A]) -> type[A]:
        name = re.sub(r"(?<!^)(?=[A-Z])", "_", action.__name__).lower()
        typed_ways = tuple(w for w in ways if isinstance(w, Typed))
        spoken_ways = tuple(w for w in ways if isinstance(w, Spoken))
        COMMANDS[name] = Command(name, action, _parameters(action), typed_ways, spoken_ways)
        return action

    return described


def typed(line: str, **fixed: Any) -> Typed:
    """A line such as "move WHICH TOWARDS [DISTANCE]"; fixed: fields that stand in no such line."""
    words = line.split()
    count = next((n for n, word in enumerate(words) if not word.islower()), len(words))
    return Typed(" ".join(words[:count]), tuple(words[count:]), fixed)


def spoken(do: str, *phrases: Phrase, towards: Callable[[Any, Any], Any] | None = None, **fixed: Any) -> Spoken:
    """What the tag do = "..." asks for, and the phrases that mean it."""
    return Spoken(do, phrases, fixed, towards)


def phrase(name: str, kana: str, english: str, kanji: str = "", **means: str | float | bool) -> Phrase:
    """name: "class.name"; kana, english, kanji: alternatives between slashes; means: tags besides "do"."""
    group, _, own = name.partition(".")
    in_kana, in_kanji, in_english = (tuple(text.split("/")) if text else () for text in (kana, kanji, english))
    return Phrase(group, own, in_kana, in_kanji, in_english, means)


def _parameters(action: type[Action]) -> dict[str, Parameter]:
    hints = get_type_hints(action, include_extras=True)
    optional = {f.name for f in fields(action) if f.default is not MISSING}  # pyright: ignore[reportArgumentType]
    return {name: Parameter(name, *_kind(hint), name in optional) for name, hint in hints.items()}


def _kind(hint: Any) -> tuple[type[Any], Any]:
    if get_origin(hint) is Annotated and isinstance(detail := hint.__metadata__[0], Quantity | ColourName | AxisName | ShapeName):
        return type(detail), detail
    some = [a for a in get_args(hint) if a is not NoneType]
    return (some[0] if NoneType in get_args(hint) else get_origin(hint) or hint), None
