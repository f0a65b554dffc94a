"""What several tests of pictures draw with."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from vistel.render.gl.context import GlContext


@pytest.fixture(scope="module")
def surface() -> Iterator[GlContext]:
    """Whatever OpenGL this machine has, without a window."""
    from vistel.render.gl.context import NoOpenGlError, open_surface

    try:
        opened = open_surface()
    except NoOpenGlError as e:
        pytest.skip(str(e))
    yield opened
    opened.close()
