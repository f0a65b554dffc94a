"""A room's folder: rooms of other meetings are kept and told, damage falls back, and nobody else writes there."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from vistel.persistence import journal
from vistel.persistence.store import Found, Store, earlier, seed
from vistel.space.inputs import StepInputs
from vistel.space.room import Extra, meeting_room
from vistel.space.world import World
from vistel.v1.world_pb2 import WorldInputs

NOW_NS = 1_700_000_000_000_000_000
HOUR_NS = 3_600_000_000_000
CLAY = Extra("clay", "clay", "ball", 0.04, 1.0, 0.3, 0xB5A48FFF, 0.1, 0.1)


def kept(folder: Path, t_ns: int = NOW_NS, seats: int = 3, steps: int = 4) -> World:
    """A room that was led for some steps, until `t_ns`, and was killed."""
    folder.mkdir(exist_ok=True)
    store, world = Store(folder), World(meeting_room(seats))
    store.begin(world, 0)
    for n in range(1, steps + 1):
        inputs = StepInputs(n, t_ns - (steps - n) * 16_666_667)
        world.step(inputs)
        message = WorldInputs(step=n)
        message.header.t_ns = inputs.t_ns
        store.append(journal.record(message, inputs))
        if n == steps // 2:
            data = store.rotate(world)
            assert data is not None
            store.save(data, n)
    store.leave()
    return world


def loaded(folder: Path, now_ns: int, seats: int = 3, *extras: Extra) -> tuple[Store, Found | None]:
    store = Store(folder)
    return store, store.load(meeting_room(seats, extras), now_ns)


@pytest.mark.parametrize(
    ("ago_ns", "seats", "extras", "why"),
    [
        (2 * HOUR_NS, 3, (), "it is 2.0 h old"),
        (-2 * HOUR_NS, 3, (), "it is 2.0 h ahead of the clock"),
        (0, 4, (), "its seats or things"),
        (0, 3, (CLAY,), "its seats or things"),
    ],
)
def test_a_room_that_is_not_resumed_is_kept_and_told_in_one_line_and_begins_the_next_one_when_asked(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, ago_ns: int, seats: int, extras: tuple[Extra, ...], why: str
) -> None:
    folder = tmp_path / "room"
    before = kept(folder, NOW_NS - ago_ns)
    store, found = loaded(folder, NOW_NS, seats, *extras)
    assert found is None
    begins = meeting_room(seats, extras)
    new = World(begins)
    store.set_aside(NOW_NS)
    store.begin(new, 1)
    for n in range(1, 9):  # long enough that what is older goes
        new.step(StepInputs(n, NOW_NS + n))
        data = store.rotate(new)
        assert data is not None
        store.save(data, n)
    store.end(new)
    (aside,) = (p for p in folder.iterdir() if p.is_dir())
    told = [r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING]
    assert len(told) == 1 and why in told[0] and str(aside) in told[0] and "--from" in told[0]
    assert earlier(aside).snapshot() == before.snapshot()
    seed(folder, earlier(aside).resumed(begins, NOW_NS + HOUR_NS))
    _, again = loaded(folder, NOW_NS + HOUR_NS + 5, seats, *extras)
    assert again is not None and again.world.step_number == before.step_number
    assert {t.id for t in again.world.things_now} == {t.id for t in begins.things}
    assert len([p for p in folder.iterdir() if p.is_dir()]) == 2, "what was there was kept as well"


def test_a_clock_that_was_set_back_minutes_costs_who_was_there_and_not_the_room(tmp_path: Path) -> None:
    before = kept(tmp_path / "room", NOW_NS + 120_000_000_000)
    _, found = loaded(tmp_path / "room", NOW_NS)
    assert found is not None and found.world.t_ns == NOW_NS
    assert found.world.step_number == before.step_number and found.world.participants == ()


def test_a_flipped_bit_anywhere_in_the_newest_snapshot_is_named_and_costs_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "room"
    before = kept(folder).snapshot()
    newest = sorted(folder.glob("*.snapshot"))[-1]
    whole = newest.read_bytes()
    for at in (0, 11, len(whole) // 3, len(whole) // 2, len(whole) - 10, len(whole) - 9, len(whole) - 1):
        caplog.clear()
        newest.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
        _, found = loaded(folder, NOW_NS)
        assert found is not None and found.world.snapshot() == before, at
        told = [r.getMessage() for r in caplog.records if r.levelno >= logging.ERROR]
        assert len(told) == 1 and newest.name in told[0], at


def test_a_flipped_bit_in_the_journal_is_named_and_the_room_goes_on_with_every_other_step(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "room"
    kept(folder, steps=8)
    newest = sorted(folder.glob("*.journal"))[-1]
    whole = newest.read_bytes()
    newest.write_bytes(whole[:30] + bytes([whole[30] ^ 4]) + whole[31:])
    _, found = loaded(folder, NOW_NS)
    assert found is not None and found.world.step_number == 8
    told = [r.getMessage() for r in caplog.records if "journal damaged" in r.getMessage()]
    assert len(told) == 1 and str(newest) in told[0] and "bytes=" in told[0]


def test_two_conferences_never_write_into_one_folder_and_the_second_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    one, two = Store(tmp_path), Store(tmp_path)
    world = World(meeting_room(3))
    one.begin(world, 0)
    files = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    two.begin(World(meeting_room(3)), 0)
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == files
    assert [r for r in caplog.records if "another conference that runs keeps its room there" in r.getMessage()]
    with pytest.raises(OSError, match="another conference that runs"):
        seed(tmp_path, world)
    one.leave()
    assert two.rotate(World(meeting_room(3))) is None
    assert len(list(tmp_path.glob("*.journal"))) >= 1 and not two._unsafe


def test_what_is_no_room_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="holds no snapshot"):
        earlier(tmp_path)
