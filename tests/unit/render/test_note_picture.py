"""What stands on a note is seen in the picture, on its front alone, on paper of its colour."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vistel.geometry.pose import Pose
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.stage import Instant
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.camera import look_at
from vistel.space.commands.noting import PAPER
from vistel.space.notes.note import MOST_TEXT, SIDE, note
from vistel.space.notes.picture import lines_of, picture_of
from vistel.space.things.things import Thing

PLACE = np.array([0.0, 1.4, -1.5])


@pytest.mark.gl
def test_a_text_is_read_on_its_front_and_goes_with_another_text() -> None:
    renderer = SceneRenderer(View(640, 480, "room", ""), 3)
    renderer.camera = camera = look_at(np.array((0.0, 1.4, -1.0)), PLACE, math.radians(40.0))
    corners = PLACE + 0.45 * SIDE * np.array([[-1.0, 1.0, 0.0], [1.0, -1.0, 0.0]])
    (left, top, _), (right, bottom, _) = camera.project(corners, 640, 480)

    def seen(thing: Thing, turn: tuple[float, float, float, float]) -> np.ndarray:
        world = PlayoutWorld(1, {"note": Pose(PLACE, np.array(turn))})
        whole = np.ascontiguousarray(renderer.render_complete(Instant(1, (), world, {"note": thing}))[::-1, :, :3]).astype(int)
        return whole[round(top) : round(bottom), round(left) : round(right)]

    def ink(picture: np.ndarray) -> float:
        return float((picture.max(axis=2) < 0.55 * np.median(picture.max(axis=2))).mean())

    front, back = (0.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 0.0)
    try:
        written, blank = seen(note("note", "buy milk", PAPER), front), seen(note("note", "", PAPER), front)
        behind = seen(note("note", "buy milk", PAPER), back)
        more = seen(note("note", "buy milk and bread, and bring it to the table before noon", PAPER), front)
    finally:
        renderer.close()
    assert ink(written) > 0.05 and ink(more) > 0.05
    assert ink(blank) < 0.005 and ink(behind) < 0.005
    assert np.abs(written - more).mean() > 5.0
    red, _, blue = np.median(blank.reshape(-1, 3), axis=0)
    assert red - blue > 60, "yellow"


@pytest.mark.parametrize(
    "text",
    ["buy milk", "x" * MOST_TEXT, "W" * MOST_TEXT, "a " * (MOST_TEXT // 2), "牛乳を買う" * (MOST_TEXT // 5), "牛乳 milk " * 13],
)
def test_all_of_a_text_fits_and_none_of_its_letters_is_lost(text: str) -> None:
    picture = picture_of(text, (255, 255, 255))
    edge = np.concatenate([picture[:20].ravel(), picture[-20:].ravel(), picture[:, :20].ravel(), picture[:, -20:].ravel()])
    assert (edge == 255).all() and (picture < 128).any()
    assert "".join(lines_of(text, 40, 440.0)).replace(" ", "") == text.replace(" ", "")


def test_lines_end_between_words_where_they_can() -> None:
    assert lines_of("one two three", 40, 200.0) == ["one two", "three"]
    assert all(len(line) < 12 for line in lines_of("x" * 40, 40, 200.0))
