"""A key of the Zenoh bus that is published: numbered, kept for repair where it is reliable, thinned where the uplink is thin."""

# zenoh's stubs leave return types out
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false
import contextlib
import threading
from typing import Any

import zenoh

from vistel.wire.fence import Fence
from vistel.wire.reliable import SendCache
from vistel.wire.topics import MESSAGE_VERSION, Delivery, Publisher, Topic
from vistel.wire.uplink import Pacer, Uplink

_BULK = frozenset({"device_raw", "world_inputs", "avatar_part", "picture_part"})
"""Reliable topics that must not delay motion on a thin uplink."""
_FRAMES = frozenset({"tracker", "glove", "face", "pointer", "camera_body", "headset", "sound"})
"""Topics that give way to motion and voices where the uplink is thin. Who reads them in this process gets them all the same."""
_RAW = "device_raw"
"""For the log alone: it has gaps where the uplink is thin."""
_PUBLISHED_ONCE = frozenset({"avatar_part", "picture_part"})
"""Reliable topics with very many keys, each published once: their heartbeats become rarer and rarer."""
_RAREST_HEARTBEAT = 64
"""Periods of BEAT_S between two heartbeats of such a key, at most."""


class ZenohPublication:
    """`vistel.wire.bus.Publication` over Zenoh."""

    def __init__(
        self, session: zenoh.Session, topic: Topic, key: str, epoch: int, verbatim: bool, fence: Fence, uplink: Uplink
    ) -> None:
        self._fence = fence if topic.publisher is Publisher.WORLD else None
        self.key = key
        self.topic = topic
        self._verbatim = verbatim
        self._lock = threading.Lock()
        self._seq = 0
        self._published = False
        self._published_once = topic.name in _PUBLISHED_ONCE
        self._silent_beats = 0
        self._cache = SendCache(epoch) if topic.delivery is Delivery.RELIABLE else None
        priority = zenoh.Priority.DATA
        if self._cache is not None:
            priority = zenoh.Priority.DATA_LOW if topic.name in _BULK else zenoh.Priority.INTERACTIVE_HIGH
        # Over QUIC, best effort goes in datagrams, which wait for none that is lost; TLS sends both in one stream.
        reliability = zenoh.Reliability.RELIABLE if self._cache is not None else zenoh.Reliability.BEST_EFFORT

        def declared(where: zenoh.Locality) -> zenoh.Publisher:
            return session.declare_publisher(
                key,
                congestion_control=zenoh.CongestionControl.DROP,
                priority=priority,
                reliability=reliability,
                allowed_destination=where,
            )

        self._publisher = declared(zenoh.Locality.ANY)
        self._uplink, self._pacer = uplink, Pacer()
        self._nearby = declared(zenoh.Locality.SESSION_LOCAL) if topic.name in _FRAMES else None
        self._queryable = session.declare_queryable(key, self._repeat) if self._cache is not None else None

    def undeclare(self) -> None:
        """Publish no more, and repeat nothing."""
        undeclare([d for d in (self._publisher, self._nearby, self._queryable) if d is not None])

    @property
    def next_seq(self) -> int:
        """As `vistel.wire.bus.Publication.next_seq`."""
        return self._seq + 1

    def put(self, message: Any) -> None:
        """See `vistel.wire.bus.Publication`. Safe from any thread."""
        if self.topic.name == _RAW and not self._uplink.raw:
            return
        with self._lock:
            self._seq = max(self._seq + 1, message.header.seq)
            if not self._verbatim:
                message.header.version = MESSAGE_VERSION
                message.header.seq = self._seq
                if self._fence is not None and self._fence.own:
                    message.header.term = self._fence.own
            payload = message.SerializeToString()
            if self._cache is None:
                self._reaching(message.header.t_ns).put(payload)
            else:
                self._published = True
                self._publisher.put(payload, attachment=self._cache.append(payload).to_bytes())

    def _reaching(self, t_ns: int) -> zenoh.Publisher:
        """Reaches all, or this process alone where the uplink has no room for the frame of `t_ns`."""
        if self._nearby is None or self._pacer.due(t_ns, self._uplink.frames_hz):
            return self._publisher
        return self._nearby

    def beat(self) -> None:
        """Publish the number of the last message, if none was published lately."""
        if self._cache is None or not self._seq:
            return
        if self._published:
            self._published, self._silent_beats = False, 0
            return
        self._silent_beats += 1
        # A power of two: a loss is noticed within twice the time that the network was away.
        n = self._silent_beats
        if self._published_once and n & (n - 1) and n % _RAREST_HEARTBEAT:
            return
        with contextlib.suppress(zenoh.ZError):
            self._publisher.put(b"", attachment=self._cache.beat().to_bytes())

    def _repeat(self, query: zenoh.Query) -> None:
        assert self._cache is not None
        with query:
            wanted = query.parameters
            if "from" in wanted:
                try:
                    first, last = int(wanted["from"] or 0), int(wanted["to"] or 0)
                    foreign = wanted["epoch"] != str(self._cache.epoch)
                except ValueError:
                    return
                # An empty answer with our own stamp shows that the sender it asked for has ended.
                found = [(self._cache.beat(), b"")] if foreign else self._cache.between(first, last)
                if not found:
                    found = [(self._cache.beat(), b"")]
            else:
                found = [self._cache.last()]
            for stamp, payload in found:
                query.reply(self.key, payload, attachment=stamp.to_bytes())


def undeclare(held: list[Any]) -> None:
    """Undeclare what is still declared."""
    for thing in held:
        with contextlib.suppress(zenoh.ZError):
            thing.undeclare()
