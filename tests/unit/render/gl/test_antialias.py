"""Stairs of edges are smoothed; text, which is laid over the picture, stays as sharp as it was drawn; pictures are opaque."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vistel.figure.posture.posture import Stance, standing
from vistel.render.figures.figures import DrawableFigure
from vistel.render.gl.antialias import MARGIN, antialias
from vistel.render.scene_renderer import SceneRenderer
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.view.camera import look_at
from vistel.render.view.view import View

SIZE = 64


def stairs() -> np.ndarray:
    """White below a line that rises by one pixel in four, black above."""
    x, y = np.meshgrid(np.arange(SIZE), np.arange(SIZE))
    picture = np.full((SIZE, SIZE, 4), 255, np.uint8)
    picture[y < x // 4 + 20, :3] = 0
    return picture


def test_stairs_get_steps_between_black_and_white() -> None:
    inner = antialias(stairs())[MARGIN:-MARGIN, MARGIN:-MARGIN, 0]
    between = (inner > 20) & (inner < 235)
    assert between.any(axis=0).mean() > 0.7


def test_what_is_laid_over_stays_as_it_is_beside_what_is_smoothed() -> None:
    picture = stairs()
    picture[:, 32:, 3] = 100
    out = antialias(picture)
    assert np.array_equal(out[:, 32:], picture[:, 32:])
    assert not np.array_equal(out[:, :32], picture[:, :32])


@pytest.mark.gl
def test_a_name_in_a_drawn_picture_is_as_sharp_as_without_the_filter_and_the_picture_is_opaque() -> None:
    smooth, _ = drawn(None)
    rough, laid_over = drawn(1)  # one sample a pixel and no filter
    assert laid_over.sum() > 300
    assert np.array_equal(smooth[laid_over], rough[laid_over])
    assert not np.array_equal(smooth, rough)
    assert (smooth[..., 3] == 255).all()
    assert (rough[..., 3] == 255).all()


def drawn(samples: int | None) -> tuple[np.ndarray, np.ndarray]:
    """A stand-in with a name, and where something is laid over the picture."""
    stance = Stance(np.array((0.0, standing().stance.position[1], -1.1)), 0.0)
    somebody = PersonNow(
        ParticipantInfo("ada", "Ada Lovelace", "ada.usdz"), replace(standing(), stance=stance), Timing(0, 0, 0, False)
    )
    studio = SceneRenderer(View(320, 200, "room", "", light="fast", samples=samples), 3, load=missing)
    studio.camera = look_at(np.array((0.0, 1.5, 2.4)), np.array((0.0, 1.2, -1.1)), 0.8)
    try:
        studio._smoothing.result()
        for k in range(1, 4):
            picture = studio.render(Instant(k * 33_000_000, (somebody,)))
            studio._loader.submit(int).result()  # what was asked for before is done
        raw = np.empty_like(picture)
        studio.painter.read_into(raw)
        return picture, raw[..., 3] < 255
    finally:
        studio.close()


def missing(about: ParticipantInfo) -> DrawableFigure:
    raise FileNotFoundError("ada.usdz: no such file")
