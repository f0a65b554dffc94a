"""Opening OpenGL: what is said when it, or a display, is not there."""

from __future__ import annotations

import logging
import os
import subprocess
import sys

import moderngl
import pytest

from vistel.render.gl.context import GlContext, NoOpenGlError, open_surface
from vistel.render.painter import Painter
from vistel_services.renderer.window.presenter import opener
from vistel_services.renderer.window.window import Pane


def test_without_opengl_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(**_: object) -> None:
        raise RuntimeError("libEGL.so not loaded")

    monkeypatch.setattr(moderngl, "create_context", fails)
    with pytest.raises(NoOpenGlError, match=r"libEGL\.so not loaded.*apt-get install|no OpenGL 3\.3") as e:
        open_surface()
    assert "\n" not in str(e.value)


@pytest.mark.gl
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="displays are found by these variables on Linux only")
def test_a_window_without_a_display_becomes_a_headless_picture_and_says_so(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with caplog.at_level(logging.WARNING):
        surface = open_surface(opener([Pane("w", 64, 64)]))
    try:
        assert not surface.capability.window
        assert surface.capability.version >= 330
        assert surface.capability.renderer
        lines = [r.message for r in caplog.records if "no_window" in r.message]
        assert len(lines) == 1
        assert "DISPLAY" in lines[0]
        assert Painter(surface, 64, 64).show()
    finally:
        surface.close()


_OPEN = (
    "from vistel.render.gl.context import NoOpenGlError, open_surface\n"
    "try:\n    open_surface()\n    print('opened')\nexcept NoOpenGlError as e:\n    print(e)"
)


@pytest.mark.gl
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="EGL is asked for on Linux")
@pytest.mark.parametrize(
    ("setting", "value", "said", "mend"),
    [
        ("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json", "no OpenGL 3.3 (", "apt-get install libegl1"),
        ("MESA_GL_VERSION_OVERRIDE", "2.1", "no OpenGL 3.3 (", "update it, or set LIBGL_ALWAYS_SOFTWARE=1"),
    ],
)
def test_a_machine_without_egl_and_one_with_an_old_opengl_say_in_one_line_what_to_do(
    surface: GlContext, setting: str, value: str, said: str, mend: str
) -> None:
    """Real drivers: one that finds no library of a vendor, one that gives what there was in 2006."""
    there = os.environ | {setting: value, "LIBGL_ALWAYS_SOFTWARE": "1"}
    done = subprocess.run([sys.executable, "-c", _OPEN], capture_output=True, text=True, check=False, timeout=600, env=there)
    (line,) = done.stdout.strip().splitlines() or [done.stderr]
    if line == "opened":
        pytest.skip(f"this driver does not listen to {setting}")
    assert line.startswith(said) and mend in line
