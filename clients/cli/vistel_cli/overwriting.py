"""No command writes over a file that was there before it, unless it is told to with --force."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vistel_cli.terminal import USAGE, fail

Force = Annotated[bool, typer.Option("--force", help="Write over files that exist.")]


def keep_existing(*files: Path | None, force: bool) -> None:
    """Ends the command with one line when one of `files`, which it is about to write, exists and may not be written over. None
    stands for a file that is not asked for."""
    there = [str(f) for f in files if f is not None and f.exists()]
    if there and not force:
        more = f" (and {len(there) - 1} more)" if len(there) > 1 else ""
        fail(f"{there[0]}{more}: exists already; name another place, or write over it with --force", USAGE)
