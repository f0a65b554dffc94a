"""`vistel examples`: fills a folder with files to try the commands of the documentation with."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.text import Text

from vistel_cli.overwriting import Force, keep_existing
from vistel_cli.terminal import FAILED, USAGE, fail, out, print_warning
from vistel_cli.waiting import waiting

MEETING_S = 18
"""Length of the recorded meeting after all sites see each other; its log is some seconds longer [s]."""


def examples(
    folder: Annotated[Path, typer.Argument(help="Folder to write to; made if it is missing.")],
    recording: Annotated[
        bool, typer.Option("--recording/--no-recording", help="Hold a meeting of 18 s there too, which is recorded.")
    ] = True,
    force: Force = False,
) -> None:
    """Fill a folder with files to try the commands of the documentation with.

    [bold]Example[/bold]

      vistel examples my-folder
    """
    from vistel_cli.examples.made import EXAMPLES, CannotBeMadeError  # loads what makes meshes and people

    keep_existing(*(folder / name for example in EXAMPLES for name in example.files), force=force)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for example in EXAMPLES:
            try:
                with waiting(f"making {example.files[0]}"):
                    example.make(folder)
            except CannotBeMadeError as e:
                print_warning(f"{example.files[0]} is left out: {e}")
                continue
            out.print(
                Text.assemble((f"{example.files[0]:21}", "bold"), f"{example.what}\n{'':21}{example.command}"), soft_wrap=True
            )
    except OSError as e:
        fail(f"{e.filename or folder}: cannot be written: {e.strerror}", USAGE)
    if recording:
        _record(folder)
    if folder.resolve() != Path.cwd():
        out.print(f"The commands work in this folder; go there first: cd {shlex.quote(str(folder))}", soft_wrap=True)


def _record(folder: Path) -> None:
    """Hold a meeting in the folder."""
    out.print("A meeting of three people is recorded. It takes half a minute, the first time some minutes more.")
    meeting = [sys.executable, "-m", "vistel_cli.main", "up", "conference.toml", "--seconds", str(MEETING_S)]
    if subprocess.run(meeting, cwd=folder, check=False).returncode:
        fail(f"{folder}: the meeting failed, everything else is there; see {folder}/out/latest/logs", FAILED)
    _show("out/latest", "its films, and a log of all that happened", "vistel replay out/latest/conference.mcap")


def _show(name: str, what: str, command: str) -> None:
    out.print(Text.assemble((f"{name:21}", "bold"), f"{what}\n{'':21}{command}"), soft_wrap=True)
