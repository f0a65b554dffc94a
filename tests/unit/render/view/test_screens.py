"""Walls of screens: what stands in the room stands behind the screens where the eye would see it through a window."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.conference import display
from vistel.conference.display import Display
from vistel.conference.files import load
from vistel.render.config import render_config
from vistel.render.gl.context import GlContext
from vistel.render.painter import DrawnThing, Frame, Painter
from vistel.render.view.camera import look_at
from vistel.render.view.screens import (
    RoomScreen,
    Sight,
    Stereo,
    boxes,
    eyes_apart,
    eyes_before,
    picture_size,
    sights_of_desktop,
    sights_of_screens,
)
from vistel.space.things.tessellate import tessellate
from vistel.space.things.things import ThingPrimitive

WIDTH, HEIGHT = 320, 240


def wall(name: str, towards: float, width: int = WIDTH) -> RoomScreen:
    """1.2 m wide, 0.9 m high, one of its edges 1 m before the origin, turned by `towards` degrees about that edge."""
    side = 1.0 if towards > 0 else -1.0
    angle = math.radians(abs(towards))
    far = np.array((side * 1.2 * math.sin(angle), 0.7, 1.0 - 1.2 * math.cos(angle)))
    seam = np.array((0.0, 0.7, 1.0))
    left, right = (far, seam) if side > 0 else (seam, far)
    return RoomScreen(name, left, right, left + np.array((0.0, 0.9, 0.0)), width, HEIGHT)


V = (wall("left", 70.0), wall("right", -70.0))
"""A V that opens towards the viewer; they face +Z, so left is +X."""
EYES = np.array(((0.03, 1.15, -0.1), (-0.03, 1.15, -0.1)))

coordinate = st.floats(-0.6, 0.6)


@given(coordinate, coordinate, st.floats(-0.3, 0.4), st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 6.0))
def test_what_lies_behind_a_place_of_the_screen_is_drawn_there_wherever_the_eye_is(
    x: float, y: float, z: float, u: float, v: float, beyond: float
) -> None:
    eye = np.array((x, 1.1 + y, z - 0.4))
    for screen in V:
        camera = screen.seen_from(eye)
        assert camera is not None
        place = screen.lower_left + u * (screen.lower_right - screen.lower_left) + v * (screen.upper_left - screen.lower_left)
        shown = camera.project((eye + (1.0 + beyond) * (place - eye))[None], screen.width, screen.height)[0]
        assert shown[:2] == pytest.approx((u * screen.width, (1.0 - v) * screen.height), abs=1e-6)
        clip = camera.projection(screen.width / screen.height) @ camera.view() @ np.append(place, 1.0)
        assert clip[:2] / clip[3] == pytest.approx((2 * u - 1, 2 * v - 1), abs=1e-9)


def test_a_window_straight_ahead_is_an_ordinary_camera() -> None:
    camera = look_at(np.array((0.2, 1.0, -1.0)), np.array((0.0, 1.1, 1.0)), math.radians(50.0))
    (sight,) = sights_of_desktop(camera, (WIDTH, HEIGHT), Stereo.MONO, 0, 0.06, 1.7)
    aspect = WIDTH / HEIGHT
    assert sight.camera.projection(aspect) == pytest.approx(camera.projection(aspect), abs=1e-12)
    assert sight.camera.view() == pytest.approx(camera.view(), abs=1e-12)


@pytest.mark.parametrize("way", [-0.01, 0.0, 0.01])
def test_an_eye_behind_a_screen_or_as_good_as_in_its_plane_sees_nothing_on_it(way: float) -> None:
    flat = RoomScreen("s", np.array((1.0, 0, 1.0)), np.array((-1.0, 0, 1.0)), np.array((1.0, 1.0, 1.0)), 64, 64)
    assert flat.seen_from(np.array((0.0, 0.5, 1.0 + way))) is None
    assert flat.seen_from(np.array((0.0, 0.5, 0.9))) is not None


def test_to_two_eyes_things_on_the_screen_are_one_those_behind_it_uncrossed_those_before_it_crossed() -> None:
    flat = RoomScreen("s", np.array((0.8, 0.7, 1.0)), np.array((-0.8, 0.7, 1.0)), np.array((0.8, 1.6, 1.0)), 640, 360)
    left, right = (flat.seen_from(eye) for eye in EYES)
    assert left is not None
    assert right is not None
    for depth, sign in ((1.0, 0), (3.0, 1), (0.5, -1)):
        point = np.array((0.1, 1.2, depth))
        apart = right.project(point[None], 640, 360)[0, 0] - left.project(point[None], 640, 360)[0, 0]
        expected = 0.06 / 1.6 * 640 * (1.0 - 1.1 / (depth + 0.1))
        assert apart == pytest.approx(expected, abs=1e-6)
        assert np.sign(round(apart, 6)) == sign


def test_each_way_to_show_two_eyes_shares_a_screen_without_gap_or_overlap() -> None:
    for stereo in (Stereo.SIDE_BY_SIDE, Stereo.TOP_BOTTOM):
        covered = np.zeros((HEIGHT, 2 * WIDTH + 1), int)
        screens = (V[0], replace(V[1], width=WIDTH + 1))
        sights = sights_of_screens(screens, EYES, stereo, 0)
        assert len(sights) == 4
        for sight in sights:
            assert sight.box is not None
            x, y, w, h = sight.box
            covered[y : y + h, x : x + w] += 1
        assert (covered == 1).all()
    red, cyan = sights_of_screens(V[:1], EYES, Stereo.ANAGLYPH, 0)
    assert (red.colours, cyan.colours) == ((True, False, False), (False, True, True))
    assert [sights_of_screens(V[:1], EYES, Stereo.SEQUENTIAL, n)[0].camera.position[0] for n in (0, 1, 2)] == [0.03, -0.03, 0.03]
    (between,) = sights_of_screens(V[:1], EYES, Stereo.MONO, 0)
    assert between.camera.position == pytest.approx(EYES.mean(axis=0))


def test_eyes_are_put_as_far_apart_as_the_viewer_says() -> None:
    apart = eyes_apart(EYES, 0.07)
    assert np.linalg.norm(apart[0] - apart[1]) == pytest.approx(0.07)
    assert apart.mean(axis=0) == pytest.approx(EYES.mean(axis=0))
    assert all(screen.seen_from(eye) for screen in V for eye in eyes_before(V, 0.06))


def test_a_screen_of_the_file_stands_where_its_viewers_seat_does() -> None:
    config = display.Screen(name="s", lower_left=(0.5, 0.8, 1.0), lower_right=(-0.5, 0.8, 1.0), upper_left=(0.5, 1.4, 1.0))
    placed = RoomScreen.placed(config, np.array((2.0, 0.0, 0.0)), -math.pi / 2)  # faces -X, so left is +Z
    assert placed.lower_left == pytest.approx((1.0, 0.8, 0.5))
    assert placed.lower_right == pytest.approx((1.0, 0.8, -0.5))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"lower_right": (0.5, 0.8, 1.0)}, "are two corners the same"),
        ({"upper_left": (-0.5, 1.4, 1.0)}, "no right angle"),
        ({"upper_left": (0.0, 0.8, 1.0)}, "no right angle"),
        ({"gain": (1.0, 1.2, 1.0)}, "from 0 to 1"),
        ({"blend": (0.6, 0, 0, 0)}, "from 0 to 0.5"),
    ],
)
def test_a_screen_that_is_none_is_refused_with_its_name(change: dict, said: str) -> None:
    good = {"name": "s", "lower_left": (0.5, 0.8, 1.0), "lower_right": (-0.5, 0.8, 1.0), "upper_left": (0.5, 1.4, 1.0)}
    display.Screen.model_validate(good)
    with pytest.raises(ValueError, match=f"screen s.*{said}"):
        display.Screen.model_validate(good | change)
    with pytest.raises(ValueError, match="s stands twice"):
        Display.model_validate({"screens": [good, good]})


def test_the_wall_in_the_examples_is_a_v_whose_screens_share_an_edge() -> None:
    conference = load(Path(__file__).parents[4] / "examples/conferences/v-wall.toml")
    config = render_config(conference, conference.sites[0])
    left, right = config.view.screens
    assert left.lower_right == pytest.approx(right.lower_left)
    assert (config.view.width, config.view.height) == (1280, 480)
    assert config.view.stereo is Stereo.SIDE_BY_SIDE


def _dots(painter: Painter, *places: tuple[float, float, float], grey: float = 1.0) -> list[DrawnThing]:
    out: list[DrawnThing] = []
    for n, place in enumerate(places):
        ball = tessellate(ThingPrimitive("sphere", (0.02,)), 1.0)
        painter.set_thing(f"dot{n}", ball, np.full((len(ball.vertices), 3), grey, np.float32))
        matrix = np.eye(4, dtype=np.float32)
        matrix[:3, 3] = place
        out.append(DrawnThing(f"dot{n}", matrix))
    return out


def _centre(picture: np.ndarray, empty: np.ndarray, at: np.ndarray, reach: float = 14.0) -> np.ndarray:
    """Where the middle of what was drawn near a pixel lies."""
    ys, xs = np.nonzero(np.abs(picture.astype(int) - empty.astype(int)).max(axis=2) > 25)
    near = np.hypot(xs - at[0], ys - at[1]) < reach
    assert near.any()
    return np.array((xs[near].mean() + 0.5, ys[near].mean() + 0.5))


@pytest.mark.parametrize("stereo", [Stereo.MONO, Stereo.SIDE_BY_SIDE, Stereo.TOP_BOTTOM])
def test_on_a_v_of_two_screens_points_are_drawn_where_the_eyes_rays_meet_them(surface: GlContext, stereo: Stereo) -> None:
    width, height = picture_size(V)
    painter = Painter(surface, width, height)
    places = [(0.6, 1.2, 1.4), (0.4, 1.05, 1.9), (-0.5, 1.2, 1.6), (-0.45, 1.3, 1.1)]
    sights = sights_of_screens(V, EYES, stereo, 0)
    painter.draw(Frame(sights))
    empty = painter.image()
    painter.draw(Frame(sights, things=_dots(painter, *places)))
    picture = painter.image()
    seen = 0
    for sight in sights:
        assert sight.box is not None
        x, y, w, h = sight.box
        for place in places:
            px, py, depth = sight.camera.project(np.array([place]), w, h)[0]
            if not (8 < px < w - 8 and 8 < py < h - 8 and depth > 0):
                continue
            expected = np.array((x + px, height - y - h + py))
            assert _centre(picture, empty, expected) == pytest.approx(expected, abs=1.2)
            seen += 1
    assert seen == len(places) * len(sights) // 2


def test_an_anaglyph_shows_each_eye_its_colours(surface: GlContext) -> None:
    flat = RoomScreen("s", np.array((0.4, 0.9, 1.0)), np.array((-0.4, 0.9, 1.0)), np.array((0.4, 1.5, 1.0)), WIDTH, HEIGHT)
    painter = Painter(surface, WIDTH, HEIGHT)
    place = (0.0, 1.2, 2.5)
    sights = sights_of_screens((flat,), EYES, Stereo.ANAGLYPH, 0)
    painter.draw(Frame(sights, things=_dots(painter, place, grey=0.0)))
    picture = painter.image().astype(int)
    for sight, channel in zip(sights, (0, 2), strict=True):
        at = sight.camera.project(np.array([place]), WIDTH, HEIGHT)[0]
        shown = picture[int(at[1]), int(at[0])]
        assert shown[channel] < 90
        assert shown[2 - channel] > 140


def test_where_two_projectors_overlap_their_light_adds_up_to_one(surface: GlContext) -> None:
    flat = RoomScreen("s", np.array((0.4, 0.9, 1.0)), np.array((-0.4, 0.9, 1.0)), np.array((0.4, 1.5, 1.0)), WIDTH, HEIGHT)
    light = []
    for blend in ((0.0, 0.0, 0.0, 0.0), (0.0, 0.25, 0.0, 0.0), (0.25, 0.0, 0.0, 0.0)):
        screen = replace(flat, blend=blend)
        painter = Painter(surface, WIDTH, HEIGHT)
        ahead = look_at(np.array((0.0, 1.2, -1.5)), np.array((0.0, 1.2, 0.0)), 0.5)
        dots = _dots(painter, (0.0, 1.2, 0.0))
        dots[0].matrix[:3, :3] *= 50.0
        painter.draw(Frame([Sight(ahead, boxes((screen,))[0], screen=screen)], things=dots))
        light.append(((painter.image()[HEIGHT // 2] / 255.0) ** 2.2).mean(axis=1))
    assert light[0].min() > 0.2
    left, right = light[1] / light[0], light[2] / light[0]
    assert left[-WIDTH // 4 :] + right[: WIDTH // 4] == pytest.approx(1.0, abs=0.03)
    assert left[: WIDTH // 2] == pytest.approx(1.0, abs=0.02)
