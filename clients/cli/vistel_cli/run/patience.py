"""How long `vistel up` waits for parts of a conference that do not come. On a machine that is busy with other work all takes
longer: time in which the processes wanted to run and could not counts for less."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterable
from pathlib import Path

PROC = Path("/proc")
LEAST = 0.25
"""As how much time counts at least, however busy the machine is: a wait has an end."""
BUSY = 0.5
"""The machine is called busy when the processes get less than this share of the time that they want."""
_EVERY_S = 1.0


class Patience:
    """Call `look` often while parts are awaited, and `progress` when one has come."""

    def __init__(self, pids: Callable[[], Iterable[int]], proc: Path = PROC) -> None:
        """pids: of the processes that run now; proc: where Linux tells of them."""
        self._pids, self._proc = pids, proc
        self._before = self._times()
        self._looked = self._since = time.monotonic()
        self.share = 1.0
        """Of the time that the processes wanted to run, how much they did lately; 1 where the system does not tell."""
        self.counted_s = 0.0
        """Of the time since the last progress, as much as counts."""

    def progress(self) -> None:
        """Something has come: the wait begins anew."""
        self.counted_s, self._since = 0.0, time.monotonic()

    @property
    def waited_s(self) -> float:
        """Since the last progress."""
        return time.monotonic() - self._since

    def look(self, *, starting: bool) -> None:
        """starting: a process that is awaited has not said anything yet; else all time counts."""
        now = time.monotonic()
        took = now - self._looked
        if took < _EVERY_S:
            return
        self._looked, times = now, self._times()
        both = [(self._before[pid], after) for pid, after in times.items() if pid in self._before]
        ran, queued = (sum(after[k] - before[k] for before, after in both) for k in (0, 1))
        self._before = times
        self.share = ran / (ran + queued) if ran + queued > 0 else 1.0
        self.counted_s += took * (max(LEAST, self.share) if starting else 1.0)

    @property
    def busy(self) -> str:
        """What is said of the machine; empty where there is nothing to say."""
        if self.share >= BUSY:
            return ""
        return f"the machine is busy: the processes get {self.share:.0%} of the processor time that they want"

    def _times(self) -> dict[int, tuple[int, int]]:
        """How long the main thread of each process has run, and has waited for a processor [ns]."""
        out: dict[int, tuple[int, int]] = {}
        for pid in self._pids():
            with contextlib.suppress(OSError, ValueError):
                ran, queued, _ = (self._proc / str(pid) / "schedstat").read_text().split()
                out[pid] = int(ran), int(queued)
        return out
