"""Avatars of other sites, taken off the bus and kept on this machine."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine
from typing import Any

from vistel.conference.avatar_files import keep_parcel, kept_parcel
from vistel.render.stage.stage import Stage
from vistel.wire import background
from vistel.wire.bus import Bus
from vistel.wire.parcels import Parcels
from vistel.wire.topics import BY_NAME

log = logging.getLogger("vistel.renderer")


class Deliveries:
    """Tells the stage when an avatar that somebody has is here: it was kept from before, or has come."""

    def __init__(self, bus: Bus, stage: Stage) -> None:
        self._stage = stage
        self._parts = bus.subscribe(BY_NAME["avatar_part"], polled=True)
        self._parcels = Parcels()
        self._in_memory: dict[str, bytes] = {}
        self._looked_for: set[str] = set()
        self._tasks: set[asyncio.Task[None]] = set()

    def take(self) -> None:
        """See what has arrived, and look for what somebody says they have."""
        for digest in self._stage.awaited - self._looked_for:
            self._looked_for.add(digest)
            self._start(self._look(digest))
        for sample in self._parts.take():
            site, digest = sample.names["site"], sample.names["digest"]
            whole = self._parcels.take(site, digest, sample.names["part"], sample.message)
            if whole is not None:
                self._start(self._keep(digest, whole))
            elif (site, digest) in self._parcels.refused:
                self._stage.avatar_refused(site, digest)

    def parcel(self, digest: str) -> bytes:
        """An avatar's bytes; from any thread. Raises ValueError when they are not here."""
        data = self._in_memory.get(digest) or kept_parcel(digest)
        if data is None:
            raise ValueError(f"avatar: parcel {digest} did not arrive whole; see the line that refused it")
        return data

    def close(self) -> None:
        """Stop listening."""
        for task in self._tasks:
            task.cancel()
        self._parts.close()

    async def _look(self, digest: str) -> None:
        if await asyncio.to_thread(kept_parcel, digest) is not None:
            self._parcels.known.add(digest)
            self._stage.avatar_arrived(digest)

    async def _keep(self, digest: str, data: bytes) -> None:
        if not await asyncio.to_thread(keep_parcel, digest, data):
            self._in_memory[digest] = data
        log.info("event=avatar_arrived digest=%s bytes=%d", digest, len(data))
        self._stage.avatar_arrived(digest)

    def _start(self, coroutine: Coroutine[Any, Any, None]) -> None:
        task = background.start(coroutine, "avatar")
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
