"""The shared world: how long its steps take, how they grow with people and things."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks import world_steps
from benchmarks.row import Row


def run() -> Iterator[Row]:
    """One row after the other."""
    yield from world_steps.rows()
