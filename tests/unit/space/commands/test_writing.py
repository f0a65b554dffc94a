"""Boards: they are put up, written on by several at once, rubbed and wiped; what cannot be is refused in one line."""

from __future__ import annotations

import math

import numpy as np
import pytest
from talking import Talk, done, refused, stands

from vistel.geometry.rotation import matrix_from_quaternion
from vistel.messages.commands import message_of
from vistel.messages.commands_read import action_of
from vistel.messages.world.encoder import WorldEncoder
from vistel.space.actions import Bend, Delete, Draw, PutUpBoard, Redo, Reset, Rub, Scale, Undo, Wipe
from vistel.space.arguments import Which
from vistel.space.boards.board import face_of
from vistel.space.boards.stroke import ACROSS, MOST_POINTS, UPWARDS, Stroke, packed, unpacked
from vistel.space.commands.phrase import read
from vistel.space.ink import MOST_INK, MOST_STROKES, FullError, reverted, without, written
from vistel.space.inputs import CommandInput
from vistel.space.room import Extra, meeting_room
from vistel.space.world import World
from vistel.v1.command_pb2 import Command
from vistel.v1.world_pb2 import WorldState
from vistel.wire.world.decoder import WorldDecoder

RED, LINE = 0xC23B32FF, (100, 200, 150, 260, 180, 300)


def put_up(talk: Talk) -> str:
    (board,) = done(talk.say(PutUpBoard()))
    return board


def strokes(talk: Talk) -> tuple[Stroke, ...]:
    return talk.play.views[-1].strokes


def inks(talk: Talk) -> list[list[list[int]]]:
    return [s.points.tolist() for s in strokes(talk)]


def test_a_board_stands_by_itself_its_front_to_the_middle() -> None:
    talk = Talk()
    board = put_up(talk)
    talk.wait(120)
    x, _, z = talk.place(board)
    turned = matrix_from_quaternion(talk.play.thing(board).rotation)
    assert float(turned[:, 2] @ np.array([-x, 0.0, -z])) / math.hypot(x, z) > 0.99
    assert turned[1, 1] > 0.9999, "it does not lean"
    assert read("new board") == PutUpBoard()


@pytest.mark.parametrize("points", [[(0, 0)], [(10, 20), (11, 25)], [(0, 0), (ACROSS, UPWARDS), (0, 7)], [(5, 5), (5, 5)]])
def test_ink_keeps_every_point_that_was_drawn(points: list[tuple[int, int]]) -> None:
    there = [tuple(p) for p in unpacked(packed(points)).tolist()]
    at = [there.index(p) for p in points]
    assert at == sorted(at) and there[0] == points[0] and there[-1] == points[-1]


def test_a_stroke_goes_on_under_its_name_and_is_taken_back_as_a_whole() -> None:
    talk = Talk()
    board = put_up(talk)
    done(talk.say(Draw(LINE, stroke="a", colour=RED)))
    assert done(talk.say(Draw((181, 301, 190, 310), stroke="a", colour=RED))) == (board,)
    assert inks(talk) == [[[100, 200], [150, 260], [180, 300], [181, 301], [190, 310]]]
    assert strokes(talk)[0].colour == RED
    done(talk.say(Undo()))
    assert strokes(talk) == ()
    done(talk.say(Redo()))
    assert len(inks(talk)[0]) == 5


def test_two_who_write_at_once_take_back_their_own_strokes_only() -> None:
    talk = Talk("ann", "ben")
    talk.play.step({"ben": stands(0.0, 0.9, math.pi)})
    put_up(talk)
    done(talk.say(Draw(LINE, stroke="s"), "ann"))
    done(talk.say(Draw((900, 900), stroke="s"), "ben"))
    done(talk.say(Draw((200, 320), stroke="s"), "ann"))
    assert [s.by for s in strokes(talk)] == ["ann", "ben"]
    done(talk.say(Undo(), "ben"))
    assert [s.by for s in strokes(talk)] == ["ann"]
    assert "nothing that can be taken back" in refused(talk.say(Undo(), "ben"))
    assert [s.by for s in strokes(talk)] == ["ann"], "a stroke of somebody else is not taken back"


def test_what_is_rubbed_out_comes_back_by_undo_and_what_is_not_touched_stays() -> None:
    talk = Talk("ann", "ben")
    talk.play.step({"ben": stands(0.0, 0.9, math.pi)})
    board = put_up(talk)
    done(talk.say(Draw((0, 1000, 3600, 1000))))
    done(talk.say(Draw((0, 100, 3600, 100))))
    done(talk.say(Rub((1800, 900, 1800, 1100), Which(board)), "ben"))
    assert [s.points[0, 1] for s in strokes(talk)] == [100]
    done(talk.say(Undo(), "ben"))
    assert [s.points[0, 1] for s in strokes(talk)] == [1000, 100]
    done(talk.say(read("wipe"), "ben"))
    assert strokes(talk) == ()
    done(talk.say(Undo(), "ben"))
    assert len(strokes(talk)) == 2
    done(talk.say(Reset()))
    assert strokes(talk) == ()


def test_a_board_that_goes_takes_its_strokes_along_and_brings_them_back() -> None:
    talk = Talk("ann", "ben")
    talk.play.step({"ben": stands(0.0, 0.9, math.pi)})
    board = put_up(talk)
    done(talk.say(Draw(LINE, Which(board), stroke="s")))
    done(talk.say(Delete(Which(board)), "ben"))
    assert strokes(talk) == ()
    assert refused(talk.say(Draw((181, 301), Which(board), stroke="s"))) == "there is no thing 'board' in the room"
    assert refused(talk.say(Draw((181, 301)))) == "there is no board in the room; put one up first"
    done(talk.say(Undo(), "ben"))
    assert inks(talk) == [[[100, 200], [150, 260], [180, 300]]]


@pytest.mark.parametrize(
    ("action", "reason"),
    [
        (Draw((0, 0) * 1_000_000), "expected x and y of 1 to 200 points, got 2000000 numbers"),
        (Draw(()), "expected x and y of 1 to 200 points, got 0 numbers"),
        (Draw((1, 2, 3)), "expected x and y of 1 to 200 points, got 3 numbers"),
        (Draw((0, 0, 3601, 0)), "a point is not on the board: x is 0 to 3600 from the left, y 0 to 2400 from below"),
        (Draw((0, 2401)), "a point is not on the board: x is 0 to 3600 from the left, y 0 to 2400 from below"),
        (Draw((-1, 0)), "a point is not on the board: x is 0 to 3600 from the left, y 0 to 2400 from below"),
        (Draw((0, 0), colour=0xC23B3280), "a stroke has a colour 0xRRGGBBFF, such as 0xC23B32FF for red, not 0xc23b3280"),
        (Draw((0, 0), colour=0), "a stroke has a colour 0xRRGGBBFF, such as 0xC23B32FF for red, not 0x0"),
        (Draw((0, 0), width=1), "a stroke is 2 to 80 units of 0.5 mm wide, not 1"),
        (Draw((0, 0), width=4_000_000_000), "a stroke is 2 to 80 units of 0.5 mm wide, not 4000000000"),
        (Draw((0, 0), stroke="s" * 41), "a stroke is called something of 40 letters at most, not 41"),
        (Draw((0, 0, 3600, 0) * 20), "a stroke has at most 200 points, and one for each 6 cm, not 1132; begin another one"),
        (Draw((0, 0), Which("can")), "the green can is no board; nothing can be written on it"),
        (Rub((0, 0), width=401), "one rubs 2 to 400 units of 0.5 mm wide, not 401"),
        (Rub((9999, 0)), "a point is not on the board: x is 0 to 3600 from the left, y 0 to 2400 from below"),
        (Wipe(Which("box")), "the blue box is no board; nothing can be written on it"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line_and_changes_nothing(action: Draw | Rub | Wipe, reason: str) -> None:
    talk = Talk()
    put_up(talk)
    done(talk.say(Draw(LINE)))
    before = strokes(talk)
    assert refused(talk.say(action)) == reason
    assert strokes(talk) == before


def test_a_stroke_that_goes_on_for_ever_and_a_bent_board_are_refused() -> None:
    talk = Talk()
    board = put_up(talk)
    done(talk.say(Draw((5, 5) * MOST_POINTS, stroke="s")))
    assert "begin another one" in refused(talk.say(Draw((6, 6), stroke="s")))
    done(talk.say(Scale(Which(board), 0.4)))
    done(talk.say(Bend(Which(board), 0.5)))
    assert refused(talk.say(Draw((5, 5)))) == "the board is bent; make it straight to write on it"


def test_a_board_made_smaller_keeps_what_is_written() -> None:
    talk = Talk()
    board = put_up(talk)
    done(talk.say(Draw((0, 0, 3600, 2400))))
    small = face_of(talk.thing(board))
    done(talk.say(Scale(Which(board), 0.6)))
    large = face_of(talk.thing(board))
    assert small is not None and large is not None
    assert float(np.linalg.norm(large.across)) == pytest.approx(0.6 * float(np.linalg.norm(small.across)))
    x, y, off = large.on_grid(large.place(np.array([[1800.0, 600.0]]), np.array([0.01]))[0])
    assert (x, y, off) == pytest.approx((1800.0, 600.0, 0.01))
    assert len(strokes(talk)) == 1


def test_whoever_floods_a_board_is_held_back_and_others_write_on() -> None:
    talk = Talk("ann", "ben")
    talk.play.step({"ben": stands(0.0, 0.9, math.pi)})
    put_up(talk)
    flood = [CommandInput(f"f{n}", "ben", Draw((n, n), stroke=f"{n}")) for n in range(200)]
    outcomes = talk.play.step({}, *flood, CommandInput("mine", "ann", Draw(LINE))).outcomes
    assert sum(o.done for o in outcomes if o.participant == "ben") <= 20
    assert {o.reason for o in outcomes if not o.done} == {"too many commands; wait a second"}
    assert [o.done for o in outcomes if o.participant == "ann"] == [True]


def test_one_participant_has_half_of_the_ink_and_is_told_so() -> None:
    state, long = World(meeting_room(3))._state, [(7, 7)] * MOST_POINTS  # pyright: ignore[reportPrivateUsage]
    for _ in range(MOST_INK // 2 // MOST_POINTS):
        state = written(state, Stroke(0, "board", "ben", "", RED, 12, b""), long)
    with pytest.raises(FullError, match="you have written 15000 points of strokes, as many as can be kept; wipe a board first"):
        written(state, Stroke(0, "board", "ben", "", RED, 12, b""), [(7, 7)])
    state = written(state, Stroke(0, "board", "ann", "", RED, 12, b""), [(7, 7)])
    for _ in range(MOST_STROKES // 2 - 1):
        state = written(state, Stroke(0, "board", "ann", "", RED, 12, b""), [(7, 7)])
    with pytest.raises(FullError, match="you have written 1000 strokes"):
        written(state, Stroke(0, "board", "ann", "", RED, 12, b""), [(7, 7)])


def test_what_undo_brings_back_is_no_more_ink_than_a_room_may_have() -> None:
    state, long = (
        World(meeting_room(3, [Extra("board", "board", "board", 0.04, 0.2, 0.3, 0xFFFFFFFF, 0.0, 1.2)]))._state,
        [(7, 7)] * MOST_POINTS,
    )  # pyright: ignore[reportPrivateUsage]
    for who in ("ann", "ben"):
        for _ in range(MOST_INK // 2 // MOST_POINTS):
            state = written(state, Stroke(0, "board", who, "", RED, 12, b""), long)
    full = state.strokes
    state = written(without(state, "eve", full), Stroke(0, "board", "ann", "", RED, 12, b""), long)
    state = reverted(state, (), full, state.history)
    assert sum(s.count for s in state.strokes) == MOST_INK
    assert [s.number for s in state.strokes] == [*(s.number for s in full[:-1]), full[-1].number + 1]


def test_two_hundred_strokes_a_minute_reach_every_site_without_a_lost_point() -> None:
    """Two who write as fast as that for twenty seconds, each stroke in five parts; a site that comes late sees the same."""
    talk = Talk("ann", "ben")
    talk.play.step({"ben": stands(0.0, 0.9, math.pi)})
    board = put_up(talk)
    whole = {who: dict[str, list[list[int]]]() for who in ("ann", "ben")}
    rng, encoder, early = np.random.default_rng(3), WorldEncoder(), WorldDecoder()
    snapshot: WorldState | None = None
    for step in range(1200):
        commands: list[CommandInput] = []
        for n, who in enumerate(("ann", "ben")):
            number, within = divmod(step + 18 * n, 36)  # 100 a minute
            if within % 7 or within > 28:
                continue
            part = rng.integers((0, 0), (ACROSS, UPWARDS), (1, 2)) if within == 0 else None
            name = f"{number}"
            last = whole[who].get(name, [[0, 0]])[-1]
            ways = np.cumsum(rng.integers(-40, 41, (6, 2)), axis=0)
            points = np.clip(part if part is not None else np.array([last]) + ways, 0, (ACROSS, UPWARDS))
            whole[who].setdefault(name, []).extend(points.tolist())
            flat = tuple(points.ravel().tolist())
            sent = Command.FromString(message_of(Draw(flat, Which(board), stroke=name), f"{who}{step}", who).SerializeToString())
            commands.append(CommandInput(sent.id, who, action_of(sent)))
        view = talk.play.step({}, *commands)
        assert all(o.done for o in view.outcomes), view.outcomes
        said = encoder.encode(view)
        if said.state is not None:
            early.read(WorldState.FromString(said.state.SerializeToString()))
        if step == 600:
            snapshot = encoder.snapshot(words=False)
    late = WorldDecoder()
    last_whole = encoder.snapshot(words=False)
    assert snapshot is not None and last_whole is not None
    late.read(last_whole)
    for decoder in (early, late):
        seen: dict[str, dict[str, list[list[int]]]] = {"ann": {}, "ben": {}}
        for s in decoder.now.strokes.values():
            seen[s.by][s.id] = unpacked(s.ink).tolist()
        assert seen == whole
        assert not decoder.lost and decoder.differed == 0
    assert sum(len(s) for s in whole.values()) >= 66
    assert early.agreed > 10


def test_a_kept_room_and_a_restored_world_have_the_same_strokes_bit_for_bit() -> None:
    talk = Talk("ann")
    put_up(talk)
    done(talk.say(Draw(LINE, stroke="s", colour=RED)))
    done(talk.say(Draw((700, 700))))
    done(talk.say(Rub((700, 700))))
    data = talk.play.world.snapshot()
    again = World.restore(data)
    assert again.snapshot() == data
    room = talk.play.world.room
    assert [s.ink for s in again.resumed(room, 10**9)._state.strokes] == [s.ink for s in strokes(talk)]  # pyright: ignore[reportPrivateUsage]
