"""How the command speaks: results on standard output, faults in one line on standard error."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn

import typer
from rich.console import Console

from vistel.conference.files import ConferenceError, load
from vistel.conference.model import Conference

out = Console(highlight=False)
err = Console(stderr=True, highlight=False)

FAILED = 1
"""Exit code of a command that could not do what was asked."""
USAGE = 2
"""Exit code of a command that was called wrongly."""


def fail(text: str, code: int = FAILED) -> NoReturn:
    """Say what is wrong and how to mend it, and end."""
    err.print(f"[red]error:[/red] {text}", soft_wrap=True)
    raise typer.Exit(code)


def load_conference(path: Path, *, room_elsewhere: bool = False) -> Conference:
    """The conference of a file, or the end of the command with one line per fault. room_elsewhere: see `load`."""
    try:
        return load(path, room_elsewhere=room_elsewhere)
    except ConferenceError as e:
        for line in str(e).splitlines():
            err.print(f"[red]error:[/red] {line}", soft_wrap=True, markup=True)
        raise typer.Exit(USAGE) from e
