"""The renderer's desktop windows: opening and placing them, their keys and mouse, telling when one is closed.

Everything here is called from the thread that draws.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from vistel.render.gl.raw_gl import RawGl
from vistel.render.interaction.events import Button, Event, FocusLost, Key, Pointer, Text, Wheel
from vistel.render.view.screens import Box

log = logging.getLogger("vistel.renderer")

_NAMED = {
    "SPACE": "space",
    "ESCAPE": "escape",
    "ENTER": "enter",
    "TAB": "tab",
    "BACKSPACE": "backspace",
    "DELETE": "delete",
    "LEFT": "left",
    "RIGHT": "right",
    "UP": "up",
    "DOWN": "down",
    "HOME": "home",
    "END": "end",
    "LEFT_SHIFT": "shift",
    "RIGHT_SHIFT": "shift",
    "LEFT_CONTROL": "control",
    "RIGHT_CONTROL": "control",
}


class NoWindowError(RuntimeError):
    """No window can be opened here; the text says why."""


@dataclass(frozen=True)
class Pane:
    """A window that is wanted. monitor: part of the name of the one it fills, or its number from 0; empty: an ordinary window.
    at: its upper left corner on the desktop [pixels]; part: what of the picture it shows, None for all."""

    title: str
    width: int
    height: int
    monitor: str = ""
    at: tuple[int, int] | None = None
    part: Box | None = None


class Window:
    """The windows of one renderer: the first one's context draws, the others' share its textures."""

    def __init__(self, panes: Sequence[Pane], eyes_apart: bool = False) -> None:
        """eyes_apart: the picture holds two eyes' side by side, of full width each; where the driver can, each gets its own
        buffer. Raises NoWindowError."""
        if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise NoWindowError("no display (DISPLAY and WAYLAND_DISPLAY are unset)")
        import glfw  # noqa: PLC0415  (needs a display's libraries; absent on servers)

        self._glfw = glfw
        if not glfw.init():
            raise NoWindowError("glfw found no usable display")
        self._panes = list(panes)
        self._handles: list[Any] = []
        self._bare: list[RawGl] = []
        self._events: list[Event] = []
        self._at: dict[int, tuple[float, float]] = {}
        self.eyes_apart = eyes_apart
        self.stereo = False
        """Whether each eye has a buffer of its own."""
        try:
            self._open(eyes_apart)
        except Exception:
            self.close()
            raise
        for handle in self._handles:
            glfw.make_context_current(handle)
            glfw.swap_interval(0)
            self._bare.append(RawGl(glfw.get_proc_address))
        glfw.make_context_current(self._handles[0])
        for number, handle in enumerate(self._handles):
            self._listen(number, handle)

    def _open(self, eyes_apart: bool) -> None:
        for number, pane in enumerate(self._panes):
            handle = self._one(pane, number, eyes_apart and (number == 0 or self.stereo))
            if handle and number == 0:
                self.stereo = eyes_apart
            if not handle and eyes_apart and number == 0:
                log.warning("event=no_stereo_buffers reason='the driver offers no quad-buffered stereo' using=side_by_side")
                handle = self._one(pane, number, False)
            if not handle:
                raise NoWindowError(f"no window with OpenGL 3.3 could be opened ({pane.title})")
            self._handles.append(handle)

    def _one(self, pane: Pane, number: int, stereo: bool) -> Any:
        glfw = self._glfw
        glfw.default_window_hints()
        monitor = self._monitor(pane)
        for hint, value in (
            (glfw.CONTEXT_VERSION_MAJOR, 3),
            (glfw.CONTEXT_VERSION_MINOR, 3),
            (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
            (glfw.OPENGL_FORWARD_COMPAT, True),
            (glfw.STEREO, stereo),
            (glfw.DECORATED, monitor is None),
            (glfw.AUTO_ICONIFY, False),
            (glfw.FOCUS_ON_SHOW, number == 0),
            (glfw.SAMPLES, 0),
            (glfw.DEPTH_BITS, 0),
        ):
            glfw.window_hint(hint, value)
        width, height, at = pane.width, pane.height, pane.at
        if monitor is not None:
            at = glfw.get_monitor_pos(monitor)
            mode = glfw.get_video_mode(monitor).size
            width, height = mode.width, mode.height
        handle = glfw.create_window(width, height, pane.title, None, self._handles[0] if self._handles else None)
        if handle and at is not None:
            glfw.set_window_pos(handle, *at)
        return handle

    def _monitor(self, pane: Pane) -> Any | None:
        """The one it is to fill; None, and a line, where there is none of that name."""
        if not pane.monitor:
            return None
        glfw = self._glfw
        found = list(glfw.get_monitors())
        names = [_text(glfw.get_monitor_name(m)) for m in found]
        chosen = chosen_monitor(pane.monitor, names)
        if chosen is None:
            log.warning("event=no_monitor wanted=%r there_are=%r using=window", pane.monitor, names)
            return None
        return found[chosen]

    def _listen(self, number: int, handle: Any) -> None:
        glfw = self._glfw
        glfw.set_key_callback(handle, self._key)
        glfw.set_char_callback(handle, lambda _, code: self._events.append(Text(chr(code))))
        glfw.set_mouse_button_callback(handle, partial(self._button, number))
        glfw.set_cursor_pos_callback(handle, partial(self._moved, number))
        glfw.set_scroll_callback(handle, lambda _, across, up: self._events.append(Wheel(up, across)))
        glfw.set_window_focus_callback(handle, self._focus)

    def _key(self, _handle: Any, code: int, _scan: int, action: int, _mods: int) -> None:
        name = self._name(code)
        if name and action != self._glfw.REPEAT:
            self._events.append(Key(name, action == self._glfw.PRESS))

    def _name(self, code: int) -> str:
        if 33 <= code <= 96:
            return chr(code).lower()
        glfw = self._glfw
        if glfw.KEY_F1 <= code <= glfw.KEY_F12:
            return f"f{code - glfw.KEY_F1 + 1}"
        return next((name for key, name in _NAMED.items() if getattr(glfw, f"KEY_{key}") == code), "")

    def _button(self, number: int, handle: Any, button: int, action: int, _mods: int) -> None:
        # Where the mouse was then, not where it is by now: events wait while a picture is drawn.
        x, y = self._at.get(number) or self._in_pixels(handle, *self._glfw.get_cursor_pos(handle))
        self._events.append(Button(button, action == self._glfw.PRESS, x, y, number))

    def _moved(self, number: int, handle: Any, x: float, y: float) -> None:
        self._at[number] = self._in_pixels(handle, x, y)
        self._events.append(Pointer(*self._at[number], number))

    def _focus(self, _handle: Any, focused: int) -> None:
        if not focused:
            self._events.append(FocusLost())

    def _in_pixels(self, handle: Any, x: float, y: float) -> tuple[float, float]:
        """Window systems that scale count positions in larger units."""
        (width, height), (across, up) = self._glfw.get_window_size(handle), self._glfw.get_framebuffer_size(handle)
        return x * across / max(1, width), y * up / max(1, height)

    # -- for who draws -------------------------------------------------------------------------------------------

    def parts(self, size: tuple[int, int]) -> list[Box]:
        """What each window shows of a picture of `size`, which may be drawn smaller than it was meant."""
        whole: Box = (0, 0, *size)
        wanted = [pane.part for pane in self._panes]
        right = max((p[0] + p[2] for p in wanted if p), default=size[0])
        top = max((p[1] + p[3] for p in wanted if p), default=size[1])

        def scaled(p: Box) -> Box:
            across, up = size[0] / right, size[1] / top
            x, y = round(p[0] * across), round(p[1] * up)
            return x, y, min(round(p[2] * across), size[0] - x), min(round(p[3] * up), size[1] - y)

        return [scaled(part) if part else whole for part in wanted]

    def size(self, number: int = 0) -> tuple[int, int]:
        """Of a window's picture in pixels; a 0 in it while it is minimised."""
        if self._glfw.get_window_attrib(self._handles[number], self._glfw.ICONIFIED):
            return 0, 0
        width, height = self._glfw.get_framebuffer_size(self._handles[number])
        return width, height

    def enter(self, number: int) -> None:
        """Calls of OpenGL go to this window's context from now on."""
        self._glfw.make_context_current(self._handles[number])

    def gl(self, number: int) -> RawGl:
        """OpenGL of a window's context."""
        return self._bare[number]

    def turn(self) -> bool:
        """Show what was drawn, the first window's context being current then, and take events; False when one was closed."""
        glfw = self._glfw
        for handle in reversed(self._handles):
            glfw.make_context_current(handle)
            glfw.swap_buffers(handle)
        glfw.poll_events()
        return not any(glfw.window_should_close(handle) for handle in self._handles)

    def events(self) -> list[Event]:
        """What keyboard and mouse did since the last call."""
        out, self._events = self._events, []
        return out

    def title(self, text: str) -> None:
        """What stands over the first window."""
        self._glfw.set_window_title(self._handles[0], text)

    def close(self) -> None:
        """Close them all."""
        for handle in reversed(self._handles):
            self._glfw.destroy_window(handle)
        self._handles.clear()
        self._glfw.terminate()


def chosen_monitor(wanted: str, names: Sequence[str]) -> int | None:
    """Which of the monitors of these `names` is meant by a whole name, a number from 0, or part of a name; in this order, for DP-1
    is part of eDP-1. None: none of them."""
    lower = [name.lower() for name in names]
    if wanted.lower() in lower:
        return lower.index(wanted.lower())
    if wanted.isascii() and wanted.isdigit() and int(wanted) < len(names):
        return int(wanted)
    return next((n for n, name in enumerate(lower) if wanted.lower() in name), None)


def _text(name: Any) -> str:
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
