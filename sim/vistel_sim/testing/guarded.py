"""Runs a command that ends when who started it does, however that ends: `python -m vistel_sim.testing.guarded COMMAND...`.

Whoever starts this holds the other end of its standard input. When that closes, the command is told to stop (SIGTERM), and after
half a minute is killed.
"""

import contextlib
import os
import signal
import subprocess
import sys
import threading

_STOP_S = 30.0
"""A command that was told to stop does so within this time [s]."""


def main(command: list[str]) -> int:
    """Returns the command's exit code."""
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True)

    def stop_when_alone() -> None:
        while os.read(0, 1):
            pass
        process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_STOP_S)
            return
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)

    for signum in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(signum, lambda *_: process.terminate())
    threading.Thread(target=stop_when_alone, daemon=True).start()
    return process.wait()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
