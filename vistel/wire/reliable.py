"""Reliable delivery over a bus that may drop: a cache at the sender, gaps and their repair at the receiver.

Every reliable message carries (epoch, seq, oldest): which life of the sender, its number in that life (1, 2, ...), and the oldest
number the sender can still repeat. A receiver that misses numbers asks for them. A sender that has been silent repeats its last
number now and then, so that a loss at the end is noticed too. No message waits for the network, no link has to be closed for being
slow, and a router may restart: what was sent meanwhile is fetched afterwards.
"""

import struct
import threading
from collections import deque
from dataclasses import dataclass, field

CACHE_MESSAGES = 4096
CACHE_BYTES = 4 << 20
REPLY_LIMIT = 512
"""Messages repeated per request."""
WAITING_BYTES = 16 << 20
"""Of all messages behind gaps that one receiver keeps. What comes beyond counts as dropped, and is asked for again."""
MESSAGE_BYTES = 100
"""What keeping a message takes beside its payload."""
MOST_RETIRED = 8
"""Earlier lives of a sender that are remembered, so that nothing late of them is delivered."""

_STAMP = struct.Struct("<QQQ")


@dataclass(frozen=True)
class Stamp:
    """What a reliable message carries besides its payload."""

    epoch: int
    seq: int
    oldest: int

    def to_bytes(self) -> bytes:
        """24 bytes: epoch, seq and oldest as little-endian u64."""
        return _STAMP.pack(self.epoch, self.seq, self.oldest)

    @staticmethod
    def from_bytes(data: bytes) -> "Stamp | None":
        """The other end of `to_bytes`; None for bytes of another length."""
        return Stamp(*_STAMP.unpack(data)) if len(data) == _STAMP.size else None


class SendCache:
    """The last messages of one key, for late joiners and for repairs. Safe from any thread."""

    def __init__(self, epoch: int) -> None:
        self.epoch = epoch
        self._lock = threading.Lock()
        self._seq = 0
        self._bytes = 0
        self._kept: deque[bytes] = deque()

    def append(self, payload: bytes) -> Stamp:
        """Number, keep and stamp a message."""
        with self._lock:
            self._seq += 1
            self._kept.append(payload)
            self._bytes += len(payload)
            while len(self._kept) > 1 and (len(self._kept) > CACHE_MESSAGES or self._bytes > CACHE_BYTES):
                self._bytes -= len(self._kept.popleft())
            return self._stamp(self._seq)

    def last(self) -> tuple[Stamp, bytes]:
        """The newest message; an empty payload when there is none yet."""
        with self._lock:
            return self._stamp(self._seq), self._kept[-1] if self._kept else b""

    def beat(self) -> Stamp:
        """The newest number, without its message."""
        with self._lock:
            return self._stamp(self._seq)

    def between(self, first: int, last: int) -> list[tuple[Stamp, bytes]]:
        """Messages first..last as far as they are still kept, at most REPLY_LIMIT."""
        with self._lock:
            oldest = self._seq - len(self._kept) + 1
            first = max(first, oldest)
            last = min(last, self._seq, first + REPLY_LIMIT - 1)
            return [(self._stamp(n), self._kept[n - oldest]) for n in range(first, last + 1)]

    def _stamp(self, seq: int) -> Stamp:
        return Stamp(self.epoch, seq, self._seq - len(self._kept) + 1)


@dataclass
class Quota:
    """What the gaps of all keys of one receiver may hold together, whoever sends."""

    left: int = WAITING_BYTES


@dataclass
class ReceiveOrder:
    """One key's messages at a receiver: put in order, doubles removed, gaps named.

    `next`: the number to deliver next. None until the first stamp has been seen.
    """

    epoch: int = 0
    next: int = 1
    highest: int = 0
    lost: int = 0
    heard: int = 0
    """Messages, words and answers of the sender in this life."""
    waiting: dict[int, bytes] = field(default_factory=dict[int, bytes])
    """What has come behind a gap."""
    quota: Quota = field(default_factory=Quota)
    retired: deque[int] = field(default_factory=lambda: deque[int](maxlen=MOST_RETIRED))

    @staticmethod
    def starting(stamp: Stamp, *, from_last: bool, quota: Quota | None = None) -> "ReceiveOrder":
        """A key seen for the first time. From_last: deliver the last value and what follows; else all that is kept. quota: shared
        with other keys."""
        first = max(1, stamp.seq) if from_last else max(1, stamp.oldest)
        return ReceiveOrder(epoch=stamp.epoch, next=first, quota=quota or Quota())

    def offer(self, stamp: Stamp, payload: bytes) -> list[bytes]:
        """Take a message (or, without payload, word of one); what can be delivered now, in order."""
        out: list[bytes] = []
        if stamp.epoch != self.epoch:
            if stamp.epoch in self.retired:
                return out
            out = self._finish()
            self.retired.append(self.epoch)
            self.epoch, self.next, self.highest = stamp.epoch, 1, 0
        self.highest = max(self.highest, stamp.seq)
        self.heard += 1
        if stamp.oldest > self.next:
            out += self.skip_to(stamp.oldest)
        if payload and self._takes(stamp.seq, payload):
            self.waiting[stamp.seq] = payload
            self.quota.left -= MESSAGE_BYTES + len(payload)
        return out + self._deliver()

    def missing(self) -> tuple[int, int] | None:
        """The first gap: numbers first..last, both included."""
        if self.highest < self.next:
            return None
        return self.next, (min(self.waiting) - 1 if self.waiting else self.highest)

    def give_up(self) -> list[bytes]:
        """Stop waiting for the first gap; what can be delivered then."""
        gap = self.missing()
        return self.skip_to(gap[1] + 1) if gap else []

    def skip_to(self, seq: int) -> list[bytes]:
        """Count what is missing before `seq` as lost and go on there."""
        due = sorted(n for n in self.waiting if n < seq)
        out = [self._taken(n) for n in due]
        self.lost += max(0, seq - self.next) - len(out)
        self.next = max(self.next, seq)
        return out + self._deliver()

    def _deliver(self) -> list[bytes]:
        out: list[bytes] = []
        while self.next in self.waiting:
            out.append(self._taken(self.next))
            self.next += 1
        return out

    def _takes(self, seq: int, payload: bytes) -> bool:
        """Whether a message is new and may wait; one that may not counts as dropped by the network."""
        if seq == self.next:
            return True
        return seq > self.next and seq not in self.waiting and MESSAGE_BYTES + len(payload) <= self.quota.left

    def _taken(self, seq: int) -> bytes:
        payload = self.waiting.pop(seq)
        self.quota.left += MESSAGE_BYTES + len(payload)
        return payload

    def _finish(self) -> list[bytes]:
        return self.skip_to(self.highest + 1)
