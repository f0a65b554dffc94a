"""The folder in which a room is kept: the names of its files, who may write there, and rooms of earlier meetings beside it.

Files are TERM-STEP.snapshot and TERM-STEP.journal. Rooms that are not resumed lie in folders of their own, named by
the time at which they ended; nothing here removes those.
"""

from __future__ import annotations

import os
import re
import sys
from datetime import UTC, datetime
from pathlib import Path

from vistel.whole_file import sync_folder

if sys.platform != "win32":
    import fcntl

RESUMED_S = 600.0
"""A room whose last step is no older is resumed by itself; an older one belongs to another meeting [s]."""

_NAME = re.compile(r"(\d{6,10})-(\d{14})\.(snapshot|journal)")


class RoomFolder:
    """Snapshots and journals of one room, and its lock."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock: int | None = None

    def files(self, kind: str) -> list[tuple[int, int]]:
        """Term and step of each "snapshot" or "journal", the oldest first."""
        try:
            names = [_NAME.fullmatch(p.name) for p in self.path.iterdir()]
        except OSError:
            return []
        return sorted((int(m[1]), int(m[2])) for m in names if m is not None and m[3] == kind)

    def file(self, term: int, step: int, kind: str) -> Path:
        """Where a snapshot or journal lies."""
        return self.path / f"{term:06d}-{step:014d}.{kind}"

    def next_term(self) -> int:
        """A term under which nothing stands here yet; 0 when nothing does."""
        terms = [term for kind in ("snapshot", "journal") for term, _ in self.files(kind)]
        return max(terms) + 1 if terms else 0

    def lock(self) -> bool:
        """Whether this process may write here now: no other one that lives does."""
        if self._lock is not None or sys.platform == "win32":
            return True
        handle = os.open(self.path / "lock", os.O_CREAT | os.O_RDWR, 0o600)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(handle)
            return False
        self._lock = handle
        return True

    def unlock(self) -> None:
        """Another process may write here."""
        if self._lock is not None:
            held, self._lock = self._lock, None
            os.close(held)

    def set_aside(self, ended_ns: int) -> Path:
        """Move all snapshots and journals into a folder of their own. ended_ns: time of the last step. Raises OSError."""
        name = f"{datetime.fromtimestamp(ended_ns * 1e-9, UTC):%Y-%m-%dT%H%MZ}"
        number, to = 1, self.path / name
        while to.exists():
            number, to = number + 1, self.path / f"{name}-{number + 1}"
        to.mkdir()
        for kind in ("snapshot", "journal"):
            for key in self.files(kind):
                os.replace(self.file(*key, kind), to / self.file(*key, kind).name)
        sync_folder(to)
        sync_folder(self.path)
        return to
