"""The log files of a run's processes, as they grow."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

MOST_BYTES = 256_000
"""Of one file, read at once."""
MOST_FILES = 100
"""Of a folder."""


class LogFiles:
    """Follows the logs of a folder, also where one is kept under another name and a new one begins."""

    def __init__(self, folder: Path, *, newest: bool = False) -> None:
        """newest: where more has been written than is read at once, what came before is left out; else it is read the next time."""
        self._folder, self._newest = folder, newest
        self._read: dict[Path, tuple[int, int]] = {}

    def new(self) -> Iterator[tuple[Path, list[str]]]:
        """The whole lines that each file has got since the last call."""
        for path in sorted(self._folder.glob("*.log"))[:MOST_FILES]:
            try:
                lines = self._lines(path)
            except OSError:  # kept under another name just now
                continue
            if lines:
                yield path, lines

    def _lines(self, path: Path) -> list[str]:
        now = path.stat()
        known, begin = self._read.get(path, (now.st_ino, 0))
        if known != now.st_ino or begin > now.st_size:
            begin = 0
        if begin == now.st_size:
            return []
        cut = self._newest and now.st_size - begin > MOST_BYTES
        with path.open("rb") as file:
            file.seek(now.st_size - MOST_BYTES if cut else begin)
            data = file.read(MOST_BYTES)
            end = data.rfind(b"\n") + 1 or (len(data) if len(data) == MOST_BYTES else 0)  # no line is so long
            self._read[path] = now.st_ino, file.tell() - len(data) + end
        return data[:end].decode("utf-8", "replace").splitlines()[1 if cut else 0 :]
