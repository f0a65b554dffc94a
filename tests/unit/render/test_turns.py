"""Renderers that take turns, in simulated time: one after the other, nobody starves, nobody waits for what hangs."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Sequence
from pathlib import Path

import pytest

from vistel.render.turns import LONGEST_WAIT_NS, DrawingTurn
from vistel.wire.clock import SimulatedClock

MS, S = 1_000_000, 1_000_000_000


async def _draws(turn: DrawingTurn, clock: SimulatedClock, takes_ns: int, drawn: list[tuple[int, int]]) -> None:
    """Draws as often as it can; drawn: from when to when."""
    while True:
        await turn.begin(clock)
        began_ns = clock.now_ns()
        await clock.sleep_until_ns(began_ns + takes_ns)
        turn.end()
        drawn.append((began_ns, clock.now_ns()))


def drawn_by(folder: Path, takes_ms: Sequence[int], places: int, seconds: float) -> list[list[tuple[int, int]]]:
    """What renderers draw whose pictures take so long."""

    async def scenario() -> list[list[tuple[int, int]]]:
        clock = SimulatedClock()
        found: list[list[tuple[int, int]]] = [[] for _ in takes_ms]
        turns = [DrawingTurn(folder, places) for _ in takes_ms]
        tasks = [
            asyncio.ensure_future(_draws(*x)) for x in zip(turns, [clock] * 9, (MS * t for t in takes_ms), found, strict=False)
        ]
        await clock.advance_to_ns(round(seconds * S))
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        for turn in turns:
            turn.close()
        return found

    return asyncio.run(scenario())


def at_once(drawn: Sequence[Sequence[tuple[int, int]]]) -> int:
    """How many pictures were drawn at the same time, at most."""
    events = sorted((t, step) for one in drawn for began, ended in one for t, step in ((began, 1), (ended, -1)))
    most = now = 0
    for _, step in events:
        now += step
        most = max(most, now)
    return most


@pytest.mark.parametrize("places", [1, 2])
def test_as_many_pictures_are_drawn_at_once_as_there_are_places(tmp_path: Path, places: int) -> None:
    assert at_once(drawn_by(tmp_path, [20, 20, 20, 30], places, 2.0)) == places


def test_everybody_gets_their_turn_and_the_machine_is_never_idle(tmp_path: Path) -> None:
    drawn = drawn_by(tmp_path, [20, 20, 20], 1, 6.0)
    counts = [len(one) for one in drawn]
    assert min(counts) > 0.7 * max(counts)
    assert sum(counts) * 20 > 0.9 * 6000
    assert all(b[0] - a[1] < 100 * MS for one in drawn for a, b in itertools.pairwise(one))


def test_who_is_alone_never_waits(tmp_path: Path) -> None:
    (drawn,) = drawn_by(tmp_path, [20], 1, 1.0)
    assert all(b[0] == a[1] for a, b in itertools.pairwise(drawn))


def test_a_renderer_that_hangs_holds_up_the_others_for_a_moment_only(tmp_path: Path) -> None:
    hung, drawn = drawn_by(tmp_path, [60_000, 20], 1, 3.0)
    assert not hung
    assert all(b[0] - a[1] <= LONGEST_WAIT_NS + 2 * MS for a, b in itertools.pairwise(drawn))
    assert len(drawn) >= 20


def test_who_dies_gives_the_turn_back(tmp_path: Path) -> None:
    async def scenario() -> int:
        clock, died, waits = SimulatedClock(), DrawingTurn(tmp_path, 1), DrawingTurn(tmp_path, 1)
        await died.begin(clock)
        died.close()  # as the system does with the files of a process that is gone
        await waits.begin(clock)
        waits.close()
        return clock.now_ns()

    assert asyncio.run(scenario()) == 0


def test_where_no_file_can_be_written_nobody_waits(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert at_once(drawn_by(tmp_path / "file", [20, 20], 1, 1.0)) == 2
