"""What hangs loose in the renderer: it is drawn where it swings, by both engines, and at rest where nobody says when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vistel.figure.posed import builtin
from vistel.figure.posture.posture import Posture, Stance, standing
from vistel.render.figures.drawn import Corners, Planned
from vistel.render.figures.figures import AvatarFigure
from vistel.render.figures.gpu_deform import GpuDeformer, GpuSkin
from vistel.render.gl.context import GlContext

pytestmark = pytest.mark.gl


@pytest.fixture(scope="module")
def carla() -> AvatarFigure:
    return AvatarFigure(builtin("carla").avatar)


def turned(heading: float) -> Posture:
    return replace(standing(), stance=Stance(np.zeros(3), heading))


def turn(figure: AvatarFigure, *, planned: bool) -> Corners | Planned:
    """Turning by 50° within a quarter of a second, as it is seen a tenth after."""
    for k in range(9):
        skin = figure.pose(turned(0.14 * min(k, 6)), planned=planned, at_ns=k * 41_666_667).skin
    return skin


def test_hair_that_swings_is_drawn_elsewhere(carla: AvatarFigure) -> None:
    swung = turn(carla, planned=False)
    assert isinstance(swung, Corners)
    places, normals = swung.positions.copy(), swung.normals.copy()
    still = carla.pose(turned(0.14 * 6)).skin
    assert isinstance(still, Corners)
    moved = np.linalg.norm(places - still.positions, axis=1)
    assert moved.max() > 0.01
    assert moved[still.positions[:, 1] < 1.1].max() < 1e-6
    assert np.linalg.norm(normals - still.normals, axis=1)[moved > 0.01].mean() > 0.01


def test_both_engines_swing_alike(carla: AvatarFigure, surface: GlContext) -> None:
    drawn = turn(carla, planned=False)
    assert isinstance(drawn, Corners)
    places, normals = drawn.positions.copy(), drawn.normals.copy()
    skin = turn(carla, planned=True)
    assert isinstance(skin, Planned)
    gpu, out = GpuSkin(GpuDeformer(surface.ctx), skin.shape), surface.ctx.buffer(reserve=24 * len(skin.shape.corner))
    gpu.run(skin.plan, out, skin.offsets)
    rows = np.frombuffer(out.read(), np.float32).reshape(-1, 6)
    assert np.quantile(np.abs(rows[:, :3] - places).max(axis=1), 0.999) < 5e-5
    assert np.quantile(np.linalg.norm(rows[:, 3:] - normals, axis=1), 0.99) < 0.06
    gpu.release()
