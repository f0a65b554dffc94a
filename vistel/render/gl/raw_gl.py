"""The few OpenGL calls that go to a context other than moderngl's: windows beside the first one, and stereo's back buffers.

Two moderngl contexts in one thread take one another's objects for their own. So there is one; windows beside it have a
context of their own that shares its textures and is drawn into by these calls only.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

from vistel.render.view.screens import Box

# Names of OpenGL.
BACK = 0x0405
BACK_LEFT = 0x0402
BACK_RIGHT = 0x0403
_FRAMEBUFFER = 0x8D40
_READ = 0x8CA8
_COLOUR_0 = 0x8CE0
_TEXTURE_2D = 0x0DE1
_COLOUR_BIT = 0x4000
_LINEAR = 0x2601
_SCISSOR_TEST = 0x0C11

_INT = ctypes.c_int
_UINT = ctypes.c_uint
_FLOAT = ctypes.c_float
_POINTER = ctypes.c_void_p
_ARGUMENTS: dict[str, tuple[Any, ...]] = {
    "glGenFramebuffers": (_INT, _POINTER),
    "glDeleteFramebuffers": (_INT, _POINTER),
    "glBindFramebuffer": (_UINT, _UINT),
    "glFramebufferTexture2D": (_UINT, _UINT, _UINT, _UINT, _INT),
    "glBlitFramebuffer": (_INT,) * 8 + (_UINT, _UINT),
    "glDrawBuffer": (_UINT,),
    "glClearColor": (_FLOAT,) * 4,
    "glClear": (_UINT,),
    "glDisable": (_UINT,),
    "glColorMask": (ctypes.c_ubyte,) * 4,
}
_PROTOTYPE: Any = getattr(ctypes, "WINFUNCTYPE", ctypes.CFUNCTYPE)


class RawGl:
    """OpenGL of the context that is current while this is made; address: of a function of OpenGL by its name, or 0."""

    def __init__(self, address: Callable[[str], Any]) -> None:
        self._call: dict[str, Callable[..., None]] = {}
        for name, arguments in _ARGUMENTS.items():
            found = address(name)
            if not found:
                raise RuntimeError(f"OpenGL has no {name}")
            self._call[name] = _PROTOTYPE(None, *arguments)(found)
        made = ctypes.c_uint(0)
        self._call["glGenFramebuffers"](1, ctypes.addressof(made))
        self._source = made.value

    def show(self, texture: int, part: Box, into: Box, buffer: int = BACK, clear: bool = True) -> None:
        """Put part of a texture into part of the window's `buffer`, stretched; black round it with `clear`. Both: left,
        bottom, width, height in pixels."""
        gl = self._call
        gl["glBindFramebuffer"](_FRAMEBUFFER, 0)
        gl["glDrawBuffer"](buffer)
        gl["glDisable"](_SCISSOR_TEST)
        gl["glColorMask"](1, 1, 1, 1)
        if clear:
            gl["glClearColor"](0.0, 0.0, 0.0, 1.0)
            gl["glClear"](_COLOUR_BIT)
        gl["glBindFramebuffer"](_READ, self._source)
        gl["glFramebufferTexture2D"](_READ, _COLOUR_0, _TEXTURE_2D, texture, 0)
        (x, y, w, h), (left, bottom, width, height) = part, into
        gl["glBlitFramebuffer"](x, y, x + w, y + h, left, bottom, left + width, bottom + height, _COLOUR_BIT, _LINEAR)
        gl["glFramebufferTexture2D"](_READ, _COLOUR_0, _TEXTURE_2D, 0, 0)
        gl["glDrawBuffer"](BACK)
        gl["glBindFramebuffer"](_FRAMEBUFFER, 0)
