"""Islands of a texture: what shows, and that smaller copies of it mix nothing else in."""

from __future__ import annotations

import numpy as np
from PIL import Image

from vistel.figure.avatar.avatar import Mesh
from vistel.wrinkle.islands import shown_by, spread_out


def _square(low: float, high: float) -> Mesh:
    uv = np.array([(low, low), (high, low), (high, high), (low, high)], np.float32)
    triangles = np.array([(0, 1, 2), (0, 2, 3)], np.int32)
    flat = np.column_stack((uv, np.zeros(4, np.float32)))
    return Mesh(flat, triangles, np.arange(4, dtype=np.int32), uv, triangles, np.zeros(4, np.int32))


def test_what_a_mesh_shows_is_where_its_triangles_lie_on_a_texture_that_is_no_square() -> None:
    shown = shown_by([_square(0.25, 0.75)], (64, 128))
    assert shown[16:48, 32:96].all()
    assert shown.sum() == 32 * 64


def test_between_islands_lies_the_colour_of_the_nearest_one() -> None:
    picture = np.zeros((48, 96, 3), np.uint8)
    shown = np.zeros((48, 96), np.bool_)
    for left, colour in ((8, (200, 10, 10)), (64, (10, 10, 200))):
        picture[12:36, left : left + 24], shown[12:36, left : left + 24] = colour, True
    out = spread_out(picture, shown)
    assert (out[:, :46] == (200, 10, 10)).all()
    assert (out[:, 50:] == (10, 10, 200)).all()
    assert (out[shown] == picture[shown]).all()


def test_a_texture_made_smaller_keeps_an_islands_colour_at_its_edge() -> None:
    picture, shown = np.zeros((64, 64, 3), np.uint8), np.zeros((64, 64), np.bool_)
    picture[19:45, 19:45], shown[19:45, 19:45] = (180, 120, 90), True
    small = np.asarray(Image.fromarray(spread_out(picture, shown)).reduce(8))
    assert (small == (180, 120, 90)).all()


def test_a_texture_that_shows_nothing_stays_as_it_is() -> None:
    picture = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    assert (spread_out(picture, np.zeros((4, 4), np.bool_)) == picture).all()
