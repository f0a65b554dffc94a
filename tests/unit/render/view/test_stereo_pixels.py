"""Every way to show two eyes, checked in pixels: known points are drawn where each eye's ray meets the display."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from vistel.conference.display import Display
from vistel.render.gl.context import GlContext
from vistel.render.overlays.labels import Label
from vistel.render.overlays.overlays import LabelView
from vistel.render.painter import DrawnThing, Frame, Painter
from vistel.render.view.camera import look_at
from vistel.render.view.screens import RoomScreen, Sight, Stereo, boxes, picture_size, sights_of_desktop, sights_of_screens
from vistel.render.view.wall_pattern import pattern
from vistel.space.things.tessellate import tessellate
from vistel.space.things.things import ThingPrimitive

pytestmark = pytest.mark.gl
WIDTH, HEIGHT = 320, 240
EYES = np.array(((0.03, 1.2, -0.1), (-0.03, 1.2, -0.1)))
CORNERS = np.array((0.4, 0.9, 1.0)), np.array((-0.4, 0.9, 1.0)), np.array((0.4, 1.5, 1.0))
PLACES = [(0.15, 1.3, 1.4), (-0.2, 1.1, 1.0), (0.02, 1.22, 0.7)]


def flat(gain: tuple[float, float, float] = (1.0, 1.0, 1.0), blend: tuple[float, float, float, float] = (0.0,) * 4) -> RoomScreen:
    return RoomScreen("s", *CORNERS, WIDTH, HEIGHT, gain, blend)


@pytest.fixture
def painter(surface: GlContext) -> Iterator[Painter]:
    # A GPU would draw fine light, in which a room without surroundings is dark.
    painter = Painter(surface, WIDTH, HEIGHT, fine=False)
    yield painter
    assert painter.error() == "GL_NO_ERROR"


def dot(painter: Painter, place: tuple[float, float, float], radius: float = 0.02, grey: float = 1.0) -> DrawnThing:
    ball = tessellate(ThingPrimitive("sphere", (radius,)), 1.0)
    painter.set_thing("dot", ball, np.full((len(ball.vertices), 3), grey, np.float32))
    matrix = np.eye(4, dtype=np.float32)
    matrix[:3, 3] = place
    return DrawnThing("dot", matrix)


def drawn(painter: Painter, sights: list[Sight], place: tuple[float, float, float]) -> np.ndarray:
    """(h, w, 3) by how much a dot changes the picture."""
    painter.draw(Frame(sights))
    empty = painter.image().astype(int)
    painter.draw(Frame(sights, things=[dot(painter, place)]))
    return np.abs(painter.image().astype(int) - empty)


def middle(change: np.ndarray, box: tuple[int, int, int, int]) -> tuple[float, float]:
    """Where in a box of the picture something changed, pixels from its upper left."""
    x, y, w, h = box
    rows, columns = np.nonzero(change[len(change) - y - h : len(change) - y, x : x + w] > 8)
    assert len(rows), "nothing was drawn there"
    return float(columns.mean()) + 0.5, float(rows.mean()) + 0.5


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("stereo", [s for s in Stereo if s is not Stereo.MONO])
def test_each_eye_sees_a_point_where_its_ray_meets_the_screen(
    painter: Painter, stereo: Stereo, place: tuple[float, float, float]
) -> None:
    screen = flat()
    painter.resize(*picture_size([screen], stereo))
    seen = 0
    for frame in (0, 1) if stereo is Stereo.SEQUENTIAL else (0,):
        sights = sights_of_screens([screen], EYES, stereo, frame)
        change = drawn(painter, sights, place)
        for sight in sights:
            eye = int(np.argmin(np.linalg.norm(EYES - sight.camera.position, axis=1)))
            assert sight.box is not None
            _, _, w, h = sight.box
            # By similar triangles on the screen itself, which knows of no camera.
            t = (1.0 - EYES[eye, 2]) / (place[2] - EYES[eye, 2])
            at = EYES[eye] + t * (np.array(place) - EYES[eye])
            expected = (0.4 - at[0]) / 0.8 * w, (1.5 - at[1]) / 0.6 * h
            channels = [c for c in range(3) if sight.colours[c]]
            found = middle(change[..., channels].max(axis=2), sight.box)
            assert found == pytest.approx(expected, abs=1.5)
            if stereo is Stereo.QUAD_BUFFER:
                assert (w, h, sight.box[0]) == (WIDTH, HEIGHT, eye * WIDTH)
            seen += 1
    assert seen == 2


@pytest.mark.parametrize(("apart", "convergence"), [(0.063, 1.0), (0.05, 1.0), (0.063, 2.0)])
def test_on_a_desktop_convergence_is_where_both_eyes_agree_and_their_distance_how_far_they_do_not(
    painter: Painter, apart: float, convergence: float
) -> None:
    camera = look_at(np.array((0.0, 1.2, 0.0)), np.array((0.0, 1.2, 1.0)), 0.9)
    painter.resize(2 * WIDTH, HEIGHT)
    for distance in (0.8, 1.0, 2.0):
        sights = sights_of_desktop(camera, (2 * WIDTH, HEIGHT), Stereo.QUAD_BUFFER, 0, apart, convergence)
        change = drawn(painter, sights, (0.0, 1.2, distance)).max(axis=2)
        left, right = (middle(change, s.box)[0] for s in sights if s.box is not None)
        display = 2.0 * convergence * math.tan(0.45) * WIDTH / HEIGHT
        expected = apart * (1.0 - convergence / distance) / display * WIDTH
        assert right - left == pytest.approx(expected, abs=0.8)


@pytest.mark.parametrize("stereo", [Stereo.MONO, Stereo.SIDE_BY_SIDE, Stereo.TOP_BOTTOM, Stereo.ANAGLYPH, Stereo.QUAD_BUFFER])
def test_light_fades_to_the_edge_of_each_eyes_own_picture(painter: Painter, stereo: Stereo) -> None:
    light = []
    for blend in ((0.0,) * 4, (0.0, 0.25, 0.0, 0.0)):
        screen = flat(blend=blend)
        painter.resize(*picture_size([screen], stereo))
        sights = sights_of_screens([screen], EYES, stereo, 0)
        painter.draw(Frame(sights, things=[dot(painter, (0.0, 1.2, 1.3), 0.25)]))
        light.append((painter.image() / 255.0) ** 2.2)
    for sight in sights:
        assert sight.box is not None
        x, y, w, h = sight.box
        rows = slice(light[0].shape[0] - y - h, light[0].shape[0] - y)
        channel = 0 if sight.colours[0] else 1
        whole, faded = (p[rows, x : x + w, channel][h // 2] for p in light)
        share = faded / np.maximum(whole, 1e-3)
        assert share[: round(0.7 * w)] == pytest.approx(1.0, abs=0.03)
        ramp = (w - np.arange(round(0.78 * w), w) - 0.5) / (0.25 * w)
        bright = whole[round(0.78 * w) :] > 0.03
        assert share[round(0.78 * w) :][bright] == pytest.approx(ramp[bright], abs=0.12)


@pytest.mark.parametrize("stereo", [s for s in Stereo if s is not Stereo.SEQUENTIAL])
def test_names_have_their_shape_however_two_eyes_share_a_screen(painter: Painter, stereo: Stereo) -> None:
    name, place = Label("Grace Hopper"), np.array((0.0, 1.2, 1.3))
    sizes = []
    for kind in (Stereo.MONO, stereo):
        screen = flat()
        painter.resize(*picture_size([screen], kind))
        sights = sights_of_screens([screen], EYES, kind, 0)
        painter.draw(Frame(sights))
        empty = painter.image().astype(int)
        painter.draw(Frame(sights, labels=[LabelView(name, place)]))
        change = np.abs(painter.image().astype(int) - empty)
        assert sights[0].box is not None
        x, y, w, h = sights[0].box
        rows, columns = np.nonzero(change[len(change) - y - h : len(change) - y, x : x + w, 0] > 20)
        sizes.append((np.ptp(columns) / w, np.ptp(rows) / h))
    assert sizes[1] == pytest.approx(sizes[0], abs=0.04)


def test_gain_makes_two_projectors_of_different_light_alike(painter: Painter) -> None:
    """The left one gives a quarter less red: the right one's red is dimmed by as much, and nothing else."""
    light = []
    for gain in ((1.0, 1.0, 1.0), (0.75, 1.0, 1.0)):
        screen = flat(gain)
        painter.draw(Frame(sights_of_screens([screen], EYES, Stereo.MONO, 0), things=[dot(painter, (0.0, 1.2, 1.3), 0.25)]))
        light.append((painter.image()[100:140, 120:200] / 255.0) ** 2.2)
    ratio = light[1].mean(axis=(0, 1)) / light[0].mean(axis=(0, 1))
    assert ratio == pytest.approx((0.75, 1.0, 1.0), abs=0.02)


def test_the_calibration_picture_has_both_eyes_and_the_fading_of_each(surface: GlContext) -> None:
    screen = flat(blend=(0.0, 0.2, 0.0, 0.0))
    for stereo in (Stereo.SIDE_BY_SIDE, Stereo.QUAD_BUFFER):
        picture = pattern([screen], EYES, stereo)
        width, height = picture_size([screen], stereo)
        assert picture.shape == (height, width, 3)
        for half in (picture[:, : width // 2], picture[:, width // 2 :]):
            assert half[:, -2:].max() < half[:, 4 : width // 4].max() * 0.4


def test_a_file_may_ask_for_a_window_for_each_screen_only_where_there_are_screens() -> None:
    screen = {"name": "s", "lower_left": (0.5, 0.8, 1.0), "lower_right": (-0.5, 0.8, 1.0), "upper_left": (0.5, 1.4, 1.0)}
    whole = Display.model_validate({"window": "each", "screens": [screen | {"monitor": "HDMI-1", "at": (1920, 0)}]})
    assert whole.screens[0].at == (1920, 0)
    with pytest.raises(ValueError, match="there are no screens"):
        Display.model_validate({"window": "each"})
    with pytest.raises(ValueError, match="wider than 16384"):
        Display.model_validate({"stereo": "quad_buffer", "screens": [screen | {"width": 9000}]})
    assert boxes([flat(), flat()], Stereo.QUAD_BUFFER) == [(0, 0, 640, 240), (640, 0, 640, 240)]
