"""A process says that its event loop turns; the supervisor restarts one that has fallen silent
(`vistel_services.process.supervisor`).

As systemd's watchdog does, by a file whose time of change is the sign of life: it needs no descriptor that a forked process
would have to inherit, and no thread, which would go on while the loop hangs.
"""

import asyncio
import ctypes
import faulthandler
import os
import signal
import sys
from pathlib import Path

PERIOD_S = 1.0
"""From one sign of life to the next."""
_PR_SET_PDEATHSIG = 1


def end_with(parent: int) -> None:
    """SIGTERM for this process when its parent, the supervisor, dies without a word: nobody else would end it. (On Linux alone.)"""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
        if os.getppid() != parent:
            raise SystemExit(1)  # it was quicker


async def report(file: Path) -> None:
    """Touch `file` every PERIOD_S, until cancelled. When this process is ended for its silence (SIGABRT), what every thread is
    doing is written to standard error first."""
    end_with(os.getppid())
    if not faulthandler.is_enabled():
        faulthandler.enable()
    file.parent.mkdir(parents=True, exist_ok=True)
    while True:
        file.touch()
        await asyncio.sleep(PERIOD_S)


def last(file: Path) -> int:
    """When `file` was touched last [ns]; 0 if it is not there."""
    try:
        return file.stat().st_mtime_ns
    except FileNotFoundError:
        return 0
