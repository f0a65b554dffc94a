"""Clothes of built-in people: their patterns go round the body and along the sleeves."""

from __future__ import annotations

import numpy as np

from vistel.figure.people.cloth import STRIPES, paint_top
from vistel.figure.people.recipe import Recipe
from vistel.figure.people.trunk import ARM_Y, HEM_Y

STRIPED = Recipe(seed=12, pattern=STRIPES, top=0)
HEIGHTS = np.arange(HEM_Y + 0.06, HEM_Y + 0.20, 0.0105)  # above the ribs of the hem


def _light(points: np.ndarray) -> np.ndarray:
    """Which points are on a light stripe."""
    return paint_top(STRIPED, points, np.tile((0.0, 0.0, 1.0), (len(points), 1))).mean(axis=1) > 140


def test_stripes_stay_level_round_wide_hips() -> None:
    middle, side = (
        _light(np.stack([np.full_like(HEIGHTS, x), HEIGHTS, np.full_like(HEIGHTS, 0.03)], axis=1)) for x in (0.12, 0.19)
    )
    assert 3 < middle.sum() < len(HEIGHTS) - 3
    assert np.array_equal(middle, side)


def test_stripes_go_round_a_sleeve() -> None:
    along = np.arange(0.25, 0.60, 0.0105)
    above, before = (
        _light(np.stack([along, np.full_like(along, ARM_Y + y), np.full_like(along, z)], axis=1))
        for y, z in ((0.05, 0.0), (0.0, 0.05))
    )
    assert 5 < above.sum() < len(along) - 5
    assert np.array_equal(above, before)
