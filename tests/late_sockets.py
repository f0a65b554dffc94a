"""What comes to an event loop comes late at random: a busy machine, made at will, to find tests and code that count on an order.

    make races SEED=1
    VISTEL_LATE=1 pytest FILES

Each socket, pipe and call from a thread is quick, slow or very slow for as long as it is open, and now and then the whole loop
stands still. Within one socket nothing changes its order. What fails or hangs so may fail on any machine. Loops in virtual time
and other processes are as ever.
"""

from __future__ import annotations

import asyncio.selector_events
import os
import random
import selectors
import time
from typing import Any

SEED = os.environ.get("VISTEL_LATE")

QUICK, SLOW, VERY_SLOW = (0.0, 0.002), (0.02, 0.06), (0.2, 0.6)
"""How late, least and most [s]."""
WEIGHTS = (14, 4, 2)
"""How many of twenty are of which kind."""
STANDS_STILL, STILL_S = 0.003, 0.4
"""How often the loop does, as a share of its rounds, and at most how long [s]."""
_LOOK_S = 0.001


class LateSelector(selectors.DefaultSelector):  # type: ignore[misc, valid-type]
    """Tells each event once its time has come."""

    def __init__(self) -> None:
        super().__init__()
        self._random = random.Random(SEED)
        self._kinds: dict[int, tuple[float, float]] = {}
        self._due_s: dict[int, float] = {}

    def unregister(self, fileobj: Any) -> selectors.SelectorKey:
        """A number may come back as another socket."""
        key = super().unregister(fileobj)
        self._kinds.pop(key.fd, None)
        self._due_s.pop(key.fd, None)
        return key

    def _due(self, fd: int, now_s: float) -> float:
        if fd not in self._due_s:
            if fd not in self._kinds:
                self._kinds[fd] = self._random.choices((QUICK, SLOW, VERY_SLOW), WEIGHTS)[0]
            self._due_s[fd] = now_s + self._random.uniform(*self._kinds[fd])
        return self._due_s[fd]

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if self._random.random() < STANDS_STILL:
            time.sleep(self._random.uniform(0.0, STILL_S))
        end_s = float("inf") if timeout is None else time.monotonic() + max(timeout, 0.0)
        while True:
            found = super().select(max(0.0, end_s - time.monotonic()) if end_s < float("inf") else None)
            now_s = time.monotonic()
            dues = [(self._due(key.fd, now_s), key, mask) for key, mask in found]
            told = [(key, mask) for due_s, key, mask in dues if due_s <= now_s]
            if told or now_s >= end_s:
                for key, _ in told:
                    del self._due_s[key.fd]
                return told
            time.sleep(min(_LOOK_S, max(0.0, end_s - now_s)))


def pytest_configure() -> None:
    """Every event loop of real time is late from now on."""
    if SEED is None:
        return
    real = asyncio.selector_events.BaseSelectorEventLoop.__init__

    def late(self: Any, selector: selectors.BaseSelector | None = None) -> None:
        real(self, selector or LateSelector())

    asyncio.selector_events.BaseSelectorEventLoop.__init__ = late  # type: ignore[method-assign]
