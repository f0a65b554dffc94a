"""Runs asyncio programs on the loop that wakes fastest: uvloop where it is installed, asyncio's own elsewhere.

From a message's publication to its handler in another process uvloop saves about a fifth. It
starts no processes in groups of their own, so what supervises processes stays on asyncio's.
"""

import asyncio
from collections.abc import Coroutine
from typing import Any, TypeVar

try:
    from uvloop import new_event_loop
except ImportError:  # Windows, and who left the extra out
    new_event_loop = asyncio.new_event_loop

T = TypeVar("T")


def run(main: Coroutine[Any, Any, T]) -> T:
    """As `asyncio.run`."""
    with asyncio.Runner(loop_factory=new_event_loop) as runner:
        return runner.run(main)
