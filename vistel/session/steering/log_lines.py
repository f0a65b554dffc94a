"""Lines of the logs of a run's processes, the newest of them, as the console shows them to the host."""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass
from pathlib import Path

from vistel.session.log_files import LogFiles

KEPT = 2000
"""Lines, the newest of all processes."""
SHOWN = 200
"""Of those that a filter lets through, the newest."""
MOST_LETTERS = 400
"""Of a line; the rest is cut off."""
LEVELS = ("DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL")
_LINE = re.compile(r"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z) +([A-Z]+) +(\S+) (.*)")


@dataclass(frozen=True)
class LogLine:
    """time: UTC, "2026-11-21T09:15:02.123Z", empty where the line has none, as those of libraries; node: "site/process"."""

    time: str
    level: str
    node: str
    text: str

    def passes(self, level: str, node: str, text: str) -> bool:
        """Whether it is at least as grave as `level`, of the process `node` and has `text` in it; empty: any."""
        grave = LEVELS.index(self.level) >= LEVELS.index(level) if level in LEVELS else True
        return grave and node in ("", self.node) and text.lower() in f"{self.node} {self.text}".lower()


class LogLines:
    """Follows the log files of a folder."""

    def __init__(self, folder: Path) -> None:
        self._files = LogFiles(folder, newest=True)
        self._lines = deque[LogLine](maxlen=KEPT)
        self.changes = 0
        """How often lines have come."""

    def take(self) -> None:
        """Read what has been written since the last call."""
        new = [line for path, lines in self._files.new() for line in _parsed(lines, path.stem.replace("-", "/", 1))]
        if new:
            self._lines.extend(sorted(new, key=lambda line: line.time))
            self.changes += 1

    def newest(self, level: str = "", node: str = "", text: str = "") -> list[LogLine]:
        """Those that pass, the oldest first."""
        found: list[LogLine] = []
        for line in reversed(self._lines):
            if line.passes(level, node, text):
                found.append(line)
                if len(found) == SHOWN:
                    break
        return found[::-1]

    def nodes(self) -> list[str]:
        """The processes that have said something."""
        return sorted({line.node for line in self._lines})


def _parsed(lines: list[str], node: str) -> list[LogLine]:
    """Lines of one file. What is in no line's form, as what libraries print, is of the time of the line before."""
    out: list[LogLine] = []
    time = ""
    for line in lines:
        said = "".join(c if c.isprintable() else " " for c in line[:MOST_LETTERS])
        found = _LINE.fullmatch(said)
        if found and found[2] in LEVELS:
            time = found[1]
            out.append(LogLine(time, found[2], found[3], found[4]))
        elif said.strip():
            out.append(LogLine(time, "INFO", node, said))
    return out
