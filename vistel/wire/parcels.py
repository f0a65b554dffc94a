"""Large things on the reliable path: a parcel of bytes, named by its digest, in parts that fit between motion.

Every part has a key of its own, so that the bus repeats it to who comes late. Whoever has a parcel with its digest has
the right one, wherever it came from.
"""

import hashlib
import logging
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass, field

from vistel.v1.motion_pb2 import AvatarPart
from vistel.wire.bus import Publication
from vistel.wire.clock import Clock

log = logging.getLogger("vistel.bus")

PART_BYTES = 48 * 1024
"""A larger message would be cut into fragments, and lost whole with any one of them."""
PART_EVERY_NS = 20_000_000
"""Parts follow one another no faster: 2.4 MB a second, which leaves room for motion."""
MOST_BYTES = 16 << 20
"""Of a parcel."""
MOST_WAITING = 64 << 20
"""Bytes of parcels that are not complete, at a receiver."""


def digest_of(data: bytes) -> str:
    """The name of a parcel: the first 32 hexadecimal digits of its SHA-256."""
    return hashlib.sha256(data).hexdigest()[:32]


def is_digest(text: str) -> bool:
    """Whether `text` can be a parcel's name."""
    return len(text) == 32 and all(c in "0123456789abcdef" for c in text)


def part_name(number: int) -> str:
    """A part's name in its key."""
    return f"{number:04d}"


def parts_of(data: bytes) -> Iterator[tuple[str, AvatarPart]]:
    """The parts of a parcel with their names. Raises ValueError when it is too large."""
    if not 0 < len(data) <= MOST_BYTES:
        raise ValueError(f"{len(data) / 1e6:.1f} MB, expected at most {MOST_BYTES / 1e6:.1f} MB")
    parts = _count(len(data))
    for n in range(parts):
        piece = data[n * PART_BYTES : (n + 1) * PART_BYTES]
        yield part_name(n), AvatarPart(parts=parts, size=len(data), data=piece)


async def parts_in_time(data: bytes, clock: Clock) -> AsyncIterator[tuple[str, AvatarPart]]:
    """As `parts_of`, one every PART_EVERY_NS."""
    due_ns = clock.now_ns()
    for name, part in parts_of(data):
        yield name, part
        due_ns += PART_EVERY_NS
        await clock.sleep_until_ns(due_ns)


async def send_parcel(data: bytes, publication: Callable[[str], Publication], clock: Clock, source: str) -> None:
    """Put a parcel on the bus, a part at a time; late joiners get it from there as long as the bus is open. publication: that of
    a part, by its name; source: who sends it."""
    async for name, part in parts_in_time(data, clock):
        part.header.t_ns, part.header.source = clock.now_ns(), source
        publication(name).put(part)


@dataclass
class _Coming:
    size: int
    parts: dict[int, bytes] = field(default_factory=dict[int, bytes])


class Parcels:
    """Puts parts together, those of each sender apart. `known`: digests that need not be gathered (any more); `refused`:
    sender and digest of what cannot be."""

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        """most_bytes: of a parcel; larger ones are refused with their first part."""
        self._most_bytes = most_bytes
        self.known: set[str] = set()
        self.refused: set[tuple[str, str]] = set()
        self._coming: dict[tuple[str, str], _Coming] = {}
        self._waiting = 0

    def take(self, sender: str, digest: str, part: str, message: AvatarPart) -> bytes | None:
        """The whole parcel when this was the last part missing. What cannot be is refused with a line in the log."""
        key = sender, digest
        if digest in self.known or key in self.refused:
            return None
        number = int(part) if part.isdecimal() else -1
        reason = self._objection(key, number, message)
        if reason:
            return self._refuse(key, reason)
        coming = self._coming.setdefault(key, _Coming(message.size))
        if number not in coming.parts:
            coming.parts[number] = message.data
            self._waiting += len(message.data)
        if len(coming.parts) < message.parts:
            return None
        data = b"".join(coming.parts[n] for n in range(message.parts))
        if digest_of(data) != digest:
            return self._refuse(key, "damaged: its bytes have another digest")
        self._forget(key)
        self.known.add(digest)
        return data

    def _refuse(self, key: tuple[str, str], reason: str) -> None:
        self.refused.add(key)
        self._forget(key)
        log.error("event=parcel_refused sender=%s digest=%s reason=%r", *key, reason)

    def _objection(self, key: tuple[str, str], number: int, message: AvatarPart) -> str:
        if not is_digest(key[1]):
            return "no digest"
        if not 0 < message.size <= self._most_bytes:
            return f"{message.size / 1e6:.1f} MB, expected at most {self._most_bytes / 1e6:.1f} MB"
        if message.parts != _count(message.size) or not 0 <= number < message.parts:
            return f"part {number} of {message.parts} of {message.size} bytes cannot be"
        if len(message.data) != min(PART_BYTES, message.size - number * PART_BYTES):
            return f"part {number} has {len(message.data)} bytes"
        coming = self._coming.get(key)
        if coming is not None and coming.size != message.size:
            return "its parts tell different sizes"
        if self._waiting + len(message.data) > MOST_WAITING:
            return f"more than {MOST_WAITING / 1e6:.0f} MB on their way at once"
        return ""

    def _forget(self, key: tuple[str, str]) -> None:
        coming = self._coming.pop(key, None)
        if coming is not None:
            self._waiting -= sum(map(len, coming.parts.values()))


def _count(size: int) -> int:
    return -(-size // PART_BYTES)
