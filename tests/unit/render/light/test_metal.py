"""A metal ball and a rough one, side by side: metal mirrors in its own colour, rough things have no spot of light."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vistel.figure.making.source import Finish
from vistel.render.gl.context import GlContext
from vistel.render.painter import DrawnThing, Frame, Painter
from vistel.render.room.room import build_room
from vistel.render.view.camera import look_at
from vistel.render.view.screens import Sight
from vistel.space.files.surfaces import SurfacePiece
from vistel.space.room import meeting_room
from vistel.space.things.tessellate import tessellate
from vistel.space.things.things import ThingPrimitive

pytestmark = pytest.mark.gl

WIDTH, HEIGHT, GOLD = 320, 160, (255, 190, 60)
FINISHES = Finish(0.15, 1.0), Finish(0.9, 0.0)


def balls(surface: GlContext, fine: bool) -> tuple[np.ndarray, np.ndarray]:
    """Metal and rough: what is seen in the middle of each, (n, 3), 0 to 1."""
    painter = Painter(surface, WIDTH, HEIGHT, fine=fine)
    painter.set_room(build_room(meeting_room(0))[0], None)
    shape = tessellate(ThingPrimitive("sphere", (0.1,)), 1.5)
    camera = look_at(np.array([0.0, 1.25, 0.75]), np.array([0.0, 1.0, 0.0]), math.radians(32.0))
    views: list[DrawnThing] = []
    for name, x, finish in (("metal", -0.13, FINISHES[0]), ("rough", 0.13, FINISHES[1])):
        painter.set_thing(name, None, np.zeros((0, 3), np.float32), [SurfacePiece(shape, GOLD, mesh=True, finish=finish)])
        matrix = np.eye(4, dtype=np.float32)
        matrix[:3, 3] = x, 1.0, 0.0
        views.append(DrawnThing(name, matrix))
    painter.draw(Frame([Sight(camera)], things=views))
    image = painter.image().astype(float) / 255.0
    assert painter.error() == "GL_NO_ERROR"
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    out = []
    for x in (-0.13, 0.13):
        centre = camera.project(np.array([[x, 1.0, 0.0]]), WIDTH, HEIGHT)[0]
        out.append(image[(columns - centre[0]) ** 2 + (rows - centre[1]) ** 2 < 26.0**2])
    return out[0], out[1]


@pytest.mark.parametrize("fine", [True, False])
def test_metal_mirrors_the_lamp_and_the_room_and_chalk_does_not(surface: GlContext, fine: bool) -> None:
    metal, rough = balls(surface, fine)
    light, chalk = metal.mean(axis=1), rough.mean(axis=1)
    # A spot, far brighter than what is round it.
    assert np.quantile(light, 0.995) - np.median(light) > 1.4 * (np.quantile(chalk, 0.995) - np.median(chalk))
    # Elsewhere the ball is as dark as what it mirrors.
    assert np.quantile(light, 0.1) < 0.8 * np.quantile(chalk, 0.1)
    # What is mirrored has the metal's colour.
    bright = metal[light > np.quantile(light, 0.7)].mean(axis=0)
    assert bright[0] > bright[1] > bright[2]
