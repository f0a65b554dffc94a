"""Renderers of one machine that draw in software take turns.

Three that draw at once on two cores each take half as long again, and each shows motion as old as that. With no more at once than
there are cores they draw nearly as many pictures, each in little more than the time it takes alone: who waits for their turn
samples motion when it has come.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from vistel.wire.clock import Clock, sleep

if sys.platform != "win32":
    import fcntl

LOOK_S = 0.001
"""From one look whether it is one's turn to the next [s]."""
NEWCOMER_S = 3.0 * LOOK_S
"""The first of those waits takes so long: who has just drawn comes after all who wait already [s]."""
LONGEST_WAIT_NS = 100_000_000
"""Nobody waits longer: who draws hangs, or gets no core because of other programs [ns]."""


def places_here() -> int:
    """How many pictures this machine draws at once. One for every two cores would show motion sooner still, and a third fewer
    pictures."""
    return os.cpu_count() or 1


class DrawingTurn:
    """One renderer's turn. Locks of files say whose it is, so a process that dies gives it back."""

    def __init__(self, folder: Path, places: int) -> None:
        """folder: the same for all who take turns; where it cannot be written, nobody waits. places: for so many at once."""
        self._next: int | None = None
        self._places: list[int] = []
        self._held: int | None = None
        if sys.platform == "win32":
            return
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._next, *self._places = (
                os.open(folder / name, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
                for name in ("drawing-next", *(f"drawing-{k}" for k in range(places)))
            )
        except OSError:
            self._next = None

    async def begin(self, clock: Clock) -> None:
        """Wait for the turn. Who has just drawn cannot overtake who is next."""
        if self._next is None:
            return
        until_ns = clock.steady_ns() + LONGEST_WAIT_NS
        first = await _one_locked([self._next], clock, until_ns)
        try:
            self._held = await _one_locked(self._places, clock, until_ns)
        finally:
            if first is not None:
                _unlock(first)

    def end(self) -> None:
        """The picture is drawn."""
        if self._held is not None:
            _unlock(self._held)
            self._held = None

    def close(self) -> None:
        """Take no more turns."""
        for handle in (*([] if self._next is None else [self._next]), *self._places):
            os.close(handle)
        self._next, self._places, self._held = None, [], None


async def _one_locked(handles: Sequence[int], clock: Clock, until_ns: int) -> int | None:
    """One of the files, locked; None where none was free until then."""
    pause_s = NEWCOMER_S
    while True:
        for handle in handles:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return handle
            except OSError:
                continue
        if clock.steady_ns() >= until_ns:
            return None
        await sleep(clock, pause_s)
        pause_s = LOOK_S


def _unlock(handle: int) -> None:
    fcntl.flock(handle, fcntl.LOCK_UN)
