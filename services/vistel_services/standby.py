"""A process that has everything loaded and waits to take over from any process of its conference that dies.

python -m vistel_services.standby CONFERENCE.toml --run RUN --out OUT world renderer

Loading is most of what a start costs: the compiler's modules, compiled kernels, people, the room. Says "ready" on
standard output when done and waits on standard input, which costs no processor time, for one line of JSON:
{"log": FILE, "arguments": [what vistel_services.host takes]}. From then on it is that process and writes to that
log. When the input ends instead, because the supervisor is gone or wants it no more, it ends too.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import gc
import importlib
import json
import logging
import os
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from vistel.conference.files import ConferenceError, load
from vistel.conference.model import Conference
from vistel_services import host, logs
from vistel_services.reserve import READY

log = logging.getLogger("vistel.standby")


class _Loading(threading.Thread):
    """Loads in a thread of its own, because on Linux a priority belongs to a thread: without privileges a lowered one
    could not be raised again, so the low one ends with this thread and the main thread keeps the normal one."""

    def __init__(self, conference: Conference, services: Sequence[str]) -> None:
        super().__init__(name="loading")
        self._conference, self._services = conference, services
        self.error: Exception | None = None

    def run(self) -> None:
        if sys.platform == "linux":
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), host.DRAWING_PRIORITY)
        try:
            for name in self._services:
                started = time.perf_counter()
                service = importlib.import_module(f"vistel_services.{name}")
                imported = time.perf_counter()
                if hasattr(service, "preload"):
                    service.preload(self._conference)
                log.info("loaded service=%s imports_ms=%.0f preload_ms=%.0f",
                         name, (imported - started) * 1e3, (time.perf_counter() - imported) * 1e3)  # fmt: skip
        except Exception as e:
            self.error = e


def _voice() -> int:
    """The pipe to the supervisor; what libraries print goes where the log goes."""
    pipe = os.dup(1)
    os.dup2(2, 1)
    return pipe


def _wait(voice: int) -> dict[str, Any] | None:
    """The order, or None when there will be none."""
    os.write(voice, READY)
    os.close(voice)
    line = sys.stdin.buffer.readline()
    return json.loads(line) if line.endswith(b"\n") else None


def _write_to(log_file: str) -> None:
    """Standard output and error go to `log_file` from now on, standard input is empty."""
    with open(log_file, "ab") as out, open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)
        os.dup2(out.fileno(), 1)
        os.dup2(out.fileno(), 2)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("conference", type=Path)
    parser.add_argument("services", nargs="+", help="what it must be able to become")
    parser.add_argument("--run", type=Path, required=True, help="as of vistel_services.host")
    parser.add_argument("--out", type=Path, required=True, help="as of vistel_services.host")
    args = parser.parse_args()
    voice = _voice()
    logs.configure("standby")
    try:
        loading = _Loading(load(args.conference), args.services)
    except ConferenceError as e:
        print(e, file=sys.stderr)
        return 2
    loading.start()
    loading.join()
    if loading.error is not None:
        log.error("loading failed", exc_info=loading.error)
        return 1
    gc.collect()
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):  # a C library other than GNU's
            ctypes.CDLL(None).malloc_trim(0)  # what loading needed for a while goes back
    gc.freeze()  # what is loaded stays; the collector need not walk it while the process works
    todo = _wait(voice)
    if todo is None:
        log.info("not needed")
        return 0
    _write_to(todo["log"])
    return host.main(todo["arguments"])


if __name__ == "__main__":
    host.leave(main())
