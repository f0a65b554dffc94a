"""A panel shows what its participant shows live while that comes, and its page before and after."""

from __future__ import annotations

import math

import numpy as np
import pytest
from screen_stream import plain

from vistel.geometry.pose import Pose
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.screens import Shown
from vistel.render.stage.stage import Instant
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.camera import look_at
from vistel.space.commands.panel import panel
from vistel.space.pages.sheet import sheet_of
from vistel.space.things.things import Pages

pytestmark = pytest.mark.gl
PLACE = np.array([0.0, 0.3, -1.5])


def halves(left: tuple[int, int, int], right: tuple[int, int, int], width: int = 640, height: int = 360) -> np.ndarray:
    picture = plain(left, width, height)
    picture[: height // 2, width // 2 :] = right
    return picture


@pytest.mark.parametrize("light", ["fast", "fine"])
def test_each_picture_is_seen_upright_and_the_page_again_when_none_comes(light: str) -> None:
    page = sheet_of(plain((230, 230, 230)))
    thing = panel("panel", "Screen of Ann", 16 / 9, Pages((page.digest,), 0, "ann", live=True))
    renderer = SceneRenderer(View(320, 180, "room", "", light=light), 3, models={page.digest: page})
    renderer.camera = camera = look_at(np.array((0.0, 1.1, 0.3)), np.array((0.0, 1.1, -1.5)), math.radians(50.0))

    def colours(shown: dict[str, Shown]) -> np.ndarray:
        """Of the four quarters of the panel: top left, top right, bottom left, bottom right."""
        world = PlayoutWorld(1, {"panel": Pose(PLACE, np.array([0.0, 0.0, 0.0, 1.0]))})
        instant = Instant(1, (), world, {"panel": thing}, screens=shown)
        picture = np.ascontiguousarray(renderer.render_complete(instant)[::-1, :, :3]).astype(int)
        middle = PLACE[1] + 0.36 + 0.46
        places = np.array([[x, middle + y, -1.48] for y in (0.2, -0.2) for x in (-0.4, 0.4)])
        return np.array([picture[round(y), round(x)] for x, y, _ in camera.project(places, 320, 180)])

    def is_about(seen: np.ndarray, colour: tuple[int, int, int]) -> bool:
        """As bright as a page is, and of that colour."""
        return bool(np.abs(seen - 0.9 * np.array(colour)).max() < 30)

    try:
        before = colours({})
        assert all(is_about(seen, (230, 230, 230)) for seen in before)
        red, blue, green = (200, 40, 40), (40, 60, 200), (30, 160, 60)
        for number, (one, other, size) in enumerate(((red, blue, 640), (green, red, 640), (blue, green, 320)), 1):
            now = colours({"ann": Shown(number, halves(one, other, size, size * 9 // 16))})
            assert [is_about(seen, one) for seen in now] == [True, False, True, True]
            assert is_about(now[1], other)
        assert (colours({"bob": Shown(9, plain(red))}) == before).all(), "what somebody else shows is seen on their panel only"
        assert renderer.painter.error() == "GL_NO_ERROR"
    finally:
        renderer.close()
