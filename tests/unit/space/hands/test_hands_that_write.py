"""Hands write on a board that they touch: with a finger, with a thing that they hold; two people at once."""

from __future__ import annotations

import numpy as np
import pytest
from test_world_steps import START, Play, reaching

from vistel.figure.body import pose_body
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.space.actions import Draw, Paint, Undo
from vistel.space.arguments import Which
from vistel.space.boards.board import face_of
from vistel.space.boards.stroke import ACROSS, UPWARDS, Stroke
from vistel.space.commands.names import COLOURS
from vistel.space.inputs import CommandInput
from vistel.space.people import DIGITS, PALM, build_of
from vistel.space.room import Extra, meeting_room
from vistel.space.snapshot import digest
from vistel.space.world import World
from vistel.space.writing_hands import INDEX

AT_M = 1.2
"""Where the board stands, before those who face +Z."""
BOARD = Extra("board", "board", "board", 0.04, 0.2, 0.3, 0xFFFFFFFF, 0.0, AT_M)
AWAY = 0.5
"""From the face to a palm whose fingers do not write either [m]."""
FREE = 0.05
"""From the face to a finger that does not write [m]."""


def with_board(*people: str) -> Play:
    play = Play(*people)
    play.world = World(meeting_room(3, [BOARD]))
    return play


def tip(posture: Posture, digit: int = INDEX) -> tuple[np.ndarray, float]:
    """The end of a part of the right hand that is furthest ahead, and its radius [m]."""
    build = build_of(1.75, 1.0)
    body = pose_body(build.body, pose_joints(build.skeleton, posture))
    rows = np.flatnonzero(build.digit == DIGITS + digit)
    ends = np.concatenate([body.a[rows], body.b[rows]])
    radius = np.concatenate([body.radius_a[rows], body.radius_b[rows]])
    n = int(np.argmax(ends[:, 2] + radius))
    return ends[n], float(radius[n])


def fingering(x: float, y: float, off: float, digit: int = INDEX) -> Posture:
    """Somebody whose finger, or palm, is at a place of the board's grid, `off` from its face [m]."""
    board = BOARD.thing()
    face = face_of(board)
    assert face is not None
    wanted = face.place(np.array([[x, y]]), np.array([off]))[0] * (-1.0, 1.0, -1.0) + board.position
    begin = reaching(START, 0.0)
    end, radius = tip(begin, digit)
    return reaching(START + wanted - end - (0.0, 0.0, radius), 0.0)


def strokes(play: Play) -> tuple[Stroke, ...]:
    return play.views[-1].strokes


def path(k: int, middle: float) -> tuple[float, float, float]:
    """At step k: a stroke in 20 steps, and 4 steps away from the board."""
    number, within = divmod(k, 24)
    along = min(within, 19) / 19.0
    return middle + 300.0 * along, 1200.0 + 60.0 * number + 100.0 * np.sin(3.0 * along), 0.0 if within < 20 else FREE


def test_two_who_write_with_their_fingers_lose_no_point() -> None:
    play = with_board("ann", "ben")
    wanted: dict[str, list[list[tuple[float, float]]]] = {"ann": [], "ben": []}
    for k in range(24 * 4):
        places = {"ann": path(k, 800.0), "ben": path(k, 2400.0)}
        play.step({who: fingering(*place) for who, place in places.items()})
        for who, (x, y, off) in places.items():
            if off == 0.0:
                if k % 24 == 0:
                    wanted[who].append([])
                wanted[who][-1].append((x, y))
    for who, lines in wanted.items():
        own = [s for s in strokes(play) if s.by == who]
        assert len(own) == len(lines) == 4
        for s, line in zip(own, lines, strict=True):
            assert s.colour == COLOURS["black"]
            assert s.points == pytest.approx(np.array(line), abs=2.0), "each place of the finger, to a millimetre"


def test_a_finger_that_rests_trembles_or_is_behind_the_board_writes_nothing_more() -> None:
    play = with_board("ann")
    for k in range(20):
        play.step({"ann": fingering(1000.0 + 3.0 * (k % 2), 1000.0, 0.003 * (k % 2))})
    assert [len(s.points) for s in strokes(play)] == [1], "a dot"
    for off in (0.012, 0.02, 0.03):
        play.step({"ann": fingering(2000.0, 1000.0, off)})
    play.step({"ann": fingering(2000.0, 1000.0, -0.2)})
    play.step({"ann": fingering(ACROSS + 40.0, 1000.0, 0.0)})
    play.step({"ann": fingering(500.0, UPWARDS + 40.0, 0.0)})
    assert len(strokes(play)) == 1


def test_the_flat_of_a_hand_rubs_out_what_it_touches() -> None:
    play = with_board("ann")
    play.step({}, *(CommandInput(f"d{y}", "ann", Draw((1000, y, 2000, y))) for y in (300, 1500)))
    for x in (1400.0, 1410.0, 1420.0):
        play.step({"ann": fingering(x, 1500.0, AWAY, PALM)})
    assert len(strokes(play)) == 2
    for x in (1400.0, 1410.0, 1420.0):
        play.step({"ann": fingering(x, 1500.0, 0.0, PALM)})
    assert [s.points[0].tolist() for s in strokes(play)] == [[1000, 300]]
    play.step({}, CommandInput("u", "ann", Undo()))
    assert len(strokes(play)) == 2


def test_a_stroke_by_hand_is_taken_back_and_a_long_one_goes_on_as_another() -> None:
    play = with_board("ann")
    for k in range(150):
        play.step({"ann": fingering(200.0 + 20.0 * k, 1500.0, 0.0)})
    first, second = strokes(play)
    assert first.points[-1].tolist() == second.points[0].tolist(), "without a gap"
    play.step({"ann": fingering(3200.0, 1500.0, FREE)}, CommandInput("u", "ann", Undo()))
    assert strokes(play) == (first,)
    play.step({}, CommandInput("d", "ann", Draw((5, 5))), CommandInput("v", "ann", Undo()), CommandInput("w", "ann", Undo()))
    assert strokes(play) == ()


def carried_to_the_board(play: Play) -> None:
    """Ann takes the baton, and comes to the board with it."""
    for k in range(240):
        ahead = min(max(k - 60, 0), 175)
        grip = START + np.array([0.0, min(0.3, 0.005 * ahead), min(1.356, 0.008 * ahead)])
        play.step({"ann": reaching(grip, min(1.0, k / 20))})
    assert play.grasps() == ["ann"]


def test_a_held_thing_writes_in_its_own_colour() -> None:
    play = with_board("ann")
    carried_to_the_board(play)
    baton = next(t for t in play.views[-1].things if t.id == "baton")
    assert {(s.by, s.colour) for s in strokes(play)} == {("ann", baton.colour)}


def test_a_white_held_thing_rubs_out_what_it_touches_and_nothing_else() -> None:
    coloured = with_board("ann")
    carried_to_the_board(coloured)
    x, y = (int(n) for n in strokes(coloured)[0].points[0])
    play = with_board("ann")
    play.step({"ann": reaching(START, 0.0)})
    far = y - 600 if y > UPWARDS // 2 else y + 600
    drawn = [Draw((max(0, x - 300), at, min(ACROSS, x + 300), at)) for at in (y, far)]
    play.step({}, *(CommandInput(f"d{n}", "ann", draw) for n, draw in enumerate(drawn)))
    play.step({}, CommandInput("p", "ann", Paint(Which("baton"), COLOURS["white"])))
    assert [o.done for o in play.views[-1].outcomes] == [True] and len(strokes(play)) == 2
    carried_to_the_board(play)
    assert [s.points[0].tolist()[1] for s in strokes(play)] == [far]
    play.step({}, CommandInput("u", "ann", Undo()))
    assert len(strokes(play)) == 2, "what was rubbed comes back"


def test_the_same_hands_write_the_same_bytes_again() -> None:
    def written() -> tuple[list[bytes], int]:
        play = with_board("ann")
        for k in range(48):
            play.step({"ann": fingering(*path(k, 1500.0))})
        world = play.world
        return [s.ink for s in strokes(play)], digest(world.room, world._state)  # pyright: ignore[reportPrivateUsage]

    assert written() == written()
