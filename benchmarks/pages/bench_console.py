"""The console in a browser: how soon it shows the room, how late, for how many viewers, and what a long log costs it.

Three live sites, 50 viewers, logs of an hour and of a gigabyte, in Chromium. Where the processor draws in place of a graphics card,
times that hang on drawing are given and not judged.
"""

from collections.abc import Iterator, Sequence

from benchmarks.pages import console_live, console_logs
from benchmarks.parts import rows_of
from benchmarks.row import Row

PARTS = {"live": console_live.rows, "logs": console_logs.rows}


def run(parts: Sequence[str] = ()) -> Iterator[Row]:
    """The live room, then logs. parts: names of those that are wanted; none: both."""
    yield from rows_of(PARTS, parts)
