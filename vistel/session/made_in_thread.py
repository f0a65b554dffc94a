"""What takes long to make, made once in a thread and kept by a key."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Container, Hashable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, TypeVar

from vistel.wire import background

log = logging.getLogger("vistel.console")
T = TypeVar("T")


class MadeInThread(Generic[T]):
    """What is made in a thread, by key. What cannot be made is logged once and stays None."""

    def __init__(self, maker: ThreadPoolExecutor, changed: Callable[[], None]) -> None:
        """changed: called when something has been made."""
        self._maker, self._changed = maker, changed
        self._made: dict[Hashable, T | None] = {}

    def forget_but(self, keys: Container[Hashable]) -> list[T]:
        """What was made for other keys."""
        gone = [key for key in self._made if key not in keys]
        return [made for key in gone if (made := self._made.pop(key)) is not None]

    def get(self, key: Hashable, make: Callable[[], T]) -> T | None:
        """What `make` made for a key; None while it makes it, and where it raised ValueError or OSError."""
        if key not in self._made:
            self._made[key] = None
            # Handed over at once: the maker may be closed before the task begins.
            background.start(self._keep(key, self._maker.submit(make)), "asset")
        return self._made[key]

    async def _keep(self, key: Hashable, making: Future[T]) -> None:
        try:
            made = await asyncio.wrap_future(making)
        except (ValueError, OSError) as fault:
            log.error("event=asset_not_made what=%s reason=%r", getattr(key, "id", key), str(fault))
            return
        if key in self._made:
            self._made[key] = made
        self._changed()
