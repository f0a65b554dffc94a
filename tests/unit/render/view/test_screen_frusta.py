"""Any flat screen and any eye before it: a place is drawn where the straight line from the eye to it crosses the screen."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from vistel.render.gl.context import GlContext
from vistel.render.interaction.picking import ray_through
from vistel.render.painter import DrawnThing, Frame, Painter
from vistel.render.view.camera import FAR, NEAR
from vistel.render.view.screens import EYE_DISTANCE, RoomScreen, Stereo, boxes, eyes_apart, sights_of_screens
from vistel.render.view.wall_pattern import eyes_at
from vistel.space.things.tessellate import tessellate
from vistel.space.things.things import ThingPrimitive

PIXELS = 0.05
"""No place is drawn further off than this."""

metre = st.floats(-3.0, 3.0, width=32)
place = st.builds(lambda x, y, z: np.array((x, y, z)), metre, metre, metre)
share = st.floats(0.0, 1.0, width=32)


@st.composite
def screens(draw: st.DrawFn) -> RoomScreen:
    """Three corners that do not lie in a line; the screen need not be upright, nor its corners' angle be right."""
    low_left, low_right, up_left = draw(place), draw(place), draw(place)
    across, up = low_right - low_left, up_left - low_left
    w, h = float(np.linalg.norm(across)), float(np.linalg.norm(up))
    assume(w > 0.1 and h > 0.1)
    assume(float(np.linalg.norm(np.cross(across, up))) > 0.2 * w * h)
    return RoomScreen("s", low_left, low_right, up_left, draw(st.integers(16, 4096)), draw(st.integers(16, 4096)))


@st.composite
def viewed(draw: st.DrawFn) -> tuple[RoomScreen, np.ndarray]:
    """A screen, and (2, 3) eyes before it: somewhere up to 3 m from its plane, a head turned any way."""
    screen = draw(screens())
    across, up = screen.lower_right - screen.lower_left, screen.upper_left - screen.lower_left
    back = np.cross(across, up) / np.linalg.norm(np.cross(across, up))
    u, v = draw(st.floats(-1.0, 2.0)), draw(st.floats(-1.0, 2.0))
    middle = screen.lower_left + u * across + v * up + draw(st.floats(0.15, 3.0)) * back
    way = draw(place)
    assume(float(np.linalg.norm(way)) > 0.1)
    return screen, eyes_apart(np.stack((middle - way, middle + way)), EYE_DISTANCE)


def crossed(screen: RoomScreen, eye: np.ndarray, point: np.ndarray) -> np.ndarray:
    """The pixel, from the upper left, where the line from an eye to a point crosses the screen: of three equations for how far
    along the line and along two edges that is, which know of no camera."""
    across, up = screen.lower_right - screen.lower_left, screen.upper_left - screen.lower_left
    _, u, v = np.linalg.solve(np.stack((point - eye, -across, -up), axis=1), screen.lower_left - eye)
    return np.array((u * screen.width, (1.0 - v) * screen.height))


@given(viewed(), share, share, st.floats(0.3, 4.0))
@settings(max_examples=300)
def test_a_place_is_drawn_where_the_line_from_either_eye_to_it_crosses_the_screen(
    seen: tuple[RoomScreen, np.ndarray], u: float, v: float, beyond: float
) -> None:
    screen, eyes = seen
    across, up = screen.lower_right - screen.lower_left, screen.upper_left - screen.lower_left
    point = eyes.mean(axis=0) + beyond * (screen.lower_left + u * across + v * up - eyes.mean(axis=0))
    sights = sights_of_screens([screen], eyes, Stereo.QUAD_BUFFER, 0)
    assert len(sights) == 2
    for eye, sight in zip(eyes, sights, strict=True):
        assume(float((point - eye) @ -sight.camera.rotation[:, 2]) > 0.05)
        expected = crossed(screen, eye, point)
        found = sight.camera.project(point[None], screen.width, screen.height)[0, :2]
        assert found == pytest.approx(expected, abs=PIXELS)
        # As OpenGL does it.
        clip = sight.camera.projection(screen.width / screen.height) @ sight.camera.view() @ np.append(point, 1.0)
        in_picture = 0.5 + 0.5 * clip[:2] / clip[3]
        assert (in_picture[0] * screen.width, (1.0 - in_picture[1]) * screen.height) == pytest.approx(expected, abs=PIXELS)
        if NEAR < clip[3] < FAR:
            assert -1.0 <= clip[2] / clip[3] <= 1.0


@given(viewed(), share, share)
def test_a_mouse_points_where_the_picture_is(seen: tuple[RoomScreen, np.ndarray], u: float, v: float) -> None:
    screen, eyes = seen
    sights = sights_of_screens([screen], eyes, Stereo.MONO, 0)
    ray = ray_through(sights, u * screen.width, v * screen.height, (screen.width, screen.height))
    assert ray is not None
    across, up = screen.lower_right - screen.lower_left, screen.upper_left - screen.lower_left
    there = screen.lower_left + u * across + (1.0 - v) * up
    assert np.linalg.norm(np.cross(there - ray.origin, ray.direction)) < 1e-5


@given(viewed(), st.sampled_from([s for s in Stereo if s is not Stereo.SEQUENTIAL]))
def test_however_eyes_share_a_screen_each_picture_shows_all_of_it(seen: tuple[RoomScreen, np.ndarray], stereo: Stereo) -> None:
    screen, eyes = seen
    (whole,) = boxes([screen], stereo)
    for sight in sights_of_screens([screen], eyes, stereo, 0):
        assert sight.box is not None
        _, _, w, h = sight.box
        assert 0 < w <= whole[2] and 0 < h <= whole[3]
        corners = np.stack((screen.lower_left, screen.lower_right, screen.upper_left))
        assert sight.camera.project(corners, w, h)[:, :2] == pytest.approx(np.array(((0, h), (w, h), (0, 0))), abs=PIXELS)


@pytest.mark.gl
def test_on_a_leaning_screen_what_is_drawn_is_there_as_well(surface: GlContext) -> None:
    """Measured corners a good degree off the right angle, drawn by OpenGL."""
    eyes = eyes_at(np.zeros(3), 0.0, EYE_DISTANCE)
    low, right, up = np.array((0.5, 0.9, 1.0)), np.array((-0.5, 0.9, 1.0)), np.array((0.38, 1.6, 1.0))
    screen = RoomScreen("s", low, right, up, 500, 350)
    painter = Painter(surface, 500, 350)
    ball = tessellate(ThingPrimitive("sphere", (0.012,)), 1.0)
    painter.set_thing("dot", ball, np.ones((len(ball.vertices), 3), np.float32))
    for place in ((0.2, 1.45, 1.4), (-0.2, 1.0, 1.2), (0.05, 1.35, 1.0)):
        (sight,) = sights_of_screens([screen], eyes, Stereo.MONO, 0)
        painter.draw(Frame([sight]))
        empty = painter.image().astype(int)
        matrix = np.eye(4, dtype=np.float32)
        matrix[:3, 3] = place
        painter.draw(Frame([sight], things=[DrawnThing("dot", matrix)]))
        rows, columns = np.nonzero(np.abs(painter.image().astype(int) - empty).max(axis=2) > 8)
        expected = crossed(screen, eyes.mean(axis=0), np.array(place))
        near = np.hypot(columns - expected[0], rows - expected[1]) < 16
        assert (columns[near].mean() + 0.5, rows[near].mean() + 0.5) == pytest.approx(expected, abs=0.4)
