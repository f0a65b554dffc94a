"""Pictures on the graphics side: what OpenGL does not take whole is made smaller."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from vistel.render.gl.context import open_surface
from vistel.render.gl.textures import texture_of

pytestmark = pytest.mark.gl


@pytest.mark.parametrize(("height", "width"), [(1, 1), (3, 5), (64, 64)])
def test_pictures_of_any_size_keep_it(height: int, width: int) -> None:
    surface = open_surface()
    try:
        assert texture_of(surface.ctx, np.zeros((height, width, 3), np.uint8), True).size == (width, height)
    finally:
        surface.close()


def test_one_wider_than_opengl_takes_is_reduced_with_a_line(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    surface = open_surface()
    try:
        takes = int(surface.ctx.info["GL_MAX_TEXTURE_SIZE"])
        wide = np.zeros((2, takes + 1, 3), np.uint8)
        wide[:, takes // 2 :] = 200
        texture = texture_of(surface.ctx, wide, True, 4 * takes)
        assert max(texture.size) <= takes
        assert surface.ctx.error == "GL_NO_ERROR"
        assert "event=picture_reduced" in caplog.text
        row = np.frombuffer(texture.read(alignment=1), np.uint8).reshape(texture.size[1], texture.size[0], -1)[0, :, 0]
        assert row[0] == 0 and row[-1] == 200
    finally:
        surface.close()
