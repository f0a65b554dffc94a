"""Ctrl-C for what runs until then."""

import asyncio
import os
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from vistel_cli.terminal import FAILED, err

STOPPED = "stopped; nothing was written"
"""Said by a command that Ctrl-C ended before its file was begun."""


def stop_asked() -> asyncio.Event:
    """Set on Ctrl-C and SIGTERM from now on, on the loop that runs. Call it before saying that Ctrl-C ends something."""
    stop = asyncio.Event()
    for signum in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(signum, stop.set)
    return stop


@contextmanager
def stopped_at_once(said: str) -> Iterator[None]:
    """Within the block Ctrl-C prints `said` and ends the process at once, with exit code 1: also while a kernel is compiled, which
    takes seconds in native code and loses a KeyboardInterrupt. Only for what leaves nothing half done."""
    told, listening = socket.socketpair()
    told.setblocking(False)

    def listen() -> None:
        while received := listening.recv(1):
            if received[0] == signal.SIGINT:
                err.show_cursor(True)
                err.print(said, soft_wrap=True)
                os._exit(FAILED)

    # Python itself writes the number there as soon as the signal comes; the handler would wait for the native code.
    before = signal.signal(signal.SIGINT, lambda *_: None), signal.set_wakeup_fd(told.fileno())
    listener = threading.Thread(target=listen, daemon=True)
    listener.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(before[1])
        signal.signal(signal.SIGINT, before[0])
        told.close()
        listener.join()
        listening.close()
