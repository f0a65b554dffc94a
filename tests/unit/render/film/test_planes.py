"""Pictures in planes for encoders."""

from __future__ import annotations

import numpy as np
import pytest

from vistel.render.film.planes import Planes


@pytest.mark.parametrize(("width", "height"), [(64, 48), (65, 49), (50, 30)])
def test_a_picture_comes_out_upright_and_in_its_colours(width: int, height: int) -> None:
    """Coloured bars, the top one red; rows and columns too many are those at the right and at the bottom."""
    bars = np.array(((220, 30, 40), (30, 200, 60), (40, 60, 210)), np.uint8)
    upright = np.repeat(bars, [height // 4 * 2, 8, height - height // 4 * 2 - 8], axis=0)[:, None].repeat(width, axis=1)
    upright[:, -1] = 255
    rgba = np.dstack((upright, np.full((height, width), 255, np.uint8)))[::-1].copy()
    even = width - width % 2, height - height % 2
    planes = Planes(*even)
    planes.frame(np.zeros_like(rgba))
    back = planes.frame(rgba).to_ndarray(format="rgb24").astype(int)
    assert back.shape == (even[1], even[0], 3)
    inside = np.abs(back - upright[: even[1], : even[0]])[:, : even[0] - 2]
    assert np.median(inside) <= 4 and np.abs(back[1, 1] - bars[0]).max() <= 6 and np.abs(back[-2, 1] - bars[2]).max() <= 6


def test_frames_do_not_share_their_memory() -> None:
    planes = Planes(32, 16)
    white = planes.frame(np.full((16, 32, 4), 255, np.uint8))
    planes.frame(np.zeros((16, 32, 4), np.uint8))
    assert white.to_ndarray(format="rgb24").min() > 240
