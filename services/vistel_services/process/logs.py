"""One log line per event, the same in every process: time, level, node, logger, message.

2026-11-21T09:15:02.123Z INFO  tokyo/capture vistel.tracker streaming device=ada-tracker rate_hz=30.0
"""

from __future__ import annotations

import logging
import os
import sys
import time
from logging.handlers import RotatingFileHandler
from pathlib import Path

MOST_BYTES = 10_000_000
"""Of a log; then it is kept as LOG.1, and a new one begins."""
KEPT = 3
"""How many earlier ones are."""


class _Formatter(logging.Formatter):
    converter = time.gmtime

    def __init__(self, node: str) -> None:
        super().__init__(f"%(asctime)s.%(msecs)03dZ %(levelname)-7s {node} %(name)s %(message)s", "%Y-%m-%dT%H:%M:%S")

    def format(self, record: logging.LogRecord) -> str:
        """One line even for a traceback: its newlines become ' | '."""
        return super().format(record).replace("\n", " | ")


class _Redirected(logging.StreamHandler):  # pyright: ignore[reportMissingTypeArgument]
    """Standard error that is a file, with all that libraries write there too."""

    def emit(self, record: logging.LogRecord) -> None:
        """As `logging.Handler.emit`."""
        super().emit(record)
        try:
            if os.fstat(2).st_size > MOST_BYTES:
                begin_anew(Path(os.readlink("/proc/self/fd/2")))
        except OSError:  # another system, or a disk that refuses: the file grows on
            pass


def begin_anew(path: Path) -> None:
    """Keep the file that standard error goes to as PATH.1, earlier ones as PATH.2 and so on, and go on in a new one. Raises
    OSError."""
    to_it = [fd for fd in (1, 2) if os.path.samestat(os.fstat(fd), path.stat())]
    for number in range(KEPT, 0, -1):
        earlier = path.with_name(f"{path.name}.{number - 1}") if number > 1 else path
        if earlier.exists():
            earlier.replace(path.with_name(f"{path.name}.{number}"))
    new = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    for fd in to_it:
        os.dup2(new, fd)
    os.close(new)


def configure(node: str, level: str = "INFO", *, redirected: bool = False) -> None:
    """Send this process's log to standard error in the one format. node: "site/process"; redirected: that is a file of a run."""
    _install(_Redirected(sys.stderr) if redirected else logging.StreamHandler(sys.stderr), node, level)


def configure_file(node: str, path: Path, level: str = "INFO") -> None:
    """The same into a file, for a process whose standard error is a person's terminal."""
    _install(RotatingFileHandler(path, maxBytes=MOST_BYTES, backupCount=KEPT, encoding="utf-8"), node, level)


def _install(handler: logging.Handler, node: str, level: str) -> None:
    handler.setFormatter(_Formatter(node))
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(level)
    logging.getLogger("numba").setLevel(logging.WARNING)
