"""Waiting for what threads, other processes and machines do: until something holds, however long it takes.

There is no limit of time, so that no result depends on how busy the machine is. What never comes is ended by pytest's
timeout, which shows what was waited for. Other sleeps of tests say beside them why they are there.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterable
from typing import Any

LOOK_S = 0.005


async def until(holds: Callable[[], object], what: str = "", *, tasks: Iterable[asyncio.Task[Any]] = ()) -> None:
    """Returns once it holds; fails as soon as one of `tasks` has ended. what: told where it never comes."""
    try:
        while not holds():
            for task in tasks:
                assert not task.done(), f"ended: {task.result()}"
            await asyncio.sleep(LOOK_S)
    except asyncio.CancelledError:
        print(f"given up waiting for {what or holds}")
        raise


def wait_until(holds: Callable[[], object], what: str = "", *, every_s: float = LOOK_S) -> None:
    """As `until`, where there is no event loop."""
    while not holds():
        time.sleep(every_s)
