"""What is said of wrinkle files that cannot be used."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

M = TypeVar("M", bound=BaseModel)


class WrinkleError(ValueError):
    """A wrinkle, or a file of wrinkles, that cannot be used; one line per fault: file: key: what was expected."""


class Entry(BaseModel):
    """A table of a wrinkle file: unknown keys are faults."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a file. Raises WrinkleError."""
    try:
        return parsed(path.read_text("utf-8"), path)
    except OSError as fault:
        raise WrinkleError(f"{path}: cannot be read: {fault.strerror or fault}") from fault
    except UnicodeDecodeError as fault:
        raise WrinkleError(f"{path}: not valid TOML: {fault}") from fault


def parsed(text: str, source: Path | str) -> dict[str, Any]:
    """The tables of a text. Raises WrinkleError, one line that names `source`."""
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as fault:
        raise WrinkleError(f"{source}: not valid TOML: {fault}") from fault


def checked(model: type[M], data: dict[str, Any], source: Path | str) -> M:
    """The tables as `model`. Raises WrinkleError, one line per fault, which names `source` and the key."""
    try:
        return model.model_validate(data)
    except ValidationError as fault:
        lines = [f"{source}: {_key(e['loc'])}: {_said(e, model)}" for e in fault.errors()]
        raise WrinkleError("\n".join(dict.fromkeys(lines))) from fault


def _key(place: tuple[int | str, ...]) -> str:
    out = ""
    for part in place:
        out += f"[{part}]" if isinstance(part, int) else f".{part}" if out else str(part)
    return out or "file"


def _said(fault: Any, model: type[BaseModel]) -> str:
    if fault["type"] == "extra_forbidden":
        return f"unknown attribute; there are {', '.join(_known(model, fault['loc'][:-1]))}"
    text = str(fault["msg"]).removeprefix("Value error, ")
    found = fault.get("input")
    return f"is {found!r}: {text}" if isinstance(found, str | int | float | bool) else text


def _known(model: type[BaseModel], place: tuple[int | str, ...]) -> list[str]:
    """The keys of the table at `place`."""
    at: Any = model
    for part in place:
        if isinstance(part, str):
            field = at.model_fields.get(part)
            if field is None:
                break
            at = _table(field.annotation) or at
    return list(at.model_fields)


def _table(annotation: Any) -> type[BaseModel] | None:
    """The model in an annotation such as list[Point] or Point | None."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in get_args(annotation):
        found = _table(inner)
        if found is not None:
            return found
    return None
