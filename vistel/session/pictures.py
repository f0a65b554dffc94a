"""Pictures that people show on panels, taken off the bus, checked, and kept on this machine for whoever draws or serves them."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

from vistel.conference.room_assets import keep_asset, kept_asset
from vistel.space.files.model import Polymesh
from vistel.space.files.travel import pack_model, picture_digest
from vistel.space.pages.sheet import MOST_BYTES, PageError, sheet_of, unpacked_page
from vistel.wire import background
from vistel.wire.bus import Bus, Sample
from vistel.wire.parcels import Parcels
from vistel.wire.topics import BY_NAME

log = logging.getLogger("vistel.pictures")

MOST_WAITING = 64 << 20
"""Bytes of pictures that are here and not checked yet."""


class Pictures:
    """Lives on the event loop. Call `take` often, or run `follow`."""

    def __init__(self, bus: Bus, arrived: Callable[[Polymesh], None] = lambda _: None) -> None:
        """arrived: told of each page that has come whole."""
        self._parts = bus.subscribe(BY_NAME["picture_part"], queue_all=True)
        self._parcels = Parcels(MOST_BYTES)
        self._arrived = arrived
        self._tasks: set[asyncio.Task[None]] = set()
        self._one = asyncio.Lock()
        self._waiting = 0

    def take(self) -> None:
        """See what has arrived. Never waits."""
        for sample in self._parts.take():
            self._add(sample)

    async def follow(self) -> None:
        """Take what arrives until cancelled."""
        async for sample in self._parts:
            self._add(sample)

    def close(self) -> None:
        """Receive no more."""
        for task in self._tasks:
            task.cancel()
        self._parts.close()

    def _add(self, sample: Sample) -> None:
        site, digest = sample.names["site"], sample.names["picture"]
        whole = self._parcels.take(site, digest, sample.names["part"], sample.message)
        if whole is None:
            return
        if self._waiting + len(whole) > MOST_WAITING:
            self._parcels.known.discard(digest)  # it may be sent again
            log.error("event=picture_refused site=%s digest=%s reason='too many at once'", site, digest)
            return
        self._waiting += len(whole)
        task = background.start(self._keep(site, digest, whole), "picture")
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _keep(self, site: str, digest: str, data: bytes) -> None:
        try:
            async with self._one:  # decoded, a picture is many times as large
                sheet = await asyncio.to_thread(_kept, data)
        except PageError as fault:
            log.error("event=picture_refused site=%s digest=%s reason=%r", site, digest, str(fault))
            return
        finally:
            self._waiting -= len(data)
        log.info("event=picture_arrived site=%s digest=%s bytes=%d", site, sheet.digest, len(data))
        self._arrived(sheet)


def _kept(data: bytes) -> Polymesh:
    """The page that was sent; what whoever asks for it by its digest is given is on disk then. Raises PageError."""
    picture = unpacked_page(data)
    sheet = sheet_of(picture)
    if kept_asset(sheet.digest) is None:
        keep_asset(picture_digest(picture), data)
        keep_asset(sheet.digest, pack_model(sheet))
    return sheet
