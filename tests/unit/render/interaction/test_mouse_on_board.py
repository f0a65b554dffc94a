"""The mouse of a window writes on a board where it points, in parts, without a lost point."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vistel.geometry.pose import Pose
from vistel.render.interaction.picking import Ray
from vistel.render.interaction.writing import EVERY_NS, LONGEST, Writing
from vistel.space.actions import Draw, Rub
from vistel.space.boards.board import board, face_of
from vistel.space.boards.stroke import UPWARDS

BOARD = board("board", "board")
POSE = Pose(np.array([0.0, 0.4, 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))
FRAME_NS = 16_666_667


def at(x: float, y: float, eye: tuple[float, float, float] = (0.3, 1.2, 2.0)) -> Ray:
    """From somebody's eye to a place on the grid."""
    face = face_of(BOARD)
    assert face is not None
    place = face.place(np.array([[x, y]]), np.zeros(1))[0] + POSE.position
    way = place - np.array(eye)
    return Ray(np.array(eye), way / np.linalg.norm(way))


def test_every_place_of_the_mouse_is_drawn_in_parts_of_a_sixth_of_a_second() -> None:
    places = [(600 + 15 * k, 1200 + round(200 * np.sin(k / 9))) for k in range(60)]
    writing = Writing.begin(BOARD, POSE, at(*places[0]), False, 0)
    assert writing is not None
    parts: list[Draw | Rub] = []
    for k, place in enumerate(places[1:], 1):
        parts += writing.move(POSE, at(*place), k * FRAME_NS)
    parts += writing.rest()
    drawn = [p for p in parts if isinstance(p, Draw)]
    points = [n for p in drawn for n in p.points]
    assert list(zip(points[::2], points[1::2], strict=True)) == places
    assert len(parts) <= 60 * FRAME_NS // EVERY_NS + 2, "fewer commands than the world takes"
    assert len({p.stroke for p in drawn}) == 1 and {p.which.thing for p in drawn} == {"board"}


def test_a_long_stroke_goes_on_as_another_one_where_it_ends() -> None:
    writing = Writing.begin(BOARD, POSE, at(0, 0), False, 0)
    assert writing is not None
    parts = [p for k in range(1, 2 * LONGEST) for p in writing.move(POSE, at(10 * k % 3600, 100), k * FRAME_NS)]
    drawn = [p for p in parts if isinstance(p, Draw)]
    names = list(dict.fromkeys(p.stroke for p in drawn))
    first = [n for p in drawn if p.stroke == names[0] for n in p.points]
    second = [n for p in drawn if p.stroke == names[1] for n in p.points]
    assert first[-2:] == second[:2]


def test_what_rubs_has_no_gaps_between_its_parts() -> None:
    writing = Writing.begin(BOARD, POSE, at(100, 100), True, 0)
    assert writing is not None
    parts = [p for k in range(1, 40) for p in writing.move(POSE, at(100 + 20 * k, 100), k * FRAME_NS)] + writing.rest()
    rubbed = [p.points for p in parts if isinstance(p, Rub)]
    assert len(rubbed) > 2
    assert all(a[-2:] == b[:2] for a, b in pairwise(rubbed))


def test_nothing_is_written_from_behind_beside_the_face_or_on_other_things() -> None:
    assert Writing.begin(BOARD, POSE, at(100, 100, (0.0, 1.2, -2.0)), False, 0) is None
    assert Writing.begin(BOARD, POSE, at(100, UPWARDS + 50), False, 0) is None
    writing = Writing.begin(BOARD, POSE, at(100, 100), False, 0)
    assert writing is not None
    assert writing.move(POSE, at(-50, 100), EVERY_NS) == []
    assert len(writing.points) == 1
