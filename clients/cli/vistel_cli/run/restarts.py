"""Says of processes that have ended that they are started again, and when they are back."""

from __future__ import annotations

import asyncio
import signal
import time
from collections.abc import Callable
from pathlib import Path

from vistel.wire import alive
from vistel_cli.run.logged_errors import last_line
from vistel_cli.terminal import USAGE
from vistel_services.process.supervisor import Supervisor

_LOOK_S = 0.25


class Restarts:
    """Of a supervisor's processes. tell: says a line; now_s: of a clock that never goes back."""

    def __init__(self, supervisor: Supervisor, tell: Callable[[str], object], now_s: Callable[[], float] = time.monotonic) -> None:
        self._supervisor, self._tell, self._now_s = supervisor, tell, now_s
        self._away: dict[str, tuple[int, float]] = {}
        supervisor.on_exit = self._ended

    def _ended(self, name: str, code: int) -> None:
        file = self._supervisor.children[name].spec.alive
        if file is not None:
            since_s = self._away[name][1] if name in self._away else self._now_s()
            self._away[name] = alive.last(file), since_s
        self._tell(ended(name, code, self._supervisor.log_file(name)))

    async def watch(self) -> None:
        """Look again and again, until cancelled."""
        while True:
            self.look()
            await asyncio.sleep(_LOOK_S)

    def look(self) -> None:
        """Say who is back since the last look: who gives signs of life again."""
        for name, (before, since_s) in list(self._away.items()):
            file = self._supervisor.children[name].spec.alive
            if file is not None and alive.last(file) != before:
                del self._away[name]
                self._tell(f"{name} is back, after {self._now_s() - since_s:.1f} s")


def ended(name: str, code: int, log: Path) -> str:
    """What is said of a process that has ended, with its last words where these say what it cannot use."""
    if code == -signal.SIGABRT:
        return f"{name} hung, and was ended; starting it again"
    why = f": {last_line(log)}" if code == USAGE else ""
    return f"{name} ended ({signal.Signals(-code).name if code < 0 else code}){why}; starting it again"
