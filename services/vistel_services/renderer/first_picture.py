"""How long it takes from a renderer's start to its first picture, and what takes it: a line of the log and a metric."""

from __future__ import annotations

import logging
import os
import time

from prometheus_client import Gauge

log = logging.getLogger("vistel.renderer")

_FIRST_PICTURE = Gauge("vistel_renderer_first_picture_seconds", "From the start of the process to its first picture", ["site"])
_LOADED = time.perf_counter()


class FirstPicture:
    """Counts from the start of this process to the end of each part; parts are named when they are done."""

    def __init__(self, site: str) -> None:
        self._site = site
        self._age_s = process_age_s()
        self._began = self._since = time.perf_counter()
        self._parts = [("loading", self._age_s)]
        self.logged = False

    def done(self, part: str) -> None:
        """What took the time since the last part was done."""
        now = time.perf_counter()
        self._parts.append((part, now - self._since))
        self._since = now

    def shown(self, people: int, stand_ins: int) -> None:
        """There is a picture, of so many people; the first one is logged."""
        if self.logged:
            return
        self.logged = True
        self.done("drawing")
        seconds = self._age_s + self._since - self._began
        _FIRST_PICTURE.labels(self._site).set(seconds)
        parts = " ".join(f"{part}_s={took:.2f}" for part, took in self._parts)
        line = "event=first_picture seconds=%.2f processor_s=%.2f %s people=%d stand_ins=%d"
        log.info(line, seconds, time.process_time(), parts, people, stand_ins)


def process_age_s() -> float:
    """Since this process was started or forked [s]; where the system does not say it, since this module was loaded."""
    try:
        with open("/proc/self/stat", encoding="ascii", errors="replace") as file:
            ticks = int(file.read().rpartition(")")[2].split()[19])
        return time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError, AttributeError):
        return time.perf_counter() - _LOADED
