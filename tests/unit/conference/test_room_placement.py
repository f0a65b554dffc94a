"""Rooms are placed so that no place has much more to do than another."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.conference.placement import PERSON_CORES, STEP_CORES, PlacedRoom, Relocation, loads, relocations

PLACES = ("kobe", "nara", "osaka")
BOTH = frozenset(("kobe", "osaka"))


def room(name: str, at: str = "osaka", people: int = 4, places: frozenset[str] = BOTH) -> PlacedRoom:
    return PlacedRoom(name, people, at, places)


@st.composite
def placed(draw: st.DrawFn) -> list[PlacedRoom]:
    found: list[PlacedRoom] = []
    for n in range(draw(st.integers(0, 8))):
        places = frozenset(draw(st.sets(st.sampled_from(PLACES))))
        at = draw(st.sampled_from(["", *sorted(places)]))
        found.append(PlacedRoom(f"r{n}", draw(st.integers(1, 60)), at, places))
    return found


def after(rooms: list[PlacedRoom], moves: list[Relocation]) -> list[PlacedRoom]:
    to = {move.room: move.place for move in moves}
    return [replace(r, at=to.get(r.name, r.at)) for r in rooms]


def test_of_four_rooms_at_one_place_two_go_to_the_other() -> None:
    rooms = [room(f"r{n}") for n in range(4)]
    moves = relocations(rooms)
    assert [m.place for m in moves] == ["kobe", "kobe"]
    assert loads(after(rooms, moves)) == pytest.approx(dict.fromkeys(sorted(BOTH), 2 * (STEP_CORES + 4 * PERSON_CORES)))


def test_a_place_that_is_drained_leads_nothing_and_the_least_busy_one_takes_over() -> None:
    rooms = [room("a", places=frozenset(PLACES)), room("b", "kobe", people=40, places=frozenset(PLACES))]
    assert relocations(rooms, ["osaka"]) == [Relocation("a", "nara")]


def test_a_room_whose_world_is_nowhere_else_stays() -> None:
    assert relocations([room("a", places=frozenset(("osaka",)))], ["osaka"]) == []


def test_a_room_that_nobody_leads_begins_where_there_is_least_to_do() -> None:
    assert relocations([room("a"), room("b", at="")]) == [Relocation("b", "kobe")]


@given(placed(), st.sets(st.sampled_from(PLACES)))
def test_hypothesis_moves_are_possible_empty_what_is_drained_and_are_enough(rooms: list[PlacedRoom], drained: set[str]) -> None:
    moves = relocations(rooms, drained)
    assert len({m.room for m in moves}) == len(moves)
    by_name = {r.name: r for r in rooms}
    assert all(m.place in by_name[m.room].places - drained for m in moves)
    then = after(rooms, moves)
    for r in then:
        if r.places - drained:
            assert r.at and r.at not in drained
    forced = {m.room for m in moves if not by_name[m.room].at or by_name[m.room].at in drained}
    if not forced:
        assert max(loads(then).values(), default=0.0) <= max(loads(rooms).values(), default=0.0) + 1e-9
    assert relocations(rooms, drained) == moves
