"""What `vistel up` does before the meeting, as plain lines where there is no terminal to draw a bar in."""

from __future__ import annotations

import time

from rich.console import Console
from rich.progress import TextColumn, TimeElapsedColumn
from rich.table import Column

from vistel_cli.waiting import EVERY_S

WIDE_ENOUGH = 100
"""Columns of a terminal that has place for a bar beside the words."""


def words(template: str = "{task.description}") -> TextColumn:
    """What a line of progress says; where the terminal is narrow, in two lines."""
    return TextColumn(template, markup=False, table_column=Column())


def time_taken() -> TimeElapsedColumn:
    """Stands beside it; long words do not push it out."""
    return TimeElapsedColumn(table_column=Column(no_wrap=True, min_width=len("0:00:00")))


class Steps:
    """Prints to `console`, unless that is a terminal or `silent`."""

    def __init__(self, console: Console, *, silent: bool) -> None:
        self._console, self._silent = console, silent or console.is_terminal
        self._began = self._printed = time.monotonic()

    def begin(self, step: str) -> None:
        """A line at once."""
        self._printed = time.monotonic()
        if not self._silent:
            self._console.print(step, soft_wrap=True)

    def show(self, awaited: str) -> None:
        """A line with the seconds that have passed, if the last one is some time ago. Call it several times a second."""
        if time.monotonic() - self._printed >= EVERY_S:
            self.begin(f"{awaited}, {time.monotonic() - self._began:.0f} s")
