"""Opens OpenGL: without a display (EGL, software or GPU), or in a desktop window that somebody else opens.

A context is current in the thread that opened it; everything here is called from that one thread.
"""

import contextlib
import ctypes
import logging
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import moderngl

from vistel.render.gl.canvas import Canvas

log = logging.getLogger("vistel.renderer")

SOFTWARE = ("llvmpipe", "softpipe", "swiftshader", "software rasterizer", "swr", "lavapipe")


class NoOpenGlError(RuntimeError):
    """This machine gives no OpenGL 3.3; the text says what to install, or to update."""


@dataclass(frozen=True)
class Capability:
    """What the machine draws with. version: of the context, e.g. 450; software: the CPU draws."""

    renderer: str
    vendor: str
    version: int
    software: bool
    window: bool


class GlWindow(Protocol):
    """Desktop windows with an OpenGL context, which is current in the thread that opened them."""

    def show(self, ctx: moderngl.Context, canvas: Canvas, over: Callable[[], None] | None = None) -> bool:
        """Show the picture in `canvas`, and what `over` draws into the first window, whose framebuffer is bound for it; False
        when a window was closed. ctx: the context that is current before and after."""
        ...

    def close(self) -> None:
        """Close them all."""
        ...


class GlContext:
    """A current context, with the desktop windows it belongs to if there are any."""

    def __init__(self, ctx: moderngl.Context, window: GlWindow | None) -> None:
        self.ctx = ctx
        self.window = window
        info = ctx.info
        renderer = str(info.get("GL_RENDERER", ""))
        software = any(word in renderer.lower() for word in SOFTWARE)
        self.capability = Capability(renderer, str(info.get("GL_VENDOR", "")), ctx.version_code, software, window is not None)
        self._finish = _gl_finish()

    def finish(self) -> None:
        """Wait until everything is drawn; other Python threads run meanwhile (moderngl's own waits hold the GIL)."""
        if self._finish is None:
            self.ctx.finish()
        else:
            self._finish()

    def close(self) -> None:
        """Give the context back, and close the windows."""
        try:
            self.ctx.release()
        finally:
            if self.window is not None:
                self.window.close()


def open_surface(open_window: Callable[[], GlWindow] | None = None) -> GlContext:
    """A context: of the windows that `open_window` opens, or headless without it and where it fails.

    Raises NoOpenGlError with one line that says what to install.
    """
    if open_window is not None:
        try:
            return _windowed(open_window)
        except Exception as e:  # a window is a comfort: whatever is in its way, the picture is drawn without
            log.warning("event=no_window reason=%r using=headless", str(e))
    return GlContext(_headless(), None)


def _headless() -> moderngl.Context:
    if not sys.platform.startswith("linux"):
        return moderngl.create_context(standalone=True, require=330)
    faults: list[Exception] = []
    without_libgl: dict[str, Any] = {"backend": "egl", "libgl": "libEGL.so.1", "libegl": "libEGL.so.1"}
    with_libgl: dict[str, Any] = {"backend": "egl"}
    for libraries in (with_libgl, without_libgl):
        try:
            return moderngl.create_context(standalone=True, require=330, **libraries)
        except Exception as e:
            faults.append(e)
    raise NoOpenGlError(f"no OpenGL 3.3 ({faults[0]}); {_mend(faults)}") from faults[0]


def _mend(faults: Sequence[Exception]) -> str:
    """What to do about OpenGL that is not there, or not new enough."""
    if any("eglCreateContext" in str(e) or "version" in str(e) for e in faults):
        return "the driver's is older: update it, or set LIBGL_ALWAYS_SOFTWARE=1 to let the CPU draw"
    return "on Debian/Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri"


def _windowed(open_window: Callable[[], GlWindow]) -> GlContext:
    _leave_egl()
    window = open_window()
    try:
        return GlContext(moderngl.create_context(require=330), window)
    except Exception:
        window.close()
        raise


def _leave_egl() -> None:
    """Make no headless context current any more, not even one that is closed: a window's beside it would end the process."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL("libEGL.so.1").eglReleaseThread()


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
