"""One log line per event, the same in every process: time, level, node, logger, message.

2026-11-21T09:15:02.123Z INFO  tokyo/capture vistel.tracker streaming device=ada-tracker rate_hz=30.0
"""

from __future__ import annotations

import logging
import sys
import time
from pathlib import Path


class _Formatter(logging.Formatter):
    converter = time.gmtime

    def __init__(self, node: str) -> None:
        super().__init__(f"%(asctime)s.%(msecs)03dZ %(levelname)-7s {node} %(name)s %(message)s", "%Y-%m-%dT%H:%M:%S")

    def format(self, record: logging.LogRecord) -> str:
        """One line even for a traceback: its newlines become ' | '."""
        return super().format(record).replace("\n", " | ")


def configure(node: str, level: str = "INFO") -> None:
    """Send this process's log to standard error in the one format. `node`: "site/process"."""
    _install(logging.StreamHandler(sys.stderr), node, level)


def configure_file(node: str, path: Path, level: str = "INFO") -> None:
    """The same into a file, for a process whose standard error is a person's terminal."""
    _install(logging.FileHandler(path, encoding="utf-8"), node, level)


def _install(handler: logging.Handler, node: str, level: str) -> None:
    handler.setFormatter(_Formatter(node))
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(level)
    logging.getLogger("numba").setLevel(logging.WARNING)
