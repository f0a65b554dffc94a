"""What fine light adds to a picture: soft shadows, mirrored surroundings, dark corners."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from vistel.render.gl.context import GlContext
from vistel.render.light.shadow import KEY_DIRECTION
from vistel.render.painter import DrawnThing, Frame, Painter
from vistel.render.room.room import build_room
from vistel.render.view.camera import Camera, look_at
from vistel.render.view.screens import Sight
from vistel.space.room import meeting_room
from vistel.space.things.tessellate import tessellate
from vistel.space.things.things import ThingPrimitive

pytestmark = pytest.mark.gl

WIDTH, HEIGHT = 320, 180


@pytest.fixture
def painter(surface: GlContext) -> Iterator[Painter]:
    painter = Painter(surface, WIDTH, HEIGHT, fine=True)
    floor_only = [p for p in build_room(meeting_room(0))[0] if abs(p.normals[0, 1]) > 0.9 and p.positions[0, 1] < 0.01]
    painter.set_room(floor_only, None)
    yield painter
    assert painter.error() == "GL_NO_ERROR"


def put(painter: Painter, name: str, primitive: ThingPrimitive, grey: float = 0.5) -> None:
    surface = tessellate(primitive, 1.0)
    painter.set_thing(name, surface, np.full((len(surface.vertices), 3), grey, np.float32))


def at(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4, dtype=np.float32)
    matrix[:3, 3] = x, y, z
    return matrix


def light(painter: Painter, camera: Camera, *things: DrawnThing) -> np.ndarray:
    """(HEIGHT, WIDTH) brightness, 0 to 1."""
    painter.draw(Frame([Sight(camera)], things=list(things)))
    return painter.image().mean(axis=2) / 255.0


KEY = KEY_DIRECTION / np.linalg.norm(KEY_DIRECTION)
ALONG = np.array((KEY[0], 0.0, KEY[2])) / math.hypot(KEY[0], KEY[2])
"""Over the floor towards the light."""


def penumbra(painter: Painter, height: float) -> float:
    """Metres over which the edges of a ball's shadow fade, the ball `height` over the floor."""
    put(painter, "ball", ThingPrimitive("sphere", (0.09,)))
    above = at(*(height / KEY[1] * KEY))  # its shadow lies about the origin
    camera = look_at(-0.9 * ALONG + np.array((0.0, 0.6, 0.0)), np.zeros(3), math.radians(40.0))
    with_ball, without = light(painter, camera, DrawnThing("ball", above)), light(painter, camera)
    line = np.linspace(-0.3, 0.3, 300)[:, None] * np.array((ALONG[2], 0.0, -ALONG[0]))
    pixels = camera.project(line, WIDTH, HEIGHT)
    column, row = pixels[:, 0].astype(int), pixels[:, 1].astype(int)
    share = (with_ball[row, column] / without[row, column]) ** 2
    smooth = np.convolve(share, np.ones(9) / 9, mode="valid")
    dark, bright = smooth.min(), smooth.max()
    assert dark < 0.6 * bright
    between = (smooth > dark + 0.2 * (bright - dark)) & (smooth < bright - 0.2 * (bright - dark))
    return float(between.sum()) * 0.6 / 300


def test_a_shadow_grows_soft_with_the_distance_of_what_throws_it(painter: Painter) -> None:
    near, far = penumbra(painter, 0.12), penumbra(painter, 0.75)
    assert far > 1.5 * near


def test_the_floor_is_darker_close_to_what_stands_on_it_and_not_elsewhere(painter: Painter) -> None:
    put(painter, "ball", ThingPrimitive("sphere", (0.15,)))
    camera = look_at(1.0 * ALONG + np.array((0.0, 0.5, 0.0)), np.zeros(3), math.radians(60.0))
    empty, with_ball = light(painter, camera), light(painter, camera, DrawnThing("ball", at(0.0, 0.15, 0.0)))

    def change(away: float) -> float:
        """On the lit side, so many metres from where the ball stands."""
        x, y, _ = camera.project((away * ALONG)[None], WIDTH, HEIGHT)[0]
        patch = slice(int(y) - 1, int(y) + 2), slice(int(x) - 6, int(x) + 7)
        return float(with_ball[patch].mean() / empty[patch].mean())

    assert change(0.08) < 0.9
    assert change(0.6) == pytest.approx(1.0, abs=0.01)


def test_a_smooth_ball_mirrors_the_lamp_as_a_small_bright_spot(painter: Painter) -> None:
    put(painter, "ball", ThingPrimitive("sphere", (0.15,)), grey=0.1)
    camera = look_at(np.array((0.0, 1.0, 1.0)), np.array((0.0, 0.6, 0.0)), math.radians(30.0))
    picture = light(painter, camera, DrawnThing("ball", at(0.0, 0.6, 0.0)))
    v = camera.position - np.array((0.0, 0.6, 0.0))
    half = KEY + v / np.linalg.norm(v)
    spot = np.array((0.0, 0.6, 0.0)) + 0.15 * half / np.linalg.norm(half)
    x, y, _ = camera.project(spot[None], WIDTH, HEIGHT)[0]
    row, column = np.unravel_index(np.argmax(picture * (picture < 2.0)), picture.shape)
    assert (column, row) == pytest.approx((x, y), abs=6)
