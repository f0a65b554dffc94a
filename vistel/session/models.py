"""What is drawn of things from files that are not at this site: kept from before, or fetched from who has it."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Collection, Coroutine, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.conference.room_assets import keep_asset, kept_model
from vistel.session.pictures import Pictures
from vistel.space.files.model import Polymesh
from vistel.space.files.travel import pictures_in, unpack_model, unpack_picture
from vistel.wire import background
from vistel.wire.assets import AssetNotServedError, AssetRefusedError, fetch_asset
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.parcels import is_digest

log = logging.getLogger("vistel.renderer")

REPORT_NS = 2_000_000_000
"""From one line about what is on its way to the next."""
AGAIN_S = 0.5
"""What nobody serves is asked for again after so long, which doubles ... [s]"""
AGAIN_MOST_S = 8.0
"""... up to this [s]."""
MOST_TURNED = 12
"""Pages that are kept in memory when no panel shows them any more."""


class RoomDeliveries:
    """Fills `models`, by digest, with what is asked for and not there. Lives on the event loop."""

    def __init__(self, bus: Bus, clock: Clock, models: dict[str, Polymesh]) -> None:
        self._bus, self._clock, self._models = bus, clock, models
        self._pictures: dict[str, NDArray[np.uint8]] = {}
        self._asked: set[str] = set()
        self._tasks: set[asyncio.Task[None]] = set()
        self._one = asyncio.Lock()
        self._reported_ns = 0
        self._bringing: dict[str, asyncio.Task[None]] = {}
        self._shown: dict[str, None] = {}
        """Digests of pages, those that were shown longest ago first."""
        self._sent = Pictures(bus, self._arrived)

    def want(self, digests: Iterable[str]) -> None:
        """Things with these polymeshes are in the room. Never waits."""
        for digest in digests:
            if digest in self._models or digest in self._asked:
                continue
            self._start(digest, self._bring(digest, self._one))

    def show(self, pages: Collection[str]) -> None:
        """Panels show these, or will when a page is turned. Never waits. Each is fetched by itself: one that nobody has keeps no
        other one waiting."""
        self._sent.take()
        for digest in pages:
            self._shown.pop(digest, None)
            self._shown[digest] = None
            if digest not in self._models and digest not in self._asked:
                self._start(digest, self._bring(digest, asyncio.Lock()))
        for digest in list(self._shown)[: -len(pages) - MOST_TURNED]:
            del self._shown[digest]
            self._forget(digest)

    def close(self) -> None:
        """Fetch no more."""
        self._sent.close()
        for task in self._tasks:
            task.cancel()

    def _start(self, digest: str, bringing: Coroutine[Any, Any, None]) -> None:
        self._asked.add(digest)
        task = self._bringing[digest] = background.start(bringing, "polymesh")
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _forget(self, digest: str) -> None:
        """A page that is not shown any more."""
        model = self._models.pop(digest, None)
        if model is not None:
            for material in model.materials:
                self._pictures = {name: p for name, p in self._pictures.items() if p is not material.picture}
        self._asked.discard(digest)
        if digest in self._bringing:
            self._bringing.pop(digest).cancel()

    def _arrived(self, sheet: Polymesh) -> None:
        """Whoever shows a page has sent it, perhaps before it is to be seen."""
        if sheet.digest in self._shown and sheet.digest not in self._models:
            self._models[sheet.digest] = sheet
            if sheet.digest in self._bringing:
                self._bringing.pop(sheet.digest).cancel()

    async def _bring(self, digest: str, one: asyncio.Lock) -> None:
        """one: held while it is fetched, so that what is asked for first comes first, and pictures come once."""
        model = await asyncio.to_thread(kept_model, digest, self._pictures)
        if model is None:
            try:
                model = await self._fetched_in_turn(digest, one)
            except ValueError as fault:
                log.error("event=model_refused digest=%s reason=%r shown=what_is_felt_of_it", digest, str(fault))
                return
            log.info(
                "event=model_arrived digest=%s triangles=%d awaited=%d",
                digest,
                len(model.triangles),
                len(self._asked - self._models.keys()) - 1,
            )
        self._models[digest] = model

    async def _fetched_in_turn(self, digest: str, one: asyncio.Lock) -> Polymesh:
        """What nobody serves lets the next one have its turn, and is asked for again later."""
        wait_s = AGAIN_S
        while True:
            async with one:
                with contextlib.suppress(AssetNotServedError):
                    return await self._fetched(digest)
            if wait_s == AGAIN_S:
                log.info("event=model_not_served digest=%s action=asked_again", digest)
            await asyncio.sleep(wait_s)
            wait_s = min(2.0 * wait_s, AGAIN_MOST_S)

    async def _fetched(self, digest: str) -> Polymesh:
        if not is_digest(digest):
            raise AssetRefusedError("no digest")
        data = await self._bytes_of(digest)
        for name in await asyncio.to_thread(pictures_in, data):
            if not is_digest(name):
                raise AssetRefusedError("a picture with no digest")
            if name not in self._pictures:
                packed = await self._bytes_of(name)
                self._pictures[name] = await asyncio.to_thread(unpack_picture, packed, name)
                await asyncio.to_thread(keep_asset, name, packed)
        model = await asyncio.to_thread(unpack_model, data, digest, self._pictures)
        await asyncio.to_thread(keep_asset, digest, data)
        return model

    async def _bytes_of(self, digest: str) -> bytes:
        return await fetch_asset(self._bus, digest, lambda have, of: self._report(digest, have, of))

    def _report(self, digest: str, have: int, of: int) -> None:
        now_ns = self._clock.now_ns()
        if now_ns - self._reported_ns > REPORT_NS and have < of:
            self._reported_ns = now_ns
            log.info(
                "event=model_arriving digest=%s kilobytes=%d of=%d awaited=%d",
                digest,
                have // 1000,
                of // 1000,
                len(self._asked - self._models.keys()),
            )
