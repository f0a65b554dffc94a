"""Who hears what of a large room: bounded, right where somebody looks, and the same room for all."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest

from vistel.messages.world.encoder import KEY_STEPS, MOST_KEYED, WorldEncoder
from vistel.messages.world.interest import MOST_DETAILED
from vistel.space.eyes import Eyes
from vistel.space.room import meeting_room
from vistel.space.view import ThingView, WorldView
from vistel.v1.world_pb2 import WorldDetail, WorldState
from vistel.wire.world.codec.bits import BitReader, BitWriter
from vistel.wire.world.codec.detail import read_detail
from vistel.wire.world.codec.frame import MOST_ENCODED
from vistel.wire.world.codec.touches import TouchCode, read_touches, write_touches
from vistel.wire.world.decoder import RoomState, SnapshotBuilder, WorldDecoder

STEP_NS = 16_666_667
AXES = np.array([0.0, 1.0, 0.0, 0.0])


@dataclass(frozen=True)
class Said:
    """What goes out after a step, through bytes."""

    view: WorldView
    eyes: dict[str, Eyes]
    state: WorldState | None
    whole: WorldState | None
    details: dict[str, WorldDetail]


def place(n: int, k: float) -> np.ndarray:
    """Where thing `n` is at step `k`: a corner of its own, in which it swings."""
    a = 0.05 * k + n
    swing = np.array([math.sin(a), 0.3 * math.sin(1.7 * a), math.cos(0.7 * a)]) * 0.15 * math.sin(0.013 * k * (1 + n % 3) + n)
    return np.array([n % 25 - 12.0, 1.0, n // 25 - 12.0]) * 0.4 + swing


def room(things: int, moving: int, steps: int, people: int = 2, first: int = 1) -> Iterator[tuple[WorldView, dict[str, Eyes]]]:
    """A room in which some of the things swing, here and there."""
    like = meeting_room(2).things[-1]
    made = tuple(replace(like, id=f"t{n}", name=f"t{n}") for n in range(things))
    names = tuple(f"p{i}" for i in range(people))
    every = things // moving
    still = np.zeros(3)
    look = np.array([0.0, 0.0, 1.0])
    eyes = {name: Eyes(place(37 * i % things, 0) + np.array([0.0, 0.3, -0.5]), look) for i, name in enumerate(names)}
    for k in range(first, first + steps):
        states: list[ThingView] = []
        for n in range(things):
            moves = n % every == 0 and n // every < moving
            t = k if moves else 0
            turn = np.array([0.0, math.sin(0.01 * t), 0.0, math.cos(0.01 * t)])
            states.append(ThingView(f"t{n}", place(n, t), turn, still, still, (), not moves, moves))
        yield WorldView(k, k * STEP_NS, made, False, tuple(states), (), (), (), names, (), k if k % 60 == 0 else 0), eyes


def told(things: int, moving: int, steps: int, people: int = 2) -> Iterator[Said]:
    encoder = WorldEncoder()
    for view, eyes in room(things, moving, steps, people):
        said = encoder.encode(view)
        details = encoder.details(eyes, view.t_ns) if said.state is not None else {}
        state, whole = (WorldState.FromString(m.SerializeToString()) if m is not None else None for m in said)
        yield Said(view, eyes, state, whole, {w: WorldDetail.FromString(d.SerializeToString()) for w, d in details.items()})


def kbit_s(things: int, moving: int, people: int) -> float:
    """To a site of one person, the beginning left out."""
    said = [s for s in told(things, moving, 100, people) if s.view.step > 40]
    size = sum(s.state.ByteSize() for s in said if s.state is not None)
    size += sum(s.details["p0"].ByteSize() for s in said if "p0" in s.details)
    return 8 * size / 1000


def test_what_a_site_hears_is_bounded_whatever_is_in_the_room_and_moves() -> None:
    much = kbit_s(200, 200, people=2)
    assert much < 64.0
    assert kbit_s(600, 200, people=12) < 1.05 * much
    assert kbit_s(600, 600, people=2) < 1.15 * much


def wrong(now: RoomState, said: Said) -> list[float]:
    """How wrong things that move look to p0, in radians."""
    eye = said.eyes["p0"].position
    moved = [s for s in said.view.states if s.moved]
    return [float(np.linalg.norm(now.poses[s.id][0] - s.position) / np.linalg.norm(s.position - eye)) for s in moved]


def test_whoever_is_near_sees_things_where_they_are_and_all_know_the_same_room() -> None:
    site, anybody, deaf = WorldDecoder(), WorldDecoder(), WorldDecoder()
    near: list[float] = []
    far: list[float] = []
    for n, said in enumerate(told(200, 60, 240)):
        if said.state is None:
            continue
        if (detail := said.details.get("p0")) is not None:
            site.receive_detail(detail)
            if n % 7:
                deaf.receive_detail(detail)
        mine, theirs = site.read(said.state)[-1], anybody.read(said.state)[-1]
        deaf.read(said.state)
        assert mine.step == theirs.step == said.view.step
        if said.view.step > 30:
            near += wrong(mine, said)
            far += wrong(theirs, said)
        assert all(np.array_equal(site.now.poses[k][0], anybody.now.poses[k][0]) for k in anybody.now.poses)
    for decoder in (site, anybody, deaf):
        assert not decoder.lost and decoder.missed == decoder.differed == 0
    assert np.percentile(near, 99) < 0.6 * np.percentile(far, 99)


def test_where_no_more_moves_than_everybody_receives_there_are_no_details() -> None:
    assert not any(s.details for s in told(60, MOST_ENCODED, 60))


def test_a_detail_names_a_bounded_number_of_things_and_what_is_before_the_eyes_first() -> None:
    named: set[int] = set()
    eye = np.zeros(3)
    for said in told(400, 200, 90):
        if (detail := said.details.get("p0")) is not None:
            things = read_detail(detail.frame)
            assert 0 < len(things) <= MOST_DETAILED
            if said.view.step > 60:
                named |= things.keys()
            eye = said.eyes["p0"].position
    away = [float(np.linalg.norm(place(n, 0) - eye)) for n in named]
    everywhere = [float(np.linalg.norm(place(n, 0) - eye)) for n in range(0, 400, 2)]
    assert np.median(away) < 0.7 * np.median(everywhere)


def test_a_late_joiner_of_a_large_room_knows_what_the_others_know_and_goes_on() -> None:
    backlog, first, late = SnapshotBuilder(), WorldDecoder(), WorldDecoder()
    for n, said in enumerate(told(MOST_KEYED + 50, 40, 400)):
        if said.whole is not None:
            backlog.key(said.whole)
        if said.state is None:
            continue
        assert not said.state.key or n == 0, "who is there already hears the whole again"
        backlog.add(said.state)
        first.read(said.state)
        if n == 301:
            assert late.begin(backlog.snapshot()) is not None
        elif n > 301:
            late.read(said.state)
    assert late.missed == late.differed == 0 and not late.lost
    assert late.now.step == first.now.step
    assert all(np.array_equal(late.now.poses[k][0], first.now.poses[k][0]) for k in first.now.poses)
    assert late._book is not None and first._book is not None
    assert [t._predicted for t in late._book.tracks] == [t._predicted for t in first._book.tracks]


def frames(details: dict[str, WorldDetail]) -> dict[str, bytes]:
    return {who: d.frame for who, d in details.items()}


@pytest.mark.parametrize("things", [MOST_KEYED, MOST_KEYED + 50])
def test_an_encoder_that_begins_in_the_middle_publishes_the_same_of_a_crowded_room(things: int) -> None:
    all_said = {s.view.step: s for s in told(things, 40, 330)}
    encoder = WorldEncoder(begins=False)
    compared = 0
    for view, eyes in room(things, 40, 250, first=81):
        before = all_said[view.step]
        if encoder.silent and things > MOST_KEYED and before.whole is not None:
            encoder.continue_from(view, before.whole)
            assert frames(encoder.details(eyes, view.t_ns)) == frames(before.details)
            continue
        again = encoder.encode(view)
        if again.state is None:
            continue
        assert before.state is not None and view.step >= KEY_STEPS
        assert again.state.SerializeToString(deterministic=True) == before.state.SerializeToString(deterministic=True)
        assert (again.whole is None) == (before.whole is None)
        if again.whole is not None and before.whole is not None:
            assert again.whole.frame == before.whole.frame
        assert frames(encoder.details(eyes, view.t_ns)) == frames(before.details)
        compared += 1
    assert compared > 100


def test_pairs_that_touch_are_published_a_bounded_number_at_a_time_and_all_in_the_end() -> None:
    now = {(a, b): TouchCode(1 + a, b % 9) for a in range(8) for b in range(8, 16)}
    writer: dict[tuple[int, int], TouchCode] = {}
    reader: dict[tuple[int, int], TouchCode] = {}
    frames = 0
    while writer != now:
        out = BitWriter()
        assert write_touches(out, writer, now, 10)
        read_touches(BitReader(out.to_bytes()), reader)
        assert reader == writer
        frames += 1
    assert frames == 7
