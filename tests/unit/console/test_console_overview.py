"""From where the console shows the room first: as ever, but where boards and panels stand, so that they are read."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_module import in_node

from vistel.arrays import F64
from vistel.conference.files import load
from vistel.render.view.camera import overview
from vistel.space.boards.board import board, facing_middle, front_of
from vistel.space.commands.panel import panel
from vistel.space.room import meeting_room
from vistel.space.things.things import Pages, Thing

ROOT = Path(__file__).resolve().parents[3]
DESK, PHONE = 1.6, 0.8
"""Width of the picture by its height."""
HEAD_M = 1.45
"""Over the floor, of who sits: the top of their head."""
_RUN = """
import { overview } from "./module.mjs";
const { people, fronts, aspects } = given;
console.log(JSON.stringify(aspects.map((aspect) => overview(people, fronts, aspect))));
"""
Seen = list[dict[str, list[float]]]
Choose = Callable[[list[Thing]], Seen]


@pytest.fixture
def choose(tmp_path: Path) -> Choose:
    """The page's views, on a desk and on a phone, of three people at the table and of things."""
    run = in_node(tmp_path, "console/overview.ts", _RUN)

    def chosen(things: list[Thing]) -> Seen:
        fronts = [{"corners": corners(t).tolist(), "normal": normal(t).tolist()} for t in things]
        people = [{"at": head.tolist(), "looks": (-head / math.hypot(head[0], head[2])).tolist()} for head in heads()]
        return run({"people": people, "fronts": fronts, "aspects": [DESK, PHONE]})

    return chosen


def heads() -> F64:
    """(3, 3) [m], of those who sit at the table of the demo."""
    seats = meeting_room(3).seats
    return np.array([(seat.position[0], HEAD_M, seat.position[2]) for seat in seats])


def corners(thing: Thing) -> F64:
    front = front_of(thing)
    assert front is not None
    f = front.posed(thing.position, thing.rotation)
    return np.array([f.corner, f.corner + f.across, f.corner + f.across + f.up, f.corner + f.up])


def normal(thing: Thing) -> F64:
    front = front_of(thing)
    assert front is not None
    return front.posed(thing.position, thing.rotation).normal


def in_picture(view: dict[str, list[float]], aspect: float, places: F64) -> F64:
    """How far from the middle of the picture places (n, 3) are, 1 at its edge; infinite behind the camera."""
    eye, to = np.array(view["from"]), np.array(view["to"])
    ahead = (to - eye) / np.linalg.norm(to - eye)
    right = np.cross(ahead, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    away = (places - eye) @ np.stack((right, np.cross(right, ahead), ahead)).T
    half = math.tan(math.radians(22.5))
    off = np.max(np.abs(away[:, :2]) / (half * np.array((aspect, 1.0)) * away[:, 2:]), axis=1)
    return np.where(away[:, 2] > 0, off, np.inf)


def reads(view: dict[str, list[float]], thing: Thing) -> float:
    """Cosine between the normal of a front and the way to the camera."""
    towards = np.array(view["from"]) - corners(thing).mean(axis=0)
    return float(towards @ normal(thing) / np.linalg.norm(towards))


def test_without_boards_the_room_is_seen_as_in_the_renderers_overview(choose: Choose) -> None:
    renderers = overview()
    for view in choose([]):
        assert view["from"] == pytest.approx(renderers.position.tolist())
        ahead = np.array(view["to"]) - view["from"]
        assert ahead / np.linalg.norm(ahead) == pytest.approx((-renderers.rotation[:, 2]).tolist(), abs=1e-6)


def test_the_board_of_the_example_is_read_and_everybody_is_in_the_picture(choose: Choose) -> None:
    conference = load(ROOT / "examples/conferences/board.toml")
    (put,) = conference.room.things
    standing = facing_middle(board("board", "board"), *put.at)
    for view, aspect in zip(choose([standing]), (DESK, PHONE), strict=True):
        assert reads(view, standing) > 0.35
        assert in_picture(view, aspect, corners(standing)).max() <= 1.0
    assert in_picture(choose([standing])[0], DESK, heads()).max() <= 1.0


@pytest.mark.parametrize("turn", range(0, 360, 30))
def test_wherever_a_board_or_a_panel_stands_it_is_read(choose: Choose, turn: int) -> None:
    x, z = 2.1 * math.sin(math.radians(turn)), 2.1 * math.cos(math.radians(turn))
    for thing in (board("b", "b"), panel("p", "p", 16 / 9, Pages(("x",), 0, "ann"))):
        standing = facing_middle(thing, x, z)
        view = choose([standing])[0]
        assert reads(view, standing) > 0.35 and in_picture(view, DESK, corners(standing)).max() <= 1.0
        assert np.all(np.abs(np.array(view["from"])[[0, 2]]) < 4.05)  # the walls
        apart: Any = np.linalg.norm(np.vstack((heads(), corners(standing))) - view["from"], axis=1)
        assert apart.min() > 0.5
