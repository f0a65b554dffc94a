"""Wrinkle sets as one TOML text with all shapes they need, as an avatar's file keeps them."""

from collections.abc import Sequence
from typing import Any, cast

from pydantic import BaseModel

from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.shape import WrinkleShape
from vistel.wrinkle.shape_file import builtin_shapes
from vistel.wrinkle.wrinkle_sets import WrinkleSet


def sets_text(sets: Sequence[WrinkleSet]) -> str:
    """The text of sets, with the shapes that are not built in; `wrinkle_sets.sets_in` reads it. Raises WrinkleError where two of
    these shapes have the same name."""
    own, named = _own(sets)
    lines: list[str] = []
    for shape in own:
        lines += ["[[shapes]]", *_pairs(shape, ("branches",)), *_tables("shapes.branches", shape.branches), ""]
    for each in sets:
        wrinkles = [w.model_copy(update={"shape": named.get(id(each.shape(w.shape)), w.shape)}) for w in each.entry.wrinkles]
        lines += ["[[sets]]", *_pairs(each.entry, ("wrinkles",)), *_tables("sets.wrinkles", wrinkles), ""]
    return "\n".join(lines)


def _own(sets: Sequence[WrinkleSet]) -> tuple[list[WrinkleShape], dict[int, str]]:
    """Shapes that are not built in, and by identity the names of all shapes."""
    builtin, own, named = builtin_shapes(), dict[str, WrinkleShape](), dict[int, str]()
    for each in sets:
        for shape in each.shapes.values():
            known = builtin.get(shape.name, own.get(shape.name))
            if known is not None and known != shape:
                raise WrinkleError(f"{each.source}: two shapes are called {shape.name!r}; give one another name")
            if known is None:
                own[shape.name] = shape
            named[id(shape)] = shape.name
    return list(own.values()), named


def _tables(name: str, rows: Sequence[BaseModel]) -> list[str]:
    return [line for row in rows for line in (f"[[{name}]]", *_pairs(row))]


def _pairs(of: BaseModel, without: Sequence[str] = ()) -> list[str]:
    said = of.model_dump(exclude_defaults=True, exclude_none=True, exclude=set(without))
    return [f"{key} = {_value(value)}" for key, value in said.items()]


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {_value(v)}" for k, v in cast(dict[str, Any], value).items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(v) for v in cast(list[Any], value)) + "]"
    if isinstance(value, str):
        plain = value.replace("\\", "\\\\").replace('"', '\\"')
        return '"' + "".join(c if c >= " " and c != "\x7f" else f"\\u{ord(c):04x}" for c in plain) + '"'
    return repr(value)
