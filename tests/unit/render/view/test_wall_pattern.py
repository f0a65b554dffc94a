"""The calibration picture of a wall: what is on it lies where it must."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vistel.render.view.screens import RoomScreen, Stereo
from vistel.render.view.wall_pattern import EYES_OVER_SEAT, eyes_at, pattern

EYES = eyes_at(np.zeros(3), 0.0, 0.06)
FLAT = RoomScreen("flat", np.array((0.5, 0.8, 1.0)), np.array((-0.5, 0.8, 1.0)), np.array((0.5, 1.6, 1.0)), 500, 400)
V = (
    RoomScreen("left", np.array((1.163, 0.55, 0.286)), np.array((0.0, 0.55, 1.1)), np.array((1.163, 1.617, 0.286)), 640, 480),
    RoomScreen("right", np.array((0.0, 0.55, 1.1)), np.array((-1.163, 0.55, 0.286)), np.array((0.0, 1.617, 1.1)), 640, 480),
)


def horizon(column: np.ndarray) -> float:
    """Row of the red line in a column of pixels."""
    red = (column[:, 0] > 200) & (column[:, 1] < 160) & (column[:, 2] < 120)
    assert red.any()
    return float(np.flatnonzero(red).mean())


def test_the_grid_shows_decimetres() -> None:
    row = pattern([FLAT], EYES)[5].mean(axis=1)  # above all circles but the upright ones
    lines = {round(k) for k in np.flatnonzero(row > 40)}
    for k in range(1, 10):  # 500 pixels to the metre
        assert lines & {50 * k - 1, 50 * k, 50 * k + 1}


def test_the_horizon_lies_at_the_height_of_the_eyes() -> None:
    picture = pattern([FLAT], EYES)
    expected = 400 * (1.6 - EYES_OVER_SEAT) / 0.8
    assert horizon(picture[:, 30]) == pytest.approx(expected, abs=1.5)


def test_over_the_seam_of_a_v_lines_meet_and_with_a_wrong_corner_they_do_not() -> None:
    good = pattern(V, EYES)
    assert horizon(good[:, 630]) == pytest.approx(horizon(good[:, 650]), abs=1.5)
    low = replace(
        V[1],
        lower_left=V[1].lower_left - (0, 0.05, 0),
        upper_left=V[1].upper_left - (0, 0.05, 0),
        lower_right=V[1].lower_right - (0, 0.05, 0),
    )
    bad = pattern((V[0], low), EYES)
    assert abs(horizon(bad[:, 630]) - horizon(bad[:, 650])) > 10


def test_each_eye_has_its_share_and_an_anaglyph_its_colours() -> None:
    assert pattern([FLAT], EYES, Stereo.SIDE_BY_SIDE).shape == (400, 500, 3)
    red = pattern([FLAT], EYES, Stereo.ANAGLYPH)[10, :, 0].astype(int)
    cyan = pattern([FLAT], EYES, Stereo.ANAGLYPH)[10, :, 1].astype(int)
    assert np.abs(red - cyan).max() > 50  # upright circles stand elsewhere for the other eye


def test_light_is_dimmed_as_the_projectors_are() -> None:
    plain, dimmed = pattern([FLAT], EYES), pattern([replace(FLAT, gain=(0.5, 1.0, 1.0), blend=(0.2, 0.0, 0.0, 0.0))], EYES)
    white = (300, int(0.85 * 500) - 12)  # the last step of grey
    assert (plain[330, white[1]] == 255).all() or (plain[325, white[1]] == 255).all()
    row = 325
    assert dimmed[row, white[1], 0] == pytest.approx(255 * 0.5 ** (1 / 2.2), abs=1)
    assert dimmed[row, white[1], 1] == 255
    assert dimmed[100, 0].max() < 60
