"""The journal: what it gives back, and what a damaged byte costs."""

from __future__ import annotations

from pathlib import Path

import pytest

from vistel.figure.posture.posture import standing
from vistel.persistence import journal
from vistel.space.inputs import CommandInput, MotionInput, StepInputs
from vistel.v1.world_pb2 import WorldInputs

STEPS = range(1, 6)


@pytest.fixture
def written(tmp_path: Path) -> tuple[Path, list[int]]:
    """A small journal, and where each of its records begins and the last one ends."""
    path = tmp_path / "a.journal"
    writing, ends = journal.Journal(path), [0]
    for n in STEPS:
        inputs = StepInputs(n, n * 7, motions=(MotionInput("aiko", standing(), n, n * 5),) if n == 3 else ())
        message = WorldInputs(step=n)
        message.header.t_ns = inputs.t_ns
        message.commands.add(id=f"ask-{n}", participant="aiko")
        writing.append(journal.record(message, inputs))
        ends.append(path.stat().st_size)
    writing.sync()
    writing.close()
    return path, ends


def steps_of(path: Path) -> tuple[list[int], list[journal.Damage]]:
    damage: list[journal.Damage] = []
    return [step.inputs.step for step in journal.read(path, damage.append)], damage


def test_a_flipped_bit_in_any_byte_is_found_and_costs_the_record_it_is_in_and_no_other(written: tuple[Path, list[int]]) -> None:
    path, ends = written
    whole = path.read_bytes()
    for at in range(len(whole)):
        broken = max(n for n, begin in enumerate(ends) if begin <= at)
        path.write_bytes(whole[:at] + bytes([whole[at] ^ (1 << at % 8)]) + whole[at + 1 :])
        steps, damage = steps_of(path)
        assert steps == [n for n in STEPS if n != broken + 1], at
        assert [(d.begin, d.end, d.after) for d in damage] == [(ends[broken], ends[broken + 1], broken)]


def test_a_journal_that_was_cut_anywhere_gives_all_whole_records_and_tells_where(written: tuple[Path, list[int]]) -> None:
    path, ends = written
    whole = path.read_bytes()
    for end in range(len(whole)):
        path.write_bytes(whole[:end])
        steps, damage = steps_of(path)
        assert steps == [n for n in STEPS if ends[n] <= end]
        begin = max(b for b in ends if b <= end)
        assert [(d.begin, d.end, d.cut) for d in damage] == ([(begin, end, True)] if end > begin else [])


def test_bytes_that_are_lost_in_the_middle_cost_the_records_they_were_in(written: tuple[Path, list[int]]) -> None:
    path, ends = written
    whole = path.read_bytes()
    path.write_bytes(whole[: ends[1] + 5] + whole[ends[3] - 9 :])
    assert steps_of(path)[0] == [1, 4, 5]


def test_zeros_that_a_power_cut_left_are_no_records(written: tuple[Path, list[int]]) -> None:
    path, ends = written
    path.write_bytes(path.read_bytes()[: ends[2]] + bytes(4096))
    steps, damage = steps_of(path)
    assert steps == [1, 2] and len(damage) == 1 and damage[0].cut


def test_a_command_is_as_it_was(written: tuple[Path, list[int]]) -> None:
    path, _ = written
    third = journal.inputs_of(list(journal.read(path))[2])
    assert third.t_ns == 21 and third.motions[0].seq == 3
    assert isinstance(third.commands[0], CommandInput) and third.commands[0].id == "ask-3"
