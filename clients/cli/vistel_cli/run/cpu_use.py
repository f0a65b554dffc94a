"""Processor time of each process of a conference."""

from __future__ import annotations

import time

import psutil

from vistel_services.process.supervisor import Supervisor


class CpuUse:
    """Processor time of every supervised process between `begin` and `end`."""

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        self._begin: dict[str, tuple[int, float]] = {}
        self._percent: dict[str, float] = {}
        self._since_s = 0.0

    def begin(self) -> None:
        self._since_s = time.monotonic()
        self._begin = self._seconds()

    def end(self) -> None:
        span_s = time.monotonic() - self._since_s
        for name, (pid, seconds) in self._seconds().items():
            if self._begin.get(name, (0, 0.0))[0] == pid and span_s > 0:
                self._percent[name] = round(100 * (seconds - self._begin[name][1]) / span_s, 1)

    def percent(self, name: str) -> float | None:
        """Percent of one core; None for a process that did not run the whole time."""
        return self._percent.get(name)

    def _seconds(self) -> dict[str, tuple[int, float]]:
        out: dict[str, tuple[int, float]] = {}
        for name, child in self._supervisor.children.items():
            if child.pid is None:
                continue
            try:
                times = psutil.Process(child.pid).cpu_times()
            except psutil.Error:
                continue
            out[name] = (child.pid, times.user + times.system)
        return out
