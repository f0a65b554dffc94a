"""What the command prints: results on standard output, errors in one line on standard error."""

from __future__ import annotations

import os
import sys
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from vistel.conference.model import Conference

    out: Console
    err: Console

_PLAIN: dict[str, Any] = {"highlight": False, "markup": False, "emoji": False}
"""What is printed is plain text: no square bracket or colon of a path is markup. Colours come with `style` and `Text`."""
_UNBROKEN = 1000
"""Columns where output goes into a file or to another program: no line is broken there."""

_NARROWEST = 60
"""A terminal with fewer columns breaks lines itself."""


def _columns(stream: TextIO) -> int | None:
    return None if stream.isatty() or "COLUMNS" in os.environ else _UNBROKEN


def _console(name: str) -> Console:
    return globals().get(name) or __getattr__(name)


def __getattr__(name: str) -> Any:
    """`out` and `err`, made when they are first used: rich takes longer to load than many a command needs for all else."""
    if name not in ("out", "err"):
        raise AttributeError(name)
    from rich.console import Console

    to_err = name == "err"
    globals()[name] = made = Console(stderr=to_err, width=_columns(sys.stderr if to_err else sys.stdout), **_PLAIN)
    return made


FAILED = 1
"""Exit code of a command that could not do what was asked."""
USAGE = 2
"""Exit code of a command that was called wrongly."""


def indented(text: str, columns: int) -> str:
    """`text` for what stands so many columns from the left: its further lines, where the terminal ends, stand there, too."""
    width = (_columns(sys.stdout) or max(_console("out").width, _NARROWEST)) - columns
    return f"\n{' ' * columns}".join(textwrap.wrap(text, width, break_on_hyphens=False, break_long_words=False))


def print_error(text: str) -> None:
    """Print an error in one line on standard error."""
    from rich.text import Text

    _console("err").print(Text.assemble(("error:", "red"), f" {text}"), soft_wrap=True)


def print_warning(text: str) -> None:
    """Print a warning in one line on standard error."""
    _console("err").print(text, style="yellow", soft_wrap=True)


def fail(text: str, code: int = FAILED) -> NoReturn:
    """Print what is wrong and how to mend it, and end the command."""
    print_error(text)
    raise typer.Exit(code)


def refuse(reason: str) -> NoReturn:
    """Print why what was asked for is not done, and end the command."""
    from rich.text import Text

    _console("err").print(Text.assemble(("refused:", "red"), f" {reason}"), soft_wrap=True)
    raise typer.Exit(FAILED)


def load_conference(path: Path, *, room_elsewhere: bool = False) -> Conference:
    """The conference of a file. Ends the command with one line per fault. room_elsewhere: see `load`."""
    from vistel.conference.files import ConferenceError, load

    try:
        return load(path, room_elsewhere=room_elsewhere)
    except ConferenceError as e:
        for line in str(e).splitlines():
            print_error(line)
        raise typer.Exit(FAILED) from e
