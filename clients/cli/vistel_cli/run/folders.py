"""Where a run keeps its films, log and report: a folder of its own in `out/`, and `out/latest`, a link to the newest."""

from __future__ import annotations

import os
import re
import sys
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from vistel_cli.terminal import fail

if sys.platform != "win32":
    import fcntl

OutFolder = Annotated[
    Path | None, typer.Option("-o", "--out", help="Folder for films, log and logs of processes; default: a new one in out/.")
]
RUNS = Path("out")
"""The folder of runs, below the folder in which a command is called."""
LATEST = "latest"
_NAME = re.compile(r"\d{4}-\d{2}-\d{2}T\d{4}-.+")


def run_folder(given: Path | None, name: str, *, latest: bool = True) -> Path:
    """The folder that the user gave, made where it is missing; else a new one, such as out/2026-11-22T0902-demo, for a run called
    `name`. It is in use until this process ends. latest: out/latest leads to a new one from now on."""
    folder = _made(given, name, latest=latest)
    if sys.platform != "win32":
        with suppress(OSError):  # a file system without locks
            fcntl.flock(os.open(folder, os.O_RDONLY), fcntl.LOCK_SH)
    return folder


def in_use(folder: Path) -> bool:
    """Whether the process still lives that the folder was made for. (Never where the system has no such locks.)"""
    if sys.platform == "win32":
        return False
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        finally:
            os.close(handle)
    return False


def _made(given: Path | None, name: str, *, latest: bool) -> Path:
    if given is not None:
        try:
            given.mkdir(parents=True, exist_ok=True)
        except FileExistsError:
            fail(f"--out {given}: is a file; name a folder")
        except OSError as e:
            fail(f"--out {given}: cannot be made: {e.strerror}")
        return given
    stamp = f"{datetime.now():%Y-%m-%dT%H%M}-{name}"
    number = 1
    while True:
        folder = RUNS / (stamp if number == 1 else f"{stamp}-{number}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            number += 1
            continue
        except OSError as e:
            fail(f"{folder}: cannot be made: {e.strerror}; name another folder with --out")
        if latest:
            lead_to(folder)
        return folder


def forget(folder: Path) -> None:
    """Remove the folder of a run that has ended before its first process began, unless something else is in it."""
    with suppress(OSError):
        (folder / "logs" / "supervisor.log").unlink(missing_ok=True)
    for empty in (folder / "logs", folder):
        with suppress(OSError):
            empty.rmdir()


def runs_in(folder: Path) -> list[Path]:
    """The folders of runs in `folder`, the newest first."""
    made = (f for f in folder.glob("*") if _NAME.fullmatch(f.name) and f.is_dir() and not f.is_symlink())
    return sorted(made, key=lambda f: (f.name[:15], len(f.name), f.name), reverse=True)


def lead_to(folder: Path) -> None:
    """From now on out/latest leads to the folder of a run, unless the user named another one for it."""
    if folder.parent != RUNS or not _NAME.fullmatch(folder.name):
        return
    link, new = folder.parent / LATEST, folder.parent / f".{LATEST}-{os.getpid()}"
    with suppress(OSError):  # a system without links, or somebody's own file of that name
        if link.is_symlink() or not link.exists():
            new.symlink_to(folder.name, target_is_directory=True)
            new.replace(link)
