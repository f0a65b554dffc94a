"""What a figure's file says of its surface is drawn so: gloss, metal, bumps, holes and glow, in fine light and in fast."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest

from vistel.figure.avatar.patch import Patch
from vistel.render.figures.drawn import Corners, FigureModel, FigureView
from vistel.render.gl.context import GlContext
from vistel.render.painter import Frame, Painter
from vistel.render.room.room import build_room
from vistel.render.view.camera import Camera, look_at
from vistel.render.view.screens import Sight
from vistel.space.room import meeting_room
from vistel.space.things.tessellate import tessellate
from vistel.space.things.things import ThingPrimitive

pytestmark = [pytest.mark.gl, pytest.mark.parametrize("fine", [True, False])]

WIDTH, HEIGHT = 240, 160
GOLD, WHITE = (255, 190, 60), (230, 230, 230)


def texture(colour: tuple[int, int, int]) -> np.ndarray:
    return np.full((8, 8, 3), colour, np.uint8)


def figure(
    name: str,
    positions: np.ndarray,
    normals: np.ndarray,
    uv: np.ndarray,
    triangles: np.ndarray,
    patch: Patch | None,
    colour: tuple[int, int, int] = WHITE,
) -> FigureView:
    """Limbs are tiny: what throws a shadow is its triangles."""
    patches = () if patch is None else (patch,)
    triangles = triangles.astype(np.int32)
    model = FigureModel(
        uv.astype(np.float32), np.zeros(len(uv), np.float32), triangles, triangles, texture(colour), patches=patches
    )
    limbs = np.array([[*positions.mean(axis=0), 1e-3, *positions.mean(axis=0), 1e-3]], np.float32)
    return FigureView(name, model, Corners(np.hstack((positions, normals)).astype(np.float32)), limbs)


def ball(patch: Patch | None, colour: tuple[int, int, int] = WHITE) -> FigureView:
    shape = tessellate(ThingPrimitive("sphere", (0.2,)), 1.5)
    uv = np.full((len(shape.vertices), 2), 0.5)
    return figure("ball", shape.vertices + np.array([0.0, 1.2, 0.0]), shape.normals, uv, shape.triangles, patch, colour)


def sheet(
    patch: Patch | None,
    corner: tuple[float, float, float],
    u: tuple[float, float, float],
    v: tuple[float, float, float],
    flipped: bool = False,
) -> FigureView:
    """A square: texture coordinates 0 to 1 along u and v from a corner."""
    at = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    p = np.array(corner) + at[:, :1] * np.array(u) + at[:, 1:] * np.array(v)
    n = np.cross(u, v)
    triangles = np.array([(0, 1, 2), (0, 2, 3)])
    normals = np.tile(n / np.linalg.norm(n), (4, 1))
    return figure("sheet", p, normals, at, triangles[:, ::-1] if flipped else triangles, patch)


@lru_cache(maxsize=2)
def painter_of(surface: GlContext, fine: bool) -> Painter:
    """One for all pictures: making a room takes longer than drawing it."""
    painter = Painter(surface, WIDTH, HEIGHT, fine=fine)
    painter.saves_shadows = False
    painter.set_room(build_room(meeting_room(0))[0], None)
    return painter


def drawn(surface: GlContext, fine: bool, view: FigureView, camera: Camera) -> np.ndarray:
    painter = painter_of(surface, fine)
    painter.draw(Frame([Sight(camera)], [view]))
    picture = painter.image().astype(float) / 255.0
    assert painter.error() == "GL_NO_ERROR"
    painter.drop_figure(view.name)
    return picture


FRONT = look_at(np.array([-0.55, 1.75, 0.6]), np.array([0.0, 1.2, 0.0]), math.radians(32.0))

ABOVE = look_at(np.array([0.6, 1.9, 0.9]), np.array([0.06, 0.82, -0.05]), math.radians(32.0))


def disc(picture: np.ndarray) -> np.ndarray:
    """(n, 3) pixels well inside the ball."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    return picture[(columns - WIDTH / 2) ** 2 + (rows - HEIGHT / 2) ** 2 < 40.0**2]


def contrast(pixels: np.ndarray) -> float:
    light = pixels.mean(axis=1)
    return float(np.quantile(light, 0.995) - np.median(light))


def test_a_smooth_surface_has_a_spot_of_light_and_a_rough_one_has_none(surface: GlContext, fine: bool) -> None:
    grey = (90, 90, 90)
    smooth, rough = (disc(drawn(surface, fine, ball(Patch(roughness=r), grey), FRONT)) for r in (0.2, 1.0))
    assert contrast(smooth) > contrast(rough) + 0.1


def test_roughness_comes_from_the_green_of_its_picture_and_metal_from_the_blue(surface: GlContext, fine: bool) -> None:
    def told(green: int, blue: int) -> np.ndarray:
        picture = np.full((4, 4, 3), (255, green, blue), np.uint8)
        return disc(drawn(surface, fine, ball(Patch(finish=picture), GOLD), FRONT))

    def plain(rough: float, metal: float) -> np.ndarray:
        return disc(drawn(surface, fine, ball(Patch(roughness=rough, metallic=metal), GOLD), FRONT))

    np.testing.assert_allclose(told(51, 0), plain(0.2, 0.0), atol=0.02)
    np.testing.assert_allclose(told(102, 255), plain(0.4, 1.0), atol=0.02)


def test_metal_tints_its_highlight_and_has_no_colour_beside_what_it_mirrors(surface: GlContext, fine: bool) -> None:
    copper = (120, 70, 40)
    metal, paint = (disc(drawn(surface, fine, ball(Patch(roughness=0.45, metallic=m), copper), FRONT)) for m in (1.0, 0.0))

    def blue_of(pixels: np.ndarray) -> float:
        """Beside red, where it is brightest."""
        spot = pixels[pixels.mean(axis=1) > np.quantile(pixels.mean(axis=1), 0.98)].mean(axis=0)
        return float(spot[2] / spot[0])

    assert blue_of(metal) < blue_of(paint) - 0.05
    assert np.median(metal.mean(axis=1)) < np.median(paint.mean(axis=1))


def lit(surface: GlContext, fine: bool, bend: tuple[int, int, int] | None) -> float:
    """Of a sheet that stands with v up and faces +Z: the lamp is above, and to its left."""
    normal = None if bend is None else np.full((4, 4, 3), bend, np.uint8)
    patch = Patch(roughness=1.0, normal=normal)
    camera = look_at(np.array([0.1, 1.2, 1.2]), np.array([0.1, 1.2, 0.0]), math.radians(20.0))
    view = sheet(patch, (-0.3, 0.8, 0.0), (0.8, 0.0, 0.0), (0.0, 0.8, 0.0))
    picture = drawn(surface, fine, view, camera)
    return float(picture[60:100, 100:140].mean())


def test_a_normal_map_tilts_the_shading_green_up_and_red_along_u(surface: GlContext, fine: bool) -> None:
    flat, none = lit(surface, fine, (128, 128, 255)), lit(surface, fine, None)
    assert abs(flat - none) < 0.02
    assert lit(surface, fine, (128, 200, 230)) > flat + 0.03 > lit(surface, fine, (128, 56, 230)) + 0.06
    assert lit(surface, fine, (56, 128, 230)) > flat + 0.02 > lit(surface, fine, (200, 128, 230)) + 0.04


def over_the_table(surface: GlContext, fine: bool, patch: Patch | None) -> np.ndarray:
    """A sheet over the table in the light, looked at from above: sheet and shadow."""
    return drawn(surface, fine, sheet(patch, (-0.2, 0.95, 0.15), (0.3, 0.0, 0.0), (0.0, 0.0, -0.3)), ABOVE)


def test_where_its_opacity_is_nothing_a_surface_is_not_drawn_and_throws_no_shadow(surface: GlContext, fine: bool) -> None:
    nothing = over_the_table(surface, fine, Patch(roughness=1.0, opacity=np.zeros((8, 8), np.uint8)))
    empty = drawn(surface, fine, sheet(None, (0.0, -5.0, 0.0), (0.01, 0.0, 0.0), (0.0, 0.0, -0.01)), ABOVE)
    np.testing.assert_allclose(nothing, empty, atol=0.02)
    half = np.full((8, 8), 255, np.uint8)
    half[:, :4] = 0
    solid = np.full((8, 8), 255, np.uint8)
    whole, left_out = (over_the_table(surface, fine, Patch(roughness=1.0, opacity=o)) for o in (solid, half))
    seen = np.abs(whole - empty).max(axis=2) > 0.08
    gone = seen & (np.abs(left_out - empty).max(axis=2) < 0.04)
    assert 0.3 * seen.sum() < gone.sum() < 0.7 * seen.sum()
    darker = (empty - whole).mean(axis=2) > 0.08
    assert darker.sum() > 400  # its shadow
    assert 0.25 < (darker & gone).sum() / darker.sum() < 0.75


def test_what_is_two_sided_is_seen_from_behind_and_what_is_not_is_not(surface: GlContext, fine: bool) -> None:
    def middle(both: bool) -> np.ndarray:
        view = sheet(Patch(roughness=1.0, both_sides=both), (-0.4, 0.8, 0.0), (0.8, 0.0, 0.0), (0.0, 0.8, 0.0), flipped=True)
        picture = drawn(surface, fine, view, look_at(np.array([0.0, 1.2, 1.2]), np.array([0.0, 1.2, 0.0]), 0.4))
        return picture[60:100, 100:140]

    assert np.abs(middle(True).mean(axis=(0, 1)) - middle(False).mean(axis=(0, 1))).max() > 0.1


def test_what_glows_is_bright_in_the_colour_of_its_glow(surface: GlContext, fine: bool) -> None:
    dark = (20, 20, 20)
    plain = Patch(roughness=1.0, glow=(0.0, 1.0, 0.0))
    pictured = Patch(roughness=1.0, glow=(1.0, 1.0, 1.0), glow_picture=np.full((4, 4, 3), (255, 0, 0), np.uint8))
    green, red = (disc(drawn(surface, fine, ball(p, dark), FRONT)).mean(axis=0) for p in (plain, pictured))
    assert green[1] > green[0] + 0.3
    assert red[0] > red[1] + 0.3


def test_occlusion_takes_the_light_of_the_room_and_not_that_of_the_lamp(surface: GlContext, fine: bool) -> None:
    shaded = look_at(np.array([0.6, 0.75, -0.45]), np.array([0.0, 1.2, 0.0]), math.radians(32.0))

    def seen(occlusion: int, camera: Camera) -> float:
        finish = np.full((4, 4, 3), (occlusion, 255, 0), np.uint8)
        return float(np.median(disc(drawn(surface, fine, ball(Patch(finish=finish), (90, 90, 90)), camera)).mean(axis=1)))

    assert seen(0, FRONT) > 0.6 * seen(255, FRONT)
    assert seen(0, shaded) < 0.4 * seen(255, shaded)


def test_the_rest_of_a_figure_stays_as_the_limb_has_it(surface: GlContext, fine: bool) -> None:
    beside = Patch(box=(0.6, 0.6, 1.0, 1.0), roughness=0.1, metallic=1.0)
    np.testing.assert_array_equal(drawn(surface, fine, ball(beside), FRONT), drawn(surface, fine, ball(None), FRONT))
