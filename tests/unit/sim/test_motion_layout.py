"""Simulated people in a room from a file: they sit on its seats, at its tables, and take its baton, if it has one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vistel.conference.model import Conference
from vistel.space.files import Interior, save_usd
from vistel.space.room import BATON, TABLE_HEIGHT, Room, Seat, meeting_room
from vistel.space.things.things import Thing, ThingPrimitive
from vistel_sim.motion.layout import LAP, built_in, layout_of
from vistel_sim.motion.open import open_motion


def table(height: float) -> Thing:
    """A board, its top at a height."""
    board = ThingPrimitive("superellipsoid", (0.9, 0.02, 0.9, 0.2, 0.2))
    return Thing("board", "board", "board", (board,), 0.0, 0.0, 0xA0A0A0FF, np.array([0.0, height - 0.02, 0.0]))


def conference(folder: Path, *things: Thing, apart: float = 0.6, **more: Any) -> Conference:
    """Two people who face each other over the middle of a room from a file."""
    seats = tuple(Seat(np.array([0.0, 0.0, z * apart]), h) for z, h in ((-1.0, 0.0), (1.0, np.pi)))
    save_usd(Interior(Room(seats, things, shell=False)), folder / "room.usda")
    people = [{"name": n, "participants": [{"name": f"{n}-1", **more}]} for n in ("tokyo", "oslo")]
    return Conference.model_validate({"room": {"file": folder / "room.usda", "seats": 2}, "sites": people})


NAMES = ("tokyo-1", "oslo-1")


@pytest.mark.parametrize("height", [0.55, TABLE_HEIGHT, 0.95])
def test_hands_lie_on_the_table_that_is_there(tmp_path: Path, height: float) -> None:
    layout = layout_of(conference(tmp_path, table(height)).room)
    assert layout.seats == 2
    assert layout.table(np.array([0.1, 0.0, 0.2])) == pytest.approx(max(LAP, height), abs=1e-4)
    assert layout.table(np.array([2.0, 0.0, 0.2])) == LAP


def test_a_baton_of_the_room_is_handed_over_and_none_is_not_invented(tmp_path: Path) -> None:
    baton = replace(meeting_room(2).thing(BATON), position=np.array([0.1, 0.66, -0.1]))
    for name in ("with", "without", "far"):
        (tmp_path / name).mkdir()
    motion = open_motion(conference(tmp_path / "with", table(0.6), baton))
    assert motion.things(0.0)[BATON][0] == pytest.approx(baton.position)
    carried = motion.things(5.9)[BATON][0]
    assert 0.7 < carried[1] < 1.0
    assert open_motion(conference(tmp_path / "without", table(0.6))).things(0.0) == {}
    away = replace(baton, position=np.array([1.9, 0.66, 1.9]))
    assert open_motion(conference(tmp_path / "far", table(0.6), away)).things(0.0) == {}


def test_who_sits_too_far_apart_touches_nobody(tmp_path: Path) -> None:
    baton = replace(meeting_room(2).thing(BATON), position=np.array([0.1, 0.66, -1.2]))
    motion = open_motion(conference(tmp_path, table(0.6), baton, apart=1.5))
    assert motion.things(0.0) == {}
    for t_s in (0.0, 6.0, 9.0):
        for name in NAMES:
            assert np.isfinite(motion.posture(name, t_s).dofs).all()


def test_they_sit_where_the_file_says(tmp_path: Path) -> None:
    motion = open_motion(conference(tmp_path, table(0.7)))
    for name, z in zip(NAMES, (-0.6, 0.6), strict=True):
        feet = motion.posture(name, 0.0).stance.position
        assert abs(feet[0]) < 0.2 and abs(feet[2] - z) < 0.6 and np.sign(feet[2]) == np.sign(z)


def test_the_builtin_room_is_as_it_was() -> None:
    here = built_in(3)
    assert here.table(np.array([0.3, 0.0, 0.2])) == TABLE_HEIGHT
    seats = [s.position for s in here.room.seats]
    assert here.baton_for(seats[0]) is not None and here.meet(seats[0], seats[1])


def test_of_a_room_elsewhere_only_the_seats_are_known(tmp_path: Path) -> None:
    plan = conference(tmp_path)
    assert layout_of(plan.room).table(np.zeros(3)) == TABLE_HEIGHT
    assert open_motion(plan).things(0.0) == {}


def test_clay_is_worked_on_where_it_lies(tmp_path: Path) -> None:
    clay = {"id": "clay", "shape": "lump", "size": 0.05, "material": "plastic", "at": [0.0, -0.15]}
    whole = conference(tmp_path, table(0.6), motion="clay")
    whole = Conference.model_validate(whole.model_dump() | {"room": whole.room.model_dump() | {"things": [clay]}})
    layout = layout_of(whole.room)
    lump = layout.thing("clay")
    assert lump is not None and lump.position[1] == pytest.approx(0.65, abs=0.002)
    motion = open_motion(whole)
    assert np.isfinite(motion.posture("tokyo-1", 3.0).dofs).all()
