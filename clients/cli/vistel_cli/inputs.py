"""What a command is given is checked before it starts: every file is of a kind that it takes, every number is a number."""

from __future__ import annotations

import functools
import inspect
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_type_hints

import typer

from vistel_cli import kind_of_file as kinds
from vistel_cli.kind_of_file import Kind, kind_of_file
from vistel_cli.terminal import FAILED, USAGE, print_error

_MADE_BY: dict[Kind, str] = {
    kinds.CONFERENCE: "; `vistel examples FOLDER` makes one to begin with",
    kinds.LOG: "; `vistel up` records one below the folder where you type it",
    kinds.BVH: "; `vistel examples FOLDER` makes one, recordings/walk.bvh",
}
"""How somebody gets a file of this kind."""


@dataclass(frozen=True)
class Takes:
    """A parameter is an existing file of one of these kinds: `file: Annotated[Path, Takes(CONFERENCE), typer.Argument(...)]`.

    names: a text may also be a name of something built in, where no such file exists."""

    kinds: tuple[Kind, ...]
    names: bool = False

    def __init__(self, *some: Kind, names: bool = False) -> None:
        object.__setattr__(self, "kinds", some)
        object.__setattr__(self, "names", names)

    def fault(self, path: Path) -> str | None:
        """What is wrong with a file, in one line; None if nothing is."""
        try:
            found = kind_of_file(path)
        except OSError as e:
            return f"{path}: cannot be read: {e.strerror or e}"
        if found in self.kinds or (found is kinds.MISSING and self.names and not _is_path(path)):
            return None
        if found in kinds.UNSURE and any(k in kinds.TOMLS for k in self.kinds):
            return None
        if found is kinds.MISSING:
            first = next(iter(self.kinds), kinds.DATA)
            another = first is kinds.BVH and path.suffix.lower() != ".bvh"  # of the many that are imported
            return f"{path}: no such file{_close(path) or ('' if another else _MADE_BY.get(first, ''))}"
        *others, last = dict.fromkeys(k.name for k in self.kinds)
        expected = f"{', '.join(others)} or {last}" if others else last
        return f"{path}: expected {expected}; {found.told(path)}"


def guarded(command: Any) -> Any:
    """The command, or the group, whose inputs are checked when it is called: all faults are told, one line each. The lines of its
    help are as long as the terminal is wide."""
    command.help = command.help and re.sub(r"(?<=\S)\n(?=[^\s*-])", " ", command.help)
    for inner in getattr(command, "commands", {}).values():
        guarded(inner)
    run: Callable[..., Any] | None = command.callback
    if run is None or hasattr(command, "commands"):
        return command
    options = {p.name: p.opts[-1] if p.opts[-1].startswith("-") else "" for p in command.params}
    marks = parameters(run)

    @functools.wraps(run)
    def checked(**given: Any) -> Any:
        found = [f for name, value in given.items() for f in _faults(options.get(name, ""), value, marks.get(name))]
        for fault, _ in found:
            print_error(fault)
        if found:
            raise typer.Exit(max(code for _, code in found))
        return run(**given)

    command.callback = checked
    return command


def parameters(run: Callable[..., Any]) -> dict[str, Takes | None]:
    """The parameters of a command's function, and which files each takes."""
    hints = get_type_hints(inspect.unwrap(run), include_extras=True)
    return {
        name: next((m for m in getattr(hint, "__metadata__", ()) if isinstance(m, Takes)), None) for name, hint in hints.items()
    }


def _faults(option: str, value: Any, takes: Takes | None) -> Iterator[tuple[str, int]]:
    """Each with the exit code that it deserves: an option is used wrongly, a file is refused."""
    for one in value if isinstance(value, list | tuple) else [value]:
        if isinstance(one, float) and not math.isfinite(one):
            yield f"{option} {one}: expected a finite number", USAGE
        if option in ("--seconds", "--at", "--to", "--from") and isinstance(one, float) and one < 0:
            yield f"{option} {one:g}: expected seconds, 0 or more", USAGE
        if takes is not None and isinstance(one, str | Path) and (fault := takes.fault(Path(one))):
            yield f"{option} {fault}".strip(), FAILED


def _is_path(path: Path) -> bool:
    return len(path.parts) > 1 or path.suffix[1:].isalpha()


def _close(path: Path) -> str:
    """A file beside it with a name like it."""
    from difflib import get_close_matches

    beside = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else []
    like = get_close_matches(path.name, beside, 1, 0.7)
    return f"; did you mean {path.with_name(like[0])}?" if like else ""
