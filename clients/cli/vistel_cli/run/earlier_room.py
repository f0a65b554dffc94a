"""The room that a conference keeps: how it begins, and an earlier one to begin with."""

from __future__ import annotations

import time
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.persistence.folder import RESUMED_S, RoomFolder
from vistel_cli.terminal import fail


def _there(earlier: Path | None) -> Path | None:
    """An earlier room that is asked for, before anything else is done. Ends the command with one line where it is not there."""
    if earlier is not None and not earlier.exists():
        rooms = [folder.name for folder in sorted(earlier.parent.glob("*Z")) if folder.is_dir()]
        there = f"in {earlier.parent} are {', '.join(rooms)}" if rooms else f"no earlier room is kept in {earlier.parent}"
        fail(f"--from {earlier}: no such file or folder; {there}")
    return earlier


FromRoom = Annotated[
    Path | None,
    typer.Option("--from", help="Earlier room to begin with: the folder in which it was kept, or a snapshot.", callback=_there),
]


def resume(conference: Conference, paths: RunPaths, earlier: Path | None, place: str | None = None) -> None:
    """Let the world at `place`, by default that which leads at first, begin with an earlier room, if one is given. Ends the command
    with one line where it cannot."""
    if earlier is None:
        return
    from vistel_services.world import service as world  # loads the mathematics

    site = next((s for s in conference.sites if s.name == (place or conference.world.on)), None)
    try:
        world.resume(world.configure(conference, site, paths), earlier, time.time_ns())
    except ValueError as e:
        fail(f"--from {e}")
    except OSError as e:
        fail(f"--from {earlier}: the room cannot be kept: {e.strerror or e}")


def kept_line(conference: Conference) -> dict[str, str]:
    """Where the room is kept and how it begins, for people; nothing where it ends with the run."""
    folder = conference.world.folder
    if folder is None:
        return {}
    room = RoomFolder(folder if conference.world.on == "hub" else folder / conference.world.on)
    newest = max((room.file(*key, "snapshot").stat().st_mtime for key in room.files("snapshot")), default=0.0)
    ago_s = time.time() - newest
    if not newest:
        return {"room": str(folder)}
    if ago_s < RESUMED_S:
        return {"room": f"{folder}, as it was {ago_s:.0f} s ago"}
    return {"room": f"{folder}, begins anew; that of {datetime.fromtimestamp(newest):%d %b %H:%M} is kept there (--from)"}
