"""What several tests of pictures draw with."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from vistel_services.renderer.gl_context import NoOpenGlError, Surface, open_surface


@pytest.fixture(scope="module")
def surface() -> Iterator[Surface]:
    """Whatever OpenGL this machine has, without a window."""
    try:
        opened = open_surface(16, 16)
    except NoOpenGlError as e:
        pytest.skip(str(e))
    yield opened
    opened.close()
