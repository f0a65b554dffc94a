"""What a subscription holds between the network's thread and the service's event loop."""

import asyncio
import logging
import threading
from collections import deque
from collections.abc import AsyncIterator, Callable
from typing import Any

from google.protobuf.message import DecodeError

from vistel.wire.bus import BusCounters, Sample
from vistel.wire.fence import Fence
from vistel.wire.freshness import Freshness
from vistel.wire.limits import MOST_MESSAGE_BYTES, Rates, most_bytes, objection_to_texts, short_bytes
from vistel.wire.owners import Admission
from vistel.wire.reliable import CACHE_BYTES, CACHE_MESSAGES
from vistel.wire.topics import MESSAGE_VERSION, Delivery, Publisher, Topic

log = logging.getLogger("vistel.bus")

QUEUE_LIMIT = 4096
"""Messages that wait in a NEWEST subscription with `queue_all`; beyond that the oldest go."""
QUEUE_BYTES = 32 << 20
"""Bytes of messages that wait there."""
RELIABLE_LIMIT = 65536
"""Messages that wait in a RELIABLE subscription."""
RELIABLE_BYTES = 64 << 20
"""Bytes of messages that wait there."""
STALE_AFTER_NS = 250_000_000
"""Age [ns] beyond which a NEWEST message is dropped on arrival."""


class OverflowedError(RuntimeError):
    """A reliable subscription was not read for so long that messages are lost; who reads it must begin again."""


class MessageDecoder:
    """Bytes to messages of one topic; what cannot be used is counted, and logged once per key and reason."""

    def __init__(self, topic: Topic, counters: BusCounters) -> None:
        self.topic = topic
        self._counters = counters
        self._has_header = "header" in topic.message.DESCRIPTOR.fields_by_name
        self._short_bytes = short_bytes(topic.message.DESCRIPTOR) if topic.publisher is Publisher.SITE else MOST_MESSAGE_BYTES
        self._logged: set[tuple[str, str]] = set()

    def decode(self, key: str, payload: bytes) -> Any | None:
        """The message, or None."""
        message = self.topic.message()
        try:
            message.ParseFromString(payload)
        except DecodeError:
            self._counters.corrupt += 1
            self.log_once(key, f"{len(payload)} bytes that are no {self.topic.message.DESCRIPTOR.name}")
            return None
        if self._has_header:
            version: int = message.header.version  # type: ignore[attr-defined]
            if version != MESSAGE_VERSION:
                self._counters.unknown_version += 1
                self.log_once(key, f"message version {version}, this is {MESSAGE_VERSION}: update the older side")
                return None
        reason = objection_to_texts(message) if len(payload) > self._short_bytes else ""
        if reason:
            self._counters.corrupt += 1
            self.log_once(key, reason)
            return None
        return message

    def log_once(self, key: str, what: str) -> None:
        """One line for each key and reason."""
        if (key, what) not in self._logged and len(self._logged) < 100:
            self._logged.add((key, what))
            log.warning("message dropped key=%s reason=%r", key, what)


class Inbox:
    """A `Subscription`: `push` from any thread, everything else on the event loop.

    NEWEST topics keep the newest payload per key and decode only that; with `queue_all`, and for RELIABLE
    topics, everything is kept in order. However many messages arrive, the loop is woken once until it has
    drained; with `polled` it is not woken at all, and only `take` gives what has arrived.

    A NEWEST inbox that is full drops its oldest messages and counts them. A RELIABLE one never loses a message unnoticed: its
    feeder holds messages back while it is `full`, and where that cannot be, reading it raises OverflowedError.
    """

    def __init__(
        self,
        topic: Topic,
        counters: BusCounters,
        loop: asyncio.AbstractEventLoop,
        *,
        queue_all: bool = False,
        polled: bool = False,
        stale_after_ns: int | None = STALE_AFTER_NS,
        on_close: Callable[[], None] = lambda: None,
        fence: Fence | None = None,
        admission: Admission | None = None,
    ) -> None:
        self.topic = topic
        self._admission = admission or Admission(None, counters)
        self._rates = Rates(topic)
        self._fence = fence if topic.publisher is Publisher.WORLD else None
        self._decoder = MessageDecoder(topic, counters)
        self._counters = counters
        self._loop = loop
        self._newest_only = topic.delivery is Delivery.NEWEST and not queue_all
        self._stale_after_ns = stale_after_ns if self._newest_only else None
        # Once the first of a gap has come, one arrival may release all that its sender keeps.
        self._limit = RELIABLE_LIMIT + CACHE_MESSAGES if topic.delivery is Delivery.RELIABLE else QUEUE_LIMIT
        self._limit_bytes = RELIABLE_BYTES + CACHE_BYTES if topic.delivery is Delivery.RELIABLE else QUEUE_BYTES
        self._most_bytes = most_bytes(topic)
        self._raw_bytes = self._ready_bytes = 0
        self._lost = 0
        self._polled = polled
        self._on_close = on_close
        self._lock = threading.Lock()
        self._raw_newest: dict[str, tuple[bytes, int]] = {}
        self._raw: deque[tuple[str, bytes, int]] = deque()
        self._woken = False
        self._ready: deque[Sample] = deque()
        self._freshness: dict[str, Freshness] = {}
        self._arrived = asyncio.Event()
        self.closed = False

    def push(self, key: str, payload: bytes, received_ns: int) -> None:
        """One message; see `push_all`."""
        self.push_all([(key, payload, received_ns)])

    def push_all(self, messages: list[tuple[str, bytes, int]]) -> None:
        """(key, payload, received_ns) each.

        Called by the network, on any thread; never waits for the loop.
        """
        messages = [m for m in messages if self.admits(m[0], m[2]) and self._small_enough(m[0], m[1])]
        with self._lock:
            messages = [m for m in messages if self._in_time(m[0], m[2])]
            self._counters.received += len(messages)
            if self._newest_only:
                for key, payload, received_ns in messages:
                    self._raw_newest[key] = (payload, received_ns)
            else:
                self._raw.extend(messages)
                self._raw_bytes += sum(len(payload) for _, payload, _ in messages)
                while len(self._raw) > self._limit or self._raw_bytes > self._limit_bytes:
                    self._raw_bytes -= len(self._raw.popleft()[1])
                    self._overflow()
            if self._woken or self._polled:
                return
            self._woken = True
        wake(self._loop, self._drain)

    def admits(self, key: str, received_ns: int) -> bool:
        """Whether messages under `key` are for this inbox, from somebody who may send them. From any thread."""
        return self._admission.names(self.topic, key, received_ns) is not None

    def _in_time(self, key: str, received_ns: int) -> bool:
        if not self._admission.bounded or self._rates.admit(key, received_ns):
            return True
        self._admission.refuse(self.topic, key, self._rates.objection, received_ns)
        return False

    def _small_enough(self, key: str, payload: bytes) -> bool:
        if len(payload) <= self._most_bytes:
            return True
        self._counters.corrupt += 1
        self._decoder.log_once(key, f"a message of {len(payload) / 1e6:.1f} MB, expected at most {self._most_bytes / 1e6:.1f} MB")
        return False

    @property
    def full(self) -> bool:
        """Whether a RELIABLE inbox should be fed no more for now. From any thread."""
        return len(self._raw) + len(self._ready) >= RELIABLE_LIMIT or self._raw_bytes + self._ready_bytes >= RELIABLE_BYTES

    @property
    def waiting(self) -> int:
        """How many messages have arrived and were not taken. From any thread."""
        return len(self._raw) + len(self._raw_newest) + len(self._ready)

    def take(self) -> list[Sample]:
        """As `Subscription.take`. Raises OverflowedError where a RELIABLE topic has lost messages."""
        self._drain()
        self._check()
        self._arrived.clear()
        out = list(self._ready)
        self._ready.clear()
        self._ready_bytes = 0
        return out

    async def __aiter__(self) -> AsyncIterator[Sample]:
        while True:
            while self._ready:
                self._check()
                yield self._ready.popleft()
            self._ready_bytes = 0
            if self.closed:
                return
            self._arrived.clear()
            await self._arrived.wait()

    def close(self) -> None:
        """As `Subscription.close`; what has arrived can still be read."""
        if not self.closed:
            self.closed = True
            self._arrived.set()
            self._on_close()

    def _drain(self) -> None:
        with self._lock:
            self._woken = False
            if self._newest_only:
                items = [(key, payload, at) for key, (payload, at) in self._raw_newest.items()]
                self._raw_newest = {}
            else:
                items = list(self._raw)
                self._raw.clear()
                self._ready_bytes += self._raw_bytes
                self._raw_bytes = 0
        for key, payload, received_ns in items:
            sample = self._sample(key, payload, received_ns)
            if sample is not None:
                self._keep(sample)
        if self._ready:
            self._arrived.set()

    def _sample(self, key: str, payload: bytes, received_ns: int) -> Sample | None:
        names = self._admission.names(self.topic, key, received_ns)
        if names is None:
            return None
        message = self._decoder.decode(key, payload)
        if message is None:
            return None
        if self._fence is not None and not self._fence.admits(message.header.term, received_ns):
            self._counters.fenced += 1
            return None
        if not self._admission.message(self.topic, names, message, received_ns):
            return None
        if self._stale_after_ns is not None:
            freshness = self._freshness.get(key)
            if freshness is None:
                freshness = self._freshness[key] = Freshness(self._stale_after_ns)
            if not freshness.accept(message.header.t_ns, received_ns):
                self._counters.stale += 1
                return None
        return Sample(self.topic, key, names, message, received_ns)

    def _keep(self, sample: Sample) -> None:
        if self._newest_only:
            for i, waiting in enumerate(self._ready):
                if waiting.key == sample.key:
                    self._ready[i] = sample
                    return
        self._ready.append(sample)
        if len(self._ready) > self._limit:
            self._ready.popleft()
            self._overflow()

    def _overflow(self) -> None:
        self._counters.overflow += 1
        if self.topic.delivery is Delivery.RELIABLE:
            self._lost += 1

    def _check(self) -> None:
        if self._lost:
            raise OverflowedError(f"{self.topic.name}: {self._lost} reliable messages lost, the reader was {self._limit} behind")


def wake(loop: asyncio.AbstractEventLoop, callback: Callable[[], object]) -> None:
    """Run `callback` on the loop, from any thread; a loop that has closed needs it no more."""
    try:
        loop.call_soon_threadsafe(callback)
    except RuntimeError:
        if not loop.is_closed():
            raise
