"""Where a command may write: over no file that was there before, unless it is told to with --force, and in folders that exist."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from vistel_cli.terminal import fail

Force = Annotated[bool, typer.Option("--force", is_eager=True, help="Write over files that exist.")]
"""An option beside every `out_file`."""


def out_file(help: str, *names: str) -> Any:
    """An option for a file to write, by default -o and --out. Where the file exists, or one written beside it, it is refused, and
    so is a place where there is no folder: before the work, not after it."""

    def checked(context: typer.Context, file: Path | None) -> Path | None:
        if file is not None:
            _need_folder(file)
            keep_existing(file, *_beside(file), force=context.params["force"])
        return file

    return typer.Option(*(names or ("-o", "--out")), help=help, callback=checked)


def _need_folder(file: Path) -> None:
    if os.path.isdir(file):
        fail(f"{file}: cannot be written: it is a folder; name a file in it")
    if not os.path.isdir(file.parent):
        fail(f"{file}: cannot be written: there is no folder {file.parent}; make it first, or name another place")


def keep_existing(*files: Path, force: bool) -> None:
    """Ends the command with one line when one of `files`, which it is about to write, exists and may not be written over."""
    there = [str(f) for f in files if os.path.exists(f)]  # False, too, where it cannot be known
    if there and not force:
        more = f" (and {len(there) - 1} more)" if len(there) > 1 else ""
        fail(f"{there[0]}{more}: exists already; name another place, or write over it with --force")


@contextmanager
def written_whole(output: Path) -> Iterator[Path]:
    """A place beside `output` to write to. What is there at the end of the block is moved to `output`; where the block is left
    before, as on Ctrl-C, nothing stays. Ends the command with one line where the system refuses."""
    try:
        with tempfile.TemporaryDirectory(prefix=".vistel-", dir=output.parent) as folder:
            made = Path(folder) / output.name
            yield made
            made.replace(output)
    except OSError as e:
        fail(f"--out {output}: cannot be written: {e.strerror or e}")


def keep_source(source: Path, output: Path) -> None:
    """Ends the command with one line when what is read would be written over, which --force does not ask for."""
    if output.resolve() == source.resolve():
        fail(f"--out {output}: is the log itself; name another file")


def _beside(file: Path) -> list[Path]:
    """What the writers of OBJ and USD put beside it: material, textures, parts."""
    if file.suffix.lower() == ".obj":
        return [file.with_suffix(".mtl"), file.with_suffix(".png")]
    if file.suffix.lower() in (".usda", ".usdc", ".usd"):
        return [file.with_name(f"{file.stem}_{what}") for what in ("texture.png", "textures", "parts")]
    return []
