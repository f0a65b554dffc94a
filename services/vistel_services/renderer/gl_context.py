"""Opening OpenGL: without a display (EGL, software or GPU) or in a desktop window; and saying what was found.

A context is current in the thread that opened it; everything here is called from that one thread.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import logging
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import moderngl

log = logging.getLogger("vistel.renderer")

SOFTWARE = ("llvmpipe", "softpipe", "swiftshader", "software rasterizer", "swr", "lavapipe")


class NoOpenGlError(RuntimeError):
    """This machine gives no OpenGL 3.3; the text says what to install."""


@dataclass(frozen=True)
class Capability:
    """What the machine draws with. version: of the context, e.g. 450; software: the CPU draws."""

    renderer: str
    vendor: str
    version: int
    software: bool
    window: bool


class Surface:
    """A current context, with the desktop window it belongs to if there is one."""

    def __init__(self, ctx: moderngl.Context, window: Any | None) -> None:
        self.ctx = ctx
        self.window = window
        info = ctx.info
        renderer = str(info.get("GL_RENDERER", ""))
        software = any(word in renderer.lower() for word in SOFTWARE)
        self.capability = Capability(
            renderer, str(info.get("GL_VENDOR", "")), ctx.version_code, software, window is not None
        )
        self._finish = _gl_finish()

    def finish(self) -> None:
        """Wait until everything is drawn; other Python threads run meanwhile (moderngl's own waits hold the GIL)."""
        if self._finish is None:
            self.ctx.finish()
        else:
            self._finish()

    def show(self) -> bool:
        """Put the drawn picture on the window and take its events; False when the user closed it."""
        if self.window is None:
            return True
        import glfw  # noqa: PLC0415  (needs a display's libraries; absent on servers)

        glfw.swap_buffers(self.window)
        glfw.poll_events()
        return not glfw.window_should_close(self.window)

    def window_size(self) -> tuple[int, int]:
        """Of the window's picture in pixels; (0, 0) while minimised or without a window."""
        if self.window is None:
            return (0, 0)
        import glfw  # noqa: PLC0415

        return glfw.get_framebuffer_size(self.window)

    def close(self) -> None:
        self.ctx.release()
        if self.window is not None:
            import glfw  # noqa: PLC0415

            glfw.destroy_window(self.window)
            glfw.terminate()


def open_surface(width: int, height: int, window: bool = False, title: str = "VISTEL") -> Surface:
    """A context; in a window of `width` x `height` when asked for and a display is there, else headless.

    Raises NoOpenGlError with one line that says what to install.
    """
    if window:
        try:
            return _windowed(width, height, title)
        except Exception as e:  # a window is a comfort: whatever is in its way, the picture is drawn without
            log.warning("event=no_window reason=%r using=headless", str(e))
    return Surface(_headless(), None)


def _headless() -> moderngl.Context:
    if not sys.platform.startswith("linux"):
        return moderngl.create_context(standalone=True, require=330)
    first: Exception | None = None
    without_libgl: dict[str, Any] = {"backend": "egl", "libgl": "libEGL.so.1", "libegl": "libEGL.so.1"}
    with_libgl: dict[str, Any] = {"backend": "egl"}
    for libraries in (with_libgl, without_libgl):
        try:
            return moderngl.create_context(standalone=True, require=330, **libraries)
        except Exception as e:
            first = first or e
    raise NoOpenGlError(
        f"no OpenGL 3.3 ({first}); on Debian/Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri"
    ) from first


def _windowed(width: int, height: int, title: str) -> Surface:
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise RuntimeError("no display (DISPLAY and WAYLAND_DISPLAY are unset)")
    import glfw  # noqa: PLC0415

    if not glfw.init():
        raise RuntimeError("glfw found no usable display")
    for hint, value in (
        (glfw.CONTEXT_VERSION_MAJOR, 3), (glfw.CONTEXT_VERSION_MINOR, 3),
        (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE), (glfw.OPENGL_FORWARD_COMPAT, True),
    ):  # fmt: skip
        glfw.window_hint(hint, value)
    window = glfw.create_window(width, height, title, None, None)
    if not window:
        glfw.terminate()
        raise RuntimeError("glfw could not open a window with OpenGL 3.3")
    glfw.make_context_current(window)
    glfw.swap_interval(0)
    return Surface(moderngl.create_context(require=330), window)


def _gl_finish() -> Callable[[], None] | None:
    """glFinish called through ctypes, which lets go of the GIL."""
    names = {"win32": ("opengl32",), "darwin": ("/System/Library/Frameworks/OpenGL.framework/OpenGL",)}
    for name in names.get(sys.platform, ("libGL.so.1", "libOpenGL.so.0", "libGLdispatch.so.0")):
        try:
            finish = ctypes.CDLL(name).glFinish
        except (OSError, AttributeError):
            continue
        finish.restype, finish.argtypes = None, []
        return finish
    return None
