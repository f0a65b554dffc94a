"""What a model says of tables that do not fit, in words of the person who wrote them."""

import types
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Literal, Union, cast, get_args, get_origin

from pydantic import BaseModel, ValidationError

from vistel.toml.places import Place, named, value_at, written

_EXPECTED = {
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "finite_number": "a finite number",
    "string_type": 'text in quotes, "like this"',
    "path_type": 'the name of a file in quotes, "like this"',
    "list_type": "a list, [like, this]",
    "tuple_type": "a list, [like, this]",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "greater_than": "more than {gt:g}",
    "greater_than_equal": "at least {ge:g}",
    "less_than": "less than {lt:g}",
    "less_than_equal": "at most {le:g}",
    "string_pattern_mismatch": "text of the form {pattern}",
    "string_too_short": "at least {min_length} characters",
    "string_too_long": "at most {max_length} characters",
}
"""What was expected, by pydantic's name of the fault."""
_TEXTS = {
    r"^[a-z0-9][a-z0-9_\-]{0,31}$": "lower-case letters, digits, - and _, at most 32 characters",
    r"^[a-z0-9][a-z0-9_\-]*$": "lower-case letters, digits, - and _",
    "^#[0-9a-fA-F]{6}$": 'a colour such as "#b5a48f"',
}
"""Patterns in words."""


_MISSING = "is missing"
_MEANT = "; did you mean "


@dataclass(frozen=True)
class Fault:
    """What is wrong at a place of the tables."""

    place: Place
    text: str

    def __str__(self) -> str:
        key = named(self.text)
        inner = bool(key) and str(key[0]).islower()  # it names the key within the table itself
        return f"{written(self.place)}{'.' if inner else ': '}{self.text}" if self.place else self.text


def faults_of(error: ValidationError, model: type[BaseModel], tables: Mapping[str, Any]) -> list[Fault]:
    """All faults that `model` found in `tables`, in order."""
    found = [e for e in error.errors() if e["loc"][-1:] != ("str",)] or error.errors()  # a table, not a name, was meant
    faults: dict[Fault, None] = {}
    meant: set[Place] = set()
    for e in found:
        place = _place(e["loc"], tables, missing=e["type"] == "missing")
        fault = Fault(place, _text_of(e, place, model, tables))
        faults[fault] = None
        if _MEANT in fault.text:
            meant.add((*place[:-1], fault.text.partition(_MEANT)[2].rstrip("?")))
    return _merged([f for f in faults if not (f.text == _MISSING and f.place in meant)])


def _merged(faults: list[Fault]) -> list[Fault]:
    """One fault where a value fits none of several types."""
    expected: dict[tuple[Place, str], list[str]] = {}
    for fault in faults:
        head, _, tail = fault.text.partition("expected ")
        expected.setdefault((fault.place, head), []).append(tail)
    return [
        Fault(place, head + ("expected " if any(tails) else "") + ", or ".join(dict.fromkeys(tails)))
        for (place, head), tails in expected.items()
    ]


def close(word: object, known: list[str]) -> str:
    """ "; did you mean height?", or nothing where no known word is like `word`."""
    like = get_close_matches(str(word), known, 1, 0.7)
    return f"{_MEANT}{like[0]}?" if like else ""


def _place(loc: tuple[int | str, ...], tables: Mapping[str, Any], *, missing: bool) -> Place:
    """The keys of the tables that pydantic names; what it adds for the members of a union is left out."""
    place: Place = ()
    for i, part in enumerate(loc):
        try:
            value_at(tables, (*place, part))
        except LookupError:
            if not (missing and i == len(loc) - 1):
                continue
        place = (*place, part)
    return place


def _text_of(fault: Any, place: Place, model: type[BaseModel], tables: Mapping[str, Any]) -> str:
    kind, given, found = str(fault["type"]), dict[str, Any](fault.get("ctx", {})), fault.get("input")
    if kind == "extra_forbidden":
        keys, key = _keys(model, place[:-1], tables), place[-1]
        if len(place) > 1 and key in _keys(model, (), tables):
            return "unknown key here; it belongs above the first table of the file"
        return "unknown key" + (close(key, keys) or f"; expected one of {', '.join(keys)}")
    if kind == "missing":
        return _MISSING
    if kind in ("literal_error", "enum"):
        return f"{_is(found)}expected {given['expected']}{close(found, _words(given['expected']))}"
    if kind == "union_tag_invalid":
        tags = _words(given["expected_tags"])
        return f"kind: is {given['tag']!r}, expected one of {', '.join(tags)}{close(given['tag'], tags)}"
    if kind == "union_tag_not_found":
        return "kind: is missing"
    if kind in ("too_short", "too_long"):
        limit = f"at least {given['min_length']}" if kind == "too_short" else f"at most {given['max_length']}"
        return f"has {given['actual_length']} entries, expected {limit}"
    if kind in _EXPECTED:
        expected = _TEXTS.get(str(given.get("pattern"))) or _EXPECTED[kind].format(**given)
        return f"{_is(found)}expected {expected}"
    text = str(fault["msg"]).removeprefix("Value error, ").removeprefix("Assertion failed, ")
    if "expected" not in text:
        return text if "is " in text else f"{_is(found)}{text}"
    return text + (close(found, _words(text.partition("expected ")[2].partition(", got")[0])) if isinstance(found, str) else "")


def _is(found: object) -> str:
    if isinstance(found, bool):
        return f"is {str(found).lower()}, "
    if isinstance(found, str | int | float):
        text = repr(found)
        return f"is {text if len(text) < 60 else text[:57] + '...'}, "
    return ""


def _words(text: str) -> list[str]:
    return [w.strip().strip("'") for w in text.replace(" or ", ", ").split(",")]


def _keys(model: type[BaseModel], place: Place, tables: Mapping[str, Any]) -> list[str]:
    """The keys that the table at `place` may have."""
    at: list[Any] = [model]
    for depth, part in enumerate(place, 1):
        value = value_at(tables, place[:depth])
        at = [inner for kind in at for inner in _inside(kind, part)]
        at = [kind for one in at for kind in _members(one) if _fits(kind, value)]
    return list(dict.fromkeys(key for kind in at if _is_model(kind) for key in kind.model_fields))


def _inside(annotation: Any, part: str | int) -> list[Any]:
    """What stands at `part` of a value of this type."""
    if _is_model(annotation):
        known = annotation.model_fields.get(part)
        return [known.annotation] if known else []
    inner = [a for a in get_args(annotation) if a is not Ellipsis]
    return inner[-1:] if get_origin(annotation) is dict else inner[:1] if isinstance(part, int) else []


def _members(annotation: Any) -> list[Any]:
    """The types of a union, one below the other."""
    origin = get_origin(annotation)
    if origin in (Union, types.UnionType):
        return [m for a in get_args(annotation) for m in _members(a)]
    if hasattr(annotation, "__metadata__"):
        return _members(get_args(annotation)[0])
    return [annotation]


def _fits(kind: Any, value: Any) -> bool:
    """Whether a table may be meant as one of this type: its `kind` is no other's."""
    if not _is_model(kind):
        return not isinstance(value, Mapping) or get_origin(kind) is dict
    tag = kind.model_fields.get("kind")
    names: tuple[Any, ...] = get_args(tag.annotation) if tag and get_origin(tag.annotation) is Literal else ()
    return not names or not isinstance(value, Mapping) or cast("Mapping[str, Any]", value).get("kind") in names


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)
