"""Which conferences run on this machine, or have a site on it: a small file for each in the user's own folder, locked while its
process lives."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Generator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from vistel.figure.avatar.cache_folder import default_state
from vistel.whole_file import whole_file

if sys.platform != "win32":
    import fcntl
if TYPE_CHECKING:  # slow to load
    from vistel.conference.model import Conference


NONE_HERE = (
    "this machine takes part in no conference; start one with `vistel up`, wait while one prepares,"
    " or name the file of one that runs elsewhere"
)
"""What to do where no conference is found. One that prepares is not noted yet."""
_STUDIO = ".studio"
"""Ending of the file that says where studios are."""


@dataclass(frozen=True)
class Running:
    """A conference that runs, called `name`. hub: its router, such as "tcp/127.0.0.1:7447"; file: its conference file; folder:
    where its films, log and report go; started_ns: since the epoch; people: participants, with their sites; pages: addresses
    for browsers by site; run: the folder of its ports and sockets; console: address of its console, empty for none; site: the one
    of this machine, of a conference whose world runs elsewhere: then only its people are named."""

    name: str
    hub: str
    file: str
    folder: str
    started_ns: int
    people: dict[str, str] = field(default_factory=dict[str, str])
    pages: dict[str, str] = field(default_factory=dict[str, str])
    run: str = ""
    console: str = ""
    site: str = ""


def running_folder() -> Path:
    """The folder with a file for each running conference of this user; it ends with the user's session where the system has such a
    folder."""
    if runtime := os.environ.get("XDG_RUNTIME_DIR"):
        return Path(runtime) / "vistel"
    return default_state() / "running"


@contextmanager
def announced(running: Running) -> Generator[None]:
    """List the conference for other processes until the block or this process ends. A folder that cannot be written is no error:
    others then need the router's address."""
    with _listed(f"{os.getpid()}.json", json.dumps(asdict(running), indent=2)):
        yield


@contextmanager
def studio_announced(address: str) -> Generator[None]:
    """Tell other processes where the studios are, until the block or this process ends."""
    with _listed(f"{os.getpid()}{_STUDIO}", address):
        yield


def studio_here() -> str:
    """Address of the studios that run on this machine; empty for none."""
    for path in running_folder().glob(f"*{_STUDIO}"):
        with suppress(OSError, ValueError):  # removed meanwhile, or of another program
            if not _removed(path):
                return path.read_text("utf-8")
    return ""


@contextmanager
def _listed(name: str, text: str) -> Generator[None]:
    path = running_folder() / name
    held: int | None = None
    with suppress(OSError):
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with whole_file(path, private=True) as stream:
            stream.write(text.encode())
            if sys.platform != "win32":  # locked before anybody sees it, through a handle that outlives the stream
                held = os.dup(stream.fileno())
                fcntl.flock(held, fcntl.LOCK_EX)
    try:
        yield
    finally:
        with suppress(OSError):
            path.unlink()
        if held is not None:
            os.close(held)


def running_conferences(name: str | None = None) -> list[Running]:
    """Those that run on this machine now, of that name or all, the newest first."""
    return [r for r in _announced() if not r.site and name in (None, r.name)]


def conferences_here() -> list[Running]:
    """Those that run on this machine now and those that a site of it has joined, the newest first. One that several sites have
    joined is told once, as that of the newest, with the people of all."""
    found: dict[tuple[str, str], Running] = {}
    for running in _announced():
        key = (running.name, running.hub)
        other = found.get(key, running)
        if other.site and not running.site:
            other = running
        found[key] = replace(other, people=running.people | other.people)
    return list(found.values())


def _announced() -> list[Running]:
    """All that is announced, the newest first. Removes the files of processes that have ended."""
    found: list[Running] = []
    for path in running_folder().glob("*.json"):
        with suppress(OSError, ValueError, TypeError):  # removed meanwhile, or of another program
            if _removed(path):
                continue
            found.append(Running(**json.loads(path.read_bytes())))
    return sorted(found, key=lambda r: r.started_ns, reverse=True)


def router_of(conference: Conference) -> str | None:
    """The router of a conference: that of the newest of this name that runs here, unless the file names routers; else the file's,
    with commas between them; None where there is neither."""
    here = running_conferences(conference.name) if conference.bus.mode == "embedded" else []
    return here[0].hub if here else ",".join(conference.bus.endpoints) or None


def _removed(path: Path) -> bool:
    """Whether the process that wrote the file is dead: only then its lock is free. The file is removed then. Raises OSError."""
    if dead := _left_behind(path):
        path.unlink()
    return dead


def _left_behind(path: Path) -> bool:
    if sys.platform == "win32":
        return False
    with path.open("rb") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            return False
        return True
