"""The shared world: how long a step takes, how that grows with people and things, and how many bits its state costs."""

from collections.abc import Iterator

from benchmarks.conferences import world_life, world_steps, world_wire
from benchmarks.row import Row


def run(thorough: bool = False) -> Iterator[Row]:
    """One row after the other. thorough: longer, with more sizes and repetitions."""
    yield from world_steps.rows(thorough)
    yield from world_wire.rows(thorough)
    yield from world_life.rows(thorough)
