"""What is written on a board is seen in the picture where it was written, before its face, and goes when it is rubbed out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vistel.geometry.pose import Pose
from vistel.messages.boards import stroke_message
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.stage import Instant
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.camera import look_at
from vistel.space.boards.board import board, face_of
from vistel.space.boards.ribbon import ribbon
from vistel.space.boards.stroke import Stroke, packed
from vistel.space.things.things import Thing

BOARD = board("board", "board")
PLACE = np.array([0.0, 0.4, -1.5])
RED, BLUE = 0xC23B32FF, 0x2F6DB5FF


def stroke(number: int, colour: int, *points: tuple[int, int], width: int = 80) -> Stroke:
    return Stroke(number, "board", "ann", "", colour, width, packed(points))


def test_a_ribbon_faces_out_is_as_wide_as_its_stroke_and_lies_over_earlier_ones() -> None:
    face = face_of(BOARD)
    assert face is not None
    lower, upper = ribbon(stroke(1, RED, (100, 900), (700, 900), (700, 300)), face), ribbon(stroke(2, RED, (5, 5)), face)
    corner = lower.vertices[lower.triangles].astype(float)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert (normal @ face.normal > -1e-9).all()
    assert np.ptp(lower.vertices[:, 1]) == pytest.approx(0.3 + 0.04, abs=0.002)
    assert lower.vertices[:, 2].max() < upper.vertices[:, 2].min()
    assert lower.vertices[:, 2].min() > face.corner[2]


@pytest.mark.gl
def test_strokes_are_seen_where_they_are_and_go_again() -> None:
    renderer = SceneRenderer(View(320, 180, "room", ""), 3)
    renderer.camera = camera = look_at(np.array((0.0, 1.4, 0.6)), np.array((0.0, 1.4, -1.5)), math.radians(50.0))
    things: dict[str, Thing] = {"board": BOARD}

    def picture(*strokes: Stroke) -> np.ndarray:
        told = {s.number: stroke_message(s) for s in strokes}
        world = PlayoutWorld(1, {"board": Pose(PLACE, np.array([0.0, 0.0, 0.0, 1.0]))}, strokes=told)
        return np.ascontiguousarray(renderer.render_complete(Instant(1, (), world, things))[::-1, :, :3]).astype(int)

    face = face_of(BOARD)
    assert face is not None
    middle = face.place(np.array([[1800.0, 1200.0], [1000.0, 1200.0]]), np.zeros(2)) + PLACE
    (x, y, _), (left, _, _) = camera.project(middle, 320, 180)
    try:
        empty = picture()
        assert empty[round(y), round(x)].min() > 120, "the face is bright"
        red = picture(stroke(1, RED, (600, 1200), (3000, 1200)))[round(y), round(x)]
        assert red[0] > red[2] + 60
        both = picture(stroke(1, RED, (600, 1200), (3000, 1200)), stroke(2, BLUE, (1800, 600), (1800, 1800)))
        assert both[round(y), round(x), 2] > both[round(y), round(x), 0] + 30, "the later one lies over the earlier one"
        assert both[round(y), round(left), 0] > both[round(y), round(left), 2] + 60
        assert np.abs(picture() - empty).max() < 12
    finally:
        renderer.close()
