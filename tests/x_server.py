"""An X server of a test's own (Xvfb), and somebody at its keyboard and mouse, whose doings are real X events."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest


class Hands:
    """Somebody at a keyboard and mouse of an X server."""

    def __init__(self, display: str) -> None:
        from Xlib import XK, X
        from Xlib.display import Display
        from Xlib.ext import xtest

        self._x, self._xk, self._xtest, self._display = X, XK, xtest, Display(display)

    def _send(self, kind: int, detail: int = 0, **at: int) -> None:
        self._xtest.fake_input(self._display, kind, detail, **at)
        self._display.sync()

    def move(self, x: float, y: float) -> None:
        self._send(self._x.MotionNotify, x=round(x), y=round(y))

    def button(self, number: int, down: bool) -> None:
        self._send(self._x.ButtonPress if down else self._x.ButtonRelease, number)

    def key(self, name: str, down: bool) -> None:
        code = self._display.keysym_to_keycode(self._xk.string_to_keysym(name))
        self._send(self._x.KeyPress if down else self._x.KeyRelease, code)

    def wheel(self, notches: int) -> None:
        for _ in range(abs(notches)):
            self.button(4 if notches > 0 else 5, True)
            self.button(4 if notches > 0 else 5, False)

    def screen(self) -> np.ndarray:
        """(h, w, 3) what is on the whole screen."""
        root = self._display.screen().root
        size = root.get_geometry()
        data = root.get_image(0, 0, size.width, size.height, self._x.ZPixmap, 0xFFFFFFFF).data
        return np.frombuffer(data, np.uint8).reshape(size.height, size.width, 4)[..., 2::-1].astype(int)

    def close(self) -> None:
        self._display.close()


@contextmanager
def x_server(monkeypatch: pytest.MonkeyPatch, width: int, height: int) -> Iterator[Hands]:
    """A server with one screen, which DISPLAY names; skips, with the reason, where there can be none."""
    pytest.importorskip("Xlib", reason="python-xlib sends the X events")
    if shutil.which("Xvfb") is None:
        pytest.skip("there is no Xvfb: apt-get install xvfb")
    read, write = os.pipe()
    arguments = ["-displayfd", str(write), "-screen", "0", f"{width}x{height}x24", "-nolisten", "tcp", "-noreset"]
    with subprocess.Popen(["Xvfb", *arguments], pass_fds=[write], stderr=subprocess.DEVNULL) as server:
        os.close(write)
        with os.fdopen(read) as said:
            number = said.readline().strip()
        try:
            if not number:
                pytest.skip("Xvfb does not start here")
            monkeypatch.setenv("DISPLAY", f":{number}")
            monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
            somebody = Hands(f":{number}")
            yield somebody
            somebody.close()
        finally:
            server.terminate()
