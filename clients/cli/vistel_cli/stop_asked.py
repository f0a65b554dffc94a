"""Ctrl-C for what runs until then."""

import asyncio
import signal


def stop_asked() -> asyncio.Event:
    """Set on Ctrl-C and SIGTERM from now on, on the loop that runs. Call it before saying that Ctrl-C ends something."""
    stop = asyncio.Event()
    for signum in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(signum, stop.set)
    return stop
