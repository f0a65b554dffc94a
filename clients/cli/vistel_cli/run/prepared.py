"""Makes sure that kernels are compiled and built-in people are made (`vistel_cli.run.prepare`).

Imports nothing that loads slowly, because mostly all is there.
"""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import signal
import subprocess
import sys
from importlib import metadata
from pathlib import Path

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

import vistel
from vistel.conference.model import Conference, RoomSettings
from vistel.figure.avatar.cache_folder import default_cache
from vistel.wire import background
from vistel_cli.terminal import err, fail

INTERRUPTED = 130
"""Exit code of a preparation that was stopped."""


async def prepare(conference: Conference, file: Path, stop: asyncio.Event, *, silent: bool = False) -> bool:
    """Make the missing parts and show the progress. Returns at once when all is there; False when `stop` was set meanwhile.

    Exits with one line when it fails.
    """
    if stamp_of(conference).exists():
        return True
    columns = (TextColumn("preparing, once: {task.description}", markup=False), BarColumn(bar_width=20), TimeElapsedColumn())
    command = (sys.executable, "-m", "vistel_cli.run.prepare", str(file))
    with Progress(*columns, console=err, transient=True, disable=silent) as bar:
        task = bar.add_task("starting", total=None)
        child = await asyncio.create_subprocess_exec(*command, stdout=subprocess.PIPE)

        async def follow() -> None:
            assert child.stdout is not None
            async for line in child.stdout:
                done, of, label = line.decode().strip().split(" ", 2)
                bar.update(task, completed=int(done), total=int(of), description=label)

        following, stopping = background.start(follow(), "progress"), background.start(stop.wait(), "stop")
        await asyncio.wait({following, stopping}, return_when=asyncio.FIRST_COMPLETED)
        stopping.cancel()
        if not following.done():
            with contextlib.suppress(ProcessLookupError):
                child.terminate()
        await following
        code = await child.wait()
    if stop.is_set() or code in (INTERRUPTED, -signal.SIGINT, -signal.SIGTERM):
        return False
    if code != 0:
        fail(f"preparing the conference failed with {code}; `python -m vistel_cli.run.prepare {file}` shows why")
    return True


def stamp_of(conference: Conference) -> Path:
    """A file that is there when all has been made."""
    return default_cache().parent / f"prepared-{_fingerprint(conference)}"


def people_of(conference: Conference) -> list[tuple[str, str, float]]:
    """Avatar, name and height [m] of everybody."""
    return [(p.avatar, p.name, p.height) for s in conference.sites for p in s.participants]


def _fingerprint(conference: Conference) -> str:
    text = f"{sys.version} {metadata.version('numba')} {people_of(conference)}"
    if conference.room.from_files:
        text += f" {conference.room.model_dump_json()} {_newest(conference.room)}"
    for source in sorted(Path(vistel.__file__).parent.rglob("*.py")):
        text += f" {source.name} {source.stat().st_mtime_ns}"
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _newest(room: RoomSettings) -> list[int]:
    """When the files of a room were last changed; 0 for those that are not there."""
    files = [f for f in (room.file, *(t.file for t in room.things)) if f is not None]
    return [f.stat().st_mtime_ns if f.is_file() else 0 for f in files]
