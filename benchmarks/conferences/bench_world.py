"""The shared world: how long its steps take, how they grow with people and things, what its state costs on the wire."""

from collections.abc import Iterator

from benchmarks.conferences import world_life, world_steps, world_wire
from benchmarks.row import Row


def run(thorough: bool = False) -> Iterator[Row]:
    """One row after the other. thorough: longer, with more sizes and repetitions."""
    yield from world_steps.rows(thorough)
    yield from world_wire.rows(thorough)
    yield from world_life.rows(thorough)
