"""An event loop whose time jumps from one timer to the next: seconds of devices, drivers and services in a fraction of one.

Ports and sockets stay real. The kernel hands bytes over a pseudo-terminal by a thread of its own, which a busy machine may
keep waiting. So what a simulated port sends is waited for; and before every jump a byte is sent through a terminal of the loop's
own, behind all that was sent before, and the loop looks once more when it is there. No result depends on how fast or how loaded the
machine is. Nothing here may wait for other threads or processes.
"""

from __future__ import annotations

import asyncio
import fcntl
import os
import selectors
import struct
import termios
import time
import tty
from collections.abc import Coroutine
from typing import Any, TypeVar
from unittest.mock import patch

from vistel.wire.simulated_loop import LoopClock
from vistel_sim.ports.pty_port import PtyPort

__all__ = ["LoopClock", "VirtualTimeLoop", "run"]

T = TypeVar("T")

START_S = 1_000.0
"""A loop's time at its beginning."""
_LOOK_S = 0.0002
_MOST_S = 5.0
"""Longer than a busy kernel takes to hand bytes over; a reader in another process may have taken them [s]."""
_HELD = 4000
"""A kernel holds about so many bytes for the reader of a port (4096 on Linux)."""


class _Selector(selectors.DefaultSelector):  # type: ignore[misc, valid-type]
    """Waits in virtual time."""

    now_s = START_S

    def __init__(self) -> None:
        super().__init__()
        self._here, self._there = os.openpty()
        tty.setraw(self._there)

    def close(self) -> None:
        os.close(self._here)
        os.close(self._there)
        super().close()

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        found = super().select(0)
        if found or (timeout is not None and timeout <= 0):
            return found
        if timeout is None:
            return super().select(None)
        os.write(self._here, b".")
        os.read(self._there, 1)
        found = super().select(_LOOK_S)
        if not found:
            self.now_s += timeout
        return found


class VirtualTimeLoop(asyncio.SelectorEventLoop):
    """See the module."""

    def __init__(self) -> None:
        self._virtual = _Selector()
        super().__init__(self._virtual)

    def time(self) -> float:
        return self._virtual.now_s


def run(main: Coroutine[Any, Any, T]) -> T:
    """As `asyncio.run`, in virtual time."""
    with patch.object(PtyPort, "_hand_over", _hand_over_and_wait), asyncio.Runner(loop_factory=VirtualTimeLoop) as runner:
        return runner.run(main)


_hand_over = PtyPort._hand_over


def _hand_over_and_wait(port: PtyPort) -> None:
    """As a port does it; then wait in real time until what it wrote can be read."""
    wanted = min(_waiting(port) + len(port._rest), _HELD)
    _hand_over(port)
    wanted -= len(port._rest)
    give_up_s = time.monotonic() + _MOST_S
    while _waiting(port) < wanted and time.monotonic() < give_up_s:
        time.sleep(0.0)  # the kernel's thread has its turn


def _waiting(port: PtyPort) -> int:
    """How many bytes a reader of this port would find."""
    return struct.unpack("i", fcntl.ioctl(port._slave, termios.FIONREAD, b"\0\0\0\0"))[0]
