"""What the command prints: results on standard output, errors in one line on standard error."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

import typer
from rich.console import Console
from rich.text import Text

if TYPE_CHECKING:
    from vistel.conference.model import Conference

_PLAIN: dict[str, Any] = {"highlight": False, "markup": False, "emoji": False}
"""What is printed is plain text: no square bracket or colon of a path is markup. Colours come with `style` and `Text`."""
_UNBROKEN = 1000
"""Columns where output goes into a file or to another program: no line is broken there."""


def _columns(stream: TextIO) -> int | None:
    return None if stream.isatty() or "COLUMNS" in os.environ else _UNBROKEN


out = Console(width=_columns(sys.stdout), **_PLAIN)
err = Console(stderr=True, width=_columns(sys.stderr), **_PLAIN)

FAILED = 1
"""Exit code of a command that could not do what was asked."""
USAGE = 2
"""Exit code of a command that was called wrongly."""


def print_error(text: str) -> None:
    """Print an error in one line on standard error."""
    err.print(Text.assemble(("error:", "red"), f" {text}"), soft_wrap=True)


def print_warning(text: str) -> None:
    """Print a warning in one line on standard error."""
    err.print(text, style="yellow", soft_wrap=True)


def fail(text: str, code: int = FAILED) -> NoReturn:
    """Print what is wrong and how to mend it, and end the command."""
    print_error(text)
    raise typer.Exit(code)


def load_conference(path: Path, *, room_elsewhere: bool = False) -> Conference:
    """The conference of a file. Ends the command with one line per fault. room_elsewhere: see `load`."""
    from vistel.conference.files import ConferenceError, load

    try:
        return load(path, room_elsewhere=room_elsewhere)
    except ConferenceError as e:
        for line in str(e).splitlines():
            print_error(line)
        raise typer.Exit(FAILED) from e
