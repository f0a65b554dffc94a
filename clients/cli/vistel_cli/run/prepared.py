"""Makes sure that kernels are compiled and built-in people are made (`vistel_cli.run.prepare`).

Imports nothing that loads slowly, because mostly all is there.
"""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import os
import signal
import subprocess
import sys
import time
from importlib import metadata
from pathlib import Path

from rich.progress import BarColumn, Progress

import vistel
from vistel.conference.model import Conference, RoomConfig
from vistel.figure.avatar.cache_folder import default_cache
from vistel.wire import background
from vistel_cli.run.steps import WIDE_ENOUGH, time_taken, words
from vistel_cli.terminal import err, fail

STOPPED_PREPARING = "stopped while preparing; what is made already is kept"
"""Said where a start is stopped by then."""
INTERRUPTED = 130
"""Exit code of a preparation that was stopped."""
NO_FIGURES = "--no-figures"
"""Given to `vistel_cli.run.prepare` where nothing is drawn."""
KERNELS = "kernels"
"""A part of what is made: what every conference runs."""
ROOM = "room"
"""Another: what a room with things of its own takes."""
DRAWING = "drawing"
"""Another: what deforms figures."""
Person = tuple[str, str, float]
"""Another: somebody's figure. Avatar, name and height [m]."""
LINE_EVERY_S = 1.5
"""How often a line says how far it is, where there is no terminal for a bar."""
_ONE_THREAD = dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
"""Each core has a process of its own."""


async def prepare(conference: Conference, file: Path, stop: asyncio.Event, *, draws: bool = True, silent: bool = False) -> bool:
    """Make the missing parts and show the progress. Returns at once when all is there; False when `stop` was set meanwhile.
    draws: whether pictures are drawn here; else no figures are made.

    Exits with one line when it fails.
    """
    if is_prepared(conference, draws=draws):
        return True
    arguments = (str(file), *(() if draws else (NO_FIGURES,)))
    child = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "vistel_cli.run.prepare", *arguments, stdout=subprocess.PIPE, env=_ONE_THREAD | dict(os.environ)
    )
    following, stopping = background.start(show_steps(child, silent), "progress"), background.start(stop.wait(), "stop")
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


async def show_steps(child: asyncio.subprocess.Process, silent: bool) -> None:
    """Show what `child` says of its steps until it ends: in a terminal as a bar, elsewhere as a line every two seconds."""
    assert child.stdout is not None
    columns = (
        time_taken(),
        words("preparing, once: {task.description}"),
        *([BarColumn(bar_width=10)] if err.width >= WIDE_ENOUGH else []),
    )
    steps = done = kernels = 0
    doing, began, shown = "loading", time.monotonic(), -LINE_EVERY_S
    with Progress(*columns, console=err, transient=True, disable=silent or not err.is_terminal) as bar:
        task, line = bar.add_task(doing, total=None), b"begun loading"
        while line:
            word, _, said = line.decode().strip().partition(" ")
            steps += int(said) if word == "steps" else 0
            done += word == "done"
            kernels += word == "kernel"
            doing = "finishing" if done == steps > 0 else said if word in ("begun", "kernel") else doing
            text = f"{done} of {steps} steps done; {doing}" if steps else doing
            text += f", function {kernels}" if kernels and doing.startswith("compiling") else ""
            bar.update(task, completed=done, total=steps or None, description=text)
            now = time.monotonic() - began
            if not (silent or err.is_terminal) and now - shown >= LINE_EVERY_S:
                shown = now
                err.print(f"preparing, once: {text}, {now:.0f} s", soft_wrap=True)
            try:
                line = await asyncio.wait_for(child.stdout.readline(), LINE_EVERY_S / 2)
            except TimeoutError:
                line = b"waiting"


def is_prepared(conference: Conference, *, draws: bool) -> bool:
    """Whether all has been made."""
    return all(stamp.exists() for stamp in stamps_of(conference, draws=draws).values())


def stamps_of(conference: Conference, *, draws: bool) -> dict[str | Person, Path]:
    """What has to be made, each with a file that is there when it has been. draws: figures too."""
    room, people = conference.room, people_of(conference) if draws else []
    own_room = room.from_files or room.things
    parts: list[str | Person] = [KERNELS, *([ROOM] if own_room else []), *([DRAWING] if people else []), *people]
    code, folder = _fingerprint(), default_cache().parent
    of_room = f"{room.model_dump_json()} {_newest(room)}"
    texts = {part: f"{code} {part}" + (of_room if part == ROOM else "") for part in parts}
    return {part: folder / f"prepared-{hashlib.sha256(text.encode()).hexdigest()[:16]}" for part, text in texts.items()}


def lock_of_this_copy() -> Path:
    """The file that is locked while this copy of VISTEL prepares: another copy compiles for itself."""
    copy = hashlib.sha256(str(Path(vistel.__file__).parent.resolve()).encode()).hexdigest()[:16]
    return default_cache().parent / f"prepare-{copy}.lock"


def people_of(conference: Conference) -> list[Person]:
    """Everybody."""
    return [(p.avatar, p.name, p.height) for s in conference.sites for p in s.participants]


def _fingerprint() -> str:
    """Of all code."""
    text = f"{sys.version} {metadata.version('numba')}"
    for source in sorted(Path(vistel.__file__).parent.rglob("*.py")):
        text += f" {source.name} {source.stat().st_mtime_ns}"
    return text


def _newest(room: RoomConfig) -> list[int]:
    """When the files of a room were last changed; 0 for those that are not there."""
    files = [f for f in (room.file, *(t.file for t in room.things)) if f is not None]
    return [f.stat().st_mtime_ns if f.is_file() else 0 for f in files]
