"""The console in a browser: how soon it shows the room, how late, for how many viewers, and what a long log costs it.

Three live sites, 50 viewers, logs of an hour and of a gigabyte, in Chromium. Where the processor draws in place of a graphics card,
times that hang on drawing are given and not judged.
"""

from collections.abc import Iterator

from benchmarks.pages import console_live, console_logs
from benchmarks.row import Row


def run() -> Iterator[Row]:
    """The live room, then logs."""
    yield from console_live.rows()
    yield from console_logs.rows()
