"""How a run is told to end: in good order by Ctrl-C or SIGTERM, at once by a second Ctrl-C."""

from __future__ import annotations

import asyncio
import signal

APART_S = 1.0
"""A second Ctrl-C sooner than this is the first one again: `make` and others pass on what the terminal sent already [s]."""
ENDING = "ending films and log; Ctrl-C again leaves them as they are"
"""What is said meanwhile."""


class Stopping:
    """Takes the signals of this process. Make it on the event loop."""

    def __init__(self) -> None:
        self.asked = asyncio.Event()
        self.at_once = asyncio.Event()
        """Films and logs are not waited for."""
        self._loop = asyncio.get_running_loop()
        self._asked_s = 0.0
        self._loop.add_signal_handler(signal.SIGINT, self._interrupt)
        self._loop.add_signal_handler(signal.SIGTERM, self.asked.set)

    def _interrupt(self) -> None:
        now_s = self._loop.time()
        if not self.asked.is_set():
            self._asked_s = now_s
            self.asked.set()
        elif now_s - self._asked_s >= APART_S:
            self.at_once.set()
