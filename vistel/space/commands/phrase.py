"""Commands as short English lines, for a console and for scripts: "bend the red baton 40", "move this left 10 cm".

    line   = verb [which] [the rest]
    which  = this | that | all [words] | [the] words        colour, shape, name or id of a thing; that: pointed at

Lengths are in metres unless cm or mm follows, angles in degrees.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from vistel.space.actions import Action
from vistel.space.arguments import THIS, Along, Reaction, Shown, Towards, Where, Which
from vistel.space.command_description import COMMANDS, AxisName, ColourName, Command, Length, Parameter, Quantity, ShapeName, Typed
from vistel.space.commands.names import COLOURS, SHAPES

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Of lengths [m]."""
_ARTICLES = ("the", "a", "an")
_SECOND_COLUMN = 54
"""Where it begins in `usage`, in letters."""


class PhraseError(ValueError):
    """A line that is no command; the text says what was expected."""


def read(line: str) -> Action:
    """The action a line asks for. Raises PhraseError."""
    as_typed = line.split()
    words = [word.lower() for word in as_typed]
    if not words:
        raise PhraseError("expected a command, such as: move this left 10 cm")
    known = {typed.verb: (command, typed) for command, typed in typed_lines()}
    for verb, rest in ((" ".join(words[:2]), words[2:]), (words[0], words[1:])):
        if verb in known:
            command, typed = known[verb]
            written = any(p.kind is str for p, _ in parameters_of(command, typed.rest))
            given = as_typed[len(words) - len(rest) :] if written else rest
            return command.action(**_fields(command, typed, typed.rest, given), **typed.fixed)
    raise PhraseError(f"there is no command {words[0]!r}; there are {', '.join(known)}")


def entries() -> list[str]:
    """What can be typed: verbs that are typed alike, and what follows them."""
    verbs: dict[tuple[str, str], list[str]] = {}
    for command, typed in typed_lines():
        rest = " ".join(_placeholder(command, token) for token in typed.rest)
        group = command.name if rest or " " in typed.verb else ""
        verbs.setdefault((group, rest), []).append(typed.verb)
    return [f"{'|'.join(some)} {rest}".strip() for (_, rest), some in verbs.items()]


def usage() -> str:
    """What can be typed, one or two commands a line."""
    lines = [""]
    for entry in entries():
        if lines[-1] and len(lines[-1]) + 3 <= _SECOND_COLUMN and len(entry) < 72:
            lines[-1] = f"{lines[-1]:{_SECOND_COLUMN}}{entry}"
        else:
            lines.append(entry)
    return "\n".join(lines[1:])


def typed_lines() -> Iterator[tuple[Command, Typed]]:
    """Every way in which a command can be typed."""
    return ((command, typed) for command in COMMANDS.values() for typed in command.typed)


def _parameter(command: Command, token: str) -> Parameter | None:
    """None for a literal word."""
    return None if token.islower() else command.parameters[token.strip("[]").lower()]


def choices_of(parameter: Parameter) -> tuple[str, ...]:
    """The words of which one stands for a parameter; none for what has others, such as numbers and things."""
    return tuple(_QUESTIONS[parameter.kind][1]) if parameter.kind in _QUESTIONS else ()


def parameters_of(command: Command, tokens: Sequence[str]) -> list[tuple[Parameter, str]]:
    """The parameters among the tokens of a line, each with its token."""
    return [(p, token) for token in tokens if (p := _parameter(command, token)) is not None]


def _placeholder(command: Command, token: str) -> str:
    parameter = _parameter(command, token)
    if parameter is None:
        return token
    known = parameter.detail.placeholder if isinstance(parameter.detail, Quantity) else _PLACEHOLDERS[parameter.kind]
    return f"[{known}]" if token.startswith("[") else known


def _fields(command: Command, typed: Typed, tokens: Sequence[str], words: list[str]) -> dict[str, Any]:
    """The fields that tokens of a line stand for, read from its end."""
    for n, token in enumerate(tokens):
        if _parameter(command, token) is None:
            if token not in words:
                expected = " ".join(_placeholder(command, each) for each in typed.rest)
                raise PhraseError(f"{typed.verb} it {token} what? expected: {typed.verb} {expected}")
            k = words.index(token)
            return _fields(command, typed, tokens[:n], words[:k]) | _fields(command, typed, tokens[n + 1 :], words[k + 1 :])
    parameters = parameters_of(command, tokens)
    things = any(p.kind in (Which, str) for p, _ in parameters)
    if not things:
        words = [w for w in words if w not in _ARTICLES]
    out: dict[str, Any] = {}
    for parameter, token in reversed(parameters):
        found = _READ[parameter.kind](words, parameter)
        if found is not None:
            words, out[parameter.name] = found
        elif not token.startswith("["):
            raise PhraseError(f"{typed.verb} {_question(parameter)}")
    if words and parameters and not things:
        raise PhraseError(f"{typed.verb} what? {' '.join(words)!r} is not understood")
    return out


def _question(parameter: Parameter) -> str:
    if isinstance(parameter.detail, Quantity):
        return f"{parameter.detail.question} expected a number at the end"
    question, choices = _QUESTIONS[parameter.kind]
    return f"{question} {', '.join(choices)}"


_Found = tuple[list[str], Any] | None
"""The words that are left, and a value; None: there is none at their end."""


def _which(words: list[str], _: Parameter) -> _Found:
    """Which things words mean."""
    if words in ([], ["this"], ["it"]):
        return [], THIS
    if words == ["that"]:
        return [], Which(shown=Shown.POINTED)
    every = words[0] in ("all", "every", "everything")
    rest = [w for w in (words[1:] if every else words) if w not in (*_ARTICLES, "things")]
    shown = {"selected": Shown.SELECTED, "held": Shown.HELD}.get(rest[0]) if rest else None
    rest = rest[1:] if shown else rest
    return [], Which(name=" ".join(rest), shown=shown, every=every)


def _choice(named: dict[str, Any]) -> Callable[[list[str], Parameter], _Found]:
    """One of these words."""
    return lambda words, _: (words[:-1], named[words[-1]]) if words and words[-1] in named else None


def _axis(words: list[str], _: Parameter) -> _Found:
    """An axis after something else: "up" alone is no axis."""
    return (words[:-1], _ALONG[words[-1]]) if len(words) > 1 and words[-1] in _ALONG else None


def _number(words: list[str], parameter: Parameter) -> _Found:
    words = words[:-1] if words and words[-1] in ("degrees", "times") else words
    try:
        return words[:-1], float(words[-1]) * parameter.detail.unit
    except (IndexError, ValueError):
        return None


def _length(words: list[str], parameter: Parameter) -> _Found:
    text = " ".join(words)
    found = re.search(r"(?:^|\s)(\d+(?:\.\d*)?|\.\d+)\s*(m|cm|mm)?$", text)
    if not found:
        return None
    return text[: found.start()].split(), float(found[1]) * UNITS[found[2] or "m"] * parameter.detail.unit


def _reaction(words: list[str], _: Parameter) -> _Found:
    """All that is left is its name."""
    name = "_".join(words).replace("-", "_")
    return ([], _REACTIONS[name]) if name in _REACTIONS else None


def _text(words: list[str], _: Parameter) -> _Found:
    """All that is left, as it was typed."""
    return [], " ".join(words)


_REACTIONS = {r.value: r for r in Reaction}
_ALONG = {a.value: a for a in Along}
_TOWARDS = {t.value: t for t in Towards}
_WHERE = {w.value: w for w in Where}
_READ: dict[type[Any], Callable[[list[str], Parameter], _Found]] = {
    Which: _which,
    Towards: _choice(_TOWARDS),
    Where: _choice(_WHERE),
    AxisName: _axis,
    Quantity: _number,
    Length: _length,
    ColourName: _choice(dict(COLOURS)),
    ShapeName: _choice({shape: shape for shape in SHAPES}),
    Reaction: _reaction,
    str: _text,
}
_PLACEHOLDERS: dict[type[Any], str] = {
    Which: "WHICH",
    Towards: "|".join(_TOWARDS),
    Where: "|".join(_WHERE),
    AxisName: "|".join(_ALONG),
    ColourName: "COLOUR",
    ShapeName: "SHAPE",
    Reaction: "|".join(name.replace("_", "-") for name in _REACTIONS),
    str: "TEXT",
}
_QUESTIONS: dict[type[Any], tuple[str, Iterable[str]]] = {
    Towards: ("which way? expected", _TOWARDS),
    Where: ("where? expected", _WHERE),
    AxisName: ("along which axis? expected", _ALONG),
    ColourName: ("it in what colour? there are", COLOURS),
    ShapeName: ("what? there are", SHAPES),
    Reaction: ("how? expected", [name.replace("_", "-") for name in _REACTIONS]),
}
