"""The room as it is told: what a receiver knows is what the world knows, with messages lost, for late joiners, after edits."""

from __future__ import annotations

import hashlib
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numba
import numpy as np
import pytest
from test_world_steps import START, Play, reaching

from vistel.messages.world.encode import world_state
from vistel.messages.world.encoder import KEY_STEPS, EncodedStep, WorldEncoder
from vistel.space.actions import Create, Delete, Paint
from vistel.space.arguments import Which
from vistel.space.inputs import CommandInput
from vistel.space.view import WorldView
from vistel.v1.world_pb2 import WorldState
from vistel.wire.log import LogRecord
from vistel.wire.topics import BY_NAME
from vistel.wire.world.decoder import RoomState, SnapshotBuilder, WorldDecoder
from vistel.wire.world.recorded import RecordedWorld


def handled(steps: int, *commands: tuple[int, CommandInput]) -> list[WorldView]:
    """Somebody takes the baton, carries it about and throws it; commands at their steps."""
    play, due = Play("ann", "ben"), dict(commands)
    for k in range(steps):
        lift = min(max(k - 30, 0), 60)
        grip = START + np.array([0.05 * math.sin(lift / 9), 0.004 * lift, 0.03 * math.sin(lift / 7)])
        closing = 1.0 if 20 < k < 110 else k / 20 if k <= 20 else 0.0
        asked = [due[k]] if k in due else []
        play.step({"ann": reaching(grip, closing), "ben": reaching(START + np.array([0.9, 0.2, 0.3]), 0.0)}, *asked)
    return play.views


@pytest.fixture(scope="module")
def views() -> list[WorldView]:
    return handled(
        300,
        (40, CommandInput("a", "ann", Create("ball", 0.03))),
        (150, CommandInput("b", "ann", Paint(Which("box"), 0xFF0000FF))),
        (170, CommandInput("c", "ann", Delete(Which("can")))),
    )


def told(views: list[WorldView]) -> Iterator[tuple[WorldView, EncodedStep]]:
    """Each step and what is said after it, through bytes."""
    encoder = WorldEncoder()
    for view in views:
        said = encoder.encode(view)
        yield view, EncodedStep(*(WorldState.FromString(m.SerializeToString()) if m is not None else None for m in said))


def same(now: RoomState, view: WorldView, newest: bool = True) -> None:
    """newest: of the steps in a message; lists are as of that one."""
    assert now.step == view.step and now.t_ns == view.t_ns
    assert list(now.things) == [t.id for t in view.things] == list(now.poses)
    for s in view.states:
        position, rotation = now.poses[s.id]
        assert np.linalg.norm(position - s.position) < 0.00045
        assert math.degrees(2.0 * math.acos(min(1.0, abs(float(rotation @ s.rotation))))) < 0.12
        assert not newest or now.holders(s.id) == s.holders
    assert now.participants == view.participants
    if newest:
        held = [[(g.participant, g.right, g.thing) for g in grasps] for grasps in (now.grasps, view.grasps)]
        assert held[0] == held[1]


def acting(view: WorldView) -> dict[tuple[str, str], set[int]]:
    return {(g.target, g.source): set(g.target_primitives) for g in view.ghosts if g.target in view.participants}


def test_a_receiver_knows_every_step_as_the_world_does(views: list[WorldView]) -> None:
    decoder, by_step, heard = WorldDecoder(), {v.step: v for v in views}, 0
    for _, said in told(views):
        for now in decoder.read(said.state) if said.state is not None else ():
            same(now, by_step[now.step], now is decoder.now)
            heard += 1
        assert not decoder.lost
    assert len(views) - 2 <= heard <= len(views)  # a key frame may leave out the step before it
    assert decoder.missed == decoder.differed == 0


def test_whatever_touches_is_named_at_once_and_for_half_a_second_at_most_when_it_has_ceased(views: list[WorldView]) -> None:
    decoder, touched = WorldDecoder(), 0
    lately: list[dict[tuple[str, str], set[int]]] = []
    for view, said in told(views):
        lately = [*lately[-31:], acting(view)]
        if said.state is None:
            continue
        named = {(t.target, t.source): set(t.limbs) for t in decoder.read(said.state)[-1].touches}
        for pair, limbs in acting(view).items():
            assert limbs <= named[pair]
            touched += 1
        for pair, limbs in named.items():
            assert limbs <= set[int]().union(*(past.get(pair, set()) for past in lately))
    assert touched > 50


def test_a_late_joiner_knows_all_from_a_snapshot_and_goes_on(views: list[WorldView]) -> None:
    backlog, late, first = SnapshotBuilder(), WorldDecoder(), WorldDecoder()
    for n, (_, said) in enumerate(told(views)):
        if said.whole is not None:
            backlog.key(said.whole)
        if said.state is None:
            continue
        backlog.add(said.state)
        first.read(said.state)
        if n >= 175:
            late.read(said.state)
        if n >= 181 and late.lost:
            assert late.now.step == 0
            caught_up = late.begin(backlog.snapshot())
            assert caught_up is not None and caught_up.step == first.now.step
    assert late.missed == late.differed == 0
    assert late.now.step == first.now.step == views[-1].step
    assert late.now.poses.keys() == first.now.poses.keys()
    assert all(np.array_equal(late.now.poses[k][0], first.now.poses[k][0]) for k in first.now.poses)
    assert late.now.touches == first.now.touches
    assert list(late.now.things.values()) == list(first.now.things.values())


def test_who_misses_a_message_holds_what_they_know_until_the_next_key_frame(views: list[WorldView]) -> None:
    decoder, silent = WorldDecoder(), 0
    for n, (view, said) in enumerate(told(views[:200])):
        if said.state is None or n == 61:
            continue
        steps = decoder.read(said.state)
        if n > 61 and view.step < KEY_STEPS:
            assert not steps and decoder.lost
            silent += 1
    assert decoder.missed == 1
    assert silent > 20
    same(decoder.now, views[199])


def test_a_message_that_comes_twice_or_late_changes_nothing(views: list[WorldView]) -> None:
    decoder, changes = WorldDecoder(), [said.state for _, said in told(views[:100]) if said.state is not None]
    for n, message in enumerate(changes):
        assert decoder.read(message)
        assert decoder.read(message) == [] == decoder.read(changes[max(0, n - 5)])
    assert not decoder.lost and decoder.missed == 0


def test_a_receiver_that_knows_something_else_finds_out_within_a_second(views: list[WorldView]) -> None:
    decoder = WorldDecoder()
    for view, said in told(views):
        if said.state is None:
            continue
        decoder.read(said.state)
        if view.step == 174:
            assert decoder._book is not None
            x, *rest = decoder._book.tracks[3].pose
            decoder._book.tracks[3].pose = (x + 1, *rest)
        if decoder.differed:
            break
    assert decoder.differed == 1 and decoder.lost
    assert decoder.now.step <= 174 + 60


def test_an_encoder_that_begins_in_the_middle_publishes_the_same_from_the_next_key_frame_on(views: list[WorldView]) -> None:
    whole = {view.step: said for view, said in told(views)}
    encoder = WorldEncoder(begins=False)
    again = {view.step: encoder.encode(view) for view in views[90:]}
    said = {step: t for step, t in again.items() if t.state is not None}
    assert min(said) == KEY_STEPS
    assert len(said) == sum(t.state is not None for step, t in whole.items() if step >= KEY_STEPS)
    for step, t in said.items():
        assert t.state is not None
        assert t.state.SerializeToString(deterministic=True) == whole[step].state.SerializeToString(deterministic=True)  # type: ignore[union-attr]
        assert (t.whole is None) == (whole[step].whole is None)


def test_logs_in_words_are_still_read() -> None:
    """As they were written before there were frames: whole, then only what moved."""
    views = handled(60)
    decoder = WorldDecoder()
    for n, view in enumerate(views):
        message = world_state(view)
        if n % 30:
            message.key = False
            del message.things[:]
            moved = [s for s, v in zip(message.states, view.states, strict=True) if v.moved]
            del message.states[:]
            message.states.extend(moved)
        now = decoder.read(message)[-1]
        for s in view.states:
            np.testing.assert_allclose(now.poses[s.id][0], s.position, atol=1e-6)


def digest() -> str:
    """Of all that is said of some steps."""
    out = hashlib.sha256()
    for _, said in told(handled(70)):
        for message in said:
            if message is not None:
                out.update(message.SerializeToString(deterministic=True))
    return out.hexdigest()


def test_the_same_inputs_give_the_same_messages_whatever_the_thread_count() -> None:
    threads = "1" if numba.config.NUMBA_NUM_THREADS > 1 else "2"  # type: ignore[attr-defined]
    here = str(Path(__file__).parent)
    env = os.environ | {"NUMBA_NUM_THREADS": threads, "OMP_NUM_THREADS": threads, "PYTHONPATH": here}
    code = "from test_world_encoder import digest; print(digest())"
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == digest()


@pytest.mark.parametrize("missed", [3, 130])
def test_a_log_that_begins_in_the_middle_is_followed_from_the_next_whole_room_on_and_tells_no_room_twice(
    views: list[WorldView], missed: int
) -> None:
    """The first whole room may be in it although the step after that is not."""
    world, rooms = RecordedWorld(), list[RoomState]()
    for k, (_, encoded) in enumerate(told(views)):
        for topic, message in (("world_key", encoded.whole), ("world_state", encoded.state)):
            if message is not None and (k >= missed or topic == "world_key"):
                rooms += world.take(LogRecord(BY_NAME[topic], "", {}, message, k, 0))
    by_step = {view.step: view for view in views}
    steps = [room.step for room in rooms]
    assert len(set(steps)) == len(steps) and steps[-1] == views[-1].step
    whole = next(step for step in steps if step > missed + 2)
    assert whole <= (missed // KEY_STEPS + 1) * KEY_STEPS + 1
    for room in rooms[steps.index(whole) + 1 :: 10]:
        same(room, by_step[room.step], newest=False)
