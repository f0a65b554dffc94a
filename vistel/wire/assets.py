"""What is drawn of a room, asked for by its digest and answered part by part: who has it serves it, who has it not fetches it.

Bytes here; what they mean, and whether they are what their name says, is for who asked.
"""

import asyncio
import logging
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor

from google.protobuf.message import DecodeError

from vistel.v1.world_pb2 import AssetPart, AssetRequest
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, sleep
from vistel.wire.parcels import MOST_BYTES, PART_BYTES, is_digest
from vistel.wire.topics import BY_NAME

log = logging.getLogger("vistel.bus")

MOST_READY = 64 << 20
"""Bytes that are kept packed for who asks next."""
MOST_ASKED = 256
"""Assets that wait to be packed, or whether they are here to be found out; the oldest request goes."""
AT_ONCE = 4
"""Parts asked for at one time."""
PART_EVERY_S = 0.02
"""Time from one part to the next: 2.4 MB a second, which leaves room for motion."""
PATIENCE_S = 3.0
TRIES = 4
"""Questions for a part, once another one has come."""
_AGAIN_S = 0.5
"""Between two of them [s]."""
PACKING_S = 30.0
"""So long somebody may say that it is being packed: others wait behind it [s]."""
_NOT_READY_S = 0.1
"""Wait before a part is asked for again that is still being packed."""


class AssetRefusedError(ValueError):
    """It cannot be had; the text says why."""


class AssetNotServedError(AssetRefusedError):
    """Nobody gives it now."""


class AssetShelf:
    """Answers for assets. packers: what makes each, by digest, called in a thread; other: the same for what is not among them,
    None where it is not here."""

    def __init__(self, packers: Mapping[str, Callable[[], bytes]], other: Callable[[str], bytes | None]) -> None:
        self._packers, self._other = packers, other
        self._ready: dict[str, Future[bytes | None]] = {}
        self._thread: ThreadPoolExecutor | None = None

    def answer(self, request: bytes) -> AssetPart | None:
        """A part, or None where somebody else may have it; never waits."""
        try:
            asked = AssetRequest.FromString(request)
        except DecodeError:
            return None
        if not is_digest(asked.digest):
            return None
        packed = self._ready.pop(asked.digest, None)
        if packed is None:
            self._thread = self._thread or ThreadPoolExecutor(1, thread_name_prefix="assets")
            packed = self._thread.submit(self._pack, asked.digest)
            if len(self._ready) >= MOST_ASKED:
                self._ready.pop(next(iter(self._ready))).cancel()
        if not packed.done():
            self._ready[asked.digest] = packed
            return AssetPart()
        if packed.exception() is not None:
            log.error("event=asset_not_packed digest=%s reason=%r", asked.digest, str(packed.exception()))
            return AssetPart(reason="it could not be packed")
        data = packed.result()
        if data is None:
            return None
        self._ready[asked.digest] = packed  # the newest is last
        self._drop_old()
        return _part(data, asked.part)

    def close(self) -> None:
        """Answer no more."""
        if self._thread is not None:
            self._thread.shutdown(wait=False, cancel_futures=True)

    def _pack(self, digest: str) -> bytes | None:
        pack = self._packers.get(digest)
        return self._other(digest) if pack is None else pack()

    def _drop_old(self) -> None:
        total = 0
        for digest, packed in reversed(list(self._ready.items())):
            total += len(packed.result() or b"") if packed.done() and packed.exception() is None else 0
            if total > MOST_READY:
                self._ready.pop(digest)


def _part(data: bytes, number: int) -> AssetPart:
    parts = -(-len(data) // PART_BYTES)
    if len(data) > MOST_BYTES:
        return AssetPart(reason=f"{len(data) / 1e6:.1f} MB, expected at most {MOST_BYTES / 1e6:.1f} MB")
    if number >= parts:
        return AssetPart(reason=f"there are {parts} parts")
    return AssetPart(parts=parts, size=len(data), data=data[number * PART_BYTES : (number + 1) * PART_BYTES])


async def fetch_asset(bus: Bus, digest: str, arrived: Callable[[int, int], None] = lambda have, of: None) -> bytes:
    """The bytes of an asset, from whoever has it. arrived: called with bytes here and in all.

    Raises AssetRefusedError, and AssetNotServedError where nobody has it now.
    """
    first = await _ask(bus, digest, 0, 1)
    if not 0 < first.size <= MOST_BYTES or first.parts != -(-first.size // PART_BYTES):
        raise AssetRefusedError(f"{first.size / 1e6:.1f} MB in {first.parts} parts, expected at most {MOST_BYTES / 1e6:.1f} MB")
    parts = [b""] * first.parts
    have = 0

    def take(number: int, part: AssetPart) -> None:
        nonlocal have
        if (part.parts, part.size) != (first.parts, first.size):
            raise AssetRefusedError("its parts tell different sizes")
        if len(part.data) != min(PART_BYTES, first.size - number * PART_BYTES):
            raise AssetRefusedError(f"part {number} has {len(part.data)} bytes")
        parts[number] = part.data
        have += len(part.data)
        arrived(have, first.size)

    take(0, first)
    waiting = iter(range(1, first.parts))

    async def one_after_the_other() -> None:
        for number in waiting:
            take(number, await _ask(bus, digest, number, TRIES))
            await asyncio.sleep(AT_ONCE * PART_EVERY_S)

    try:
        async with asyncio.TaskGroup() as group:
            for _ in range(min(AT_ONCE, first.parts - 1)):
                group.create_task(one_after_the_other())
    except* AssetRefusedError as refused:
        raise refused.exceptions[0] from None
    return b"".join(parts)


async def is_served(bus: Bus, clock: Clock, digest: str, patience_s: float = PATIENCE_S) -> bool:
    """Whether somebody has an asset to give, now or within `patience_s`."""
    until_ns = clock.now_ns() + round(patience_s * 1e9)
    while True:
        part: AssetPart | None = await bus.query(BY_NAME["room_asset"], AssetRequest(digest=digest), PATIENCE_S)
        if part is not None and part.parts:
            return True
        if clock.now_ns() >= until_ns or (part is not None and part.reason):
            return False
        await sleep(clock, _NOT_READY_S)


async def _ask(bus: Bus, digest: str, number: int, tries: int) -> AssetPart:
    """tries: so often nobody may answer."""
    request = AssetRequest(digest=digest, part=number)
    packing_s = 0.0
    while tries and packing_s <= PACKING_S:
        part: AssetPart | None = await bus.query(BY_NAME["room_asset"], request, PATIENCE_S)
        if part is not None and part.reason:
            raise AssetRefusedError(part.reason)
        if part is not None and part.parts:
            return part
        if part is None:
            tries -= 1
            await asyncio.sleep(_AGAIN_S if tries else 0.0)
        else:
            packing_s += _NOT_READY_S
            await asyncio.sleep(_NOT_READY_S)
    raise AssetNotServedError("nobody has it now")
