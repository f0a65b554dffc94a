"""The bus inside one process: for tests, and for replaying a log as fast as it can be read.

`MemoryNetwork` joins any number of `MemoryBus`es on one event loop. Messages travel as bytes through the same
inboxes as on the real bus, so that corrupt payloads, unknown versions, late joiners and slow readers behave
the same; nothing is lost or reordered, and nothing happens on another thread.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any

from google.protobuf.message import Message

from vistel.wire.bus import BusCounters, Publication
from vistel.wire.clock import Clock
from vistel.wire.fence import Fence
from vistel.wire.inbox import STALE_AFTER_NS, Inbox, MessageDecoder
from vistel.wire.owners import Admission, Owners
from vistel.wire.topics import MESSAGE_VERSION, Delivery, Publisher, Topic
from vistel.wire.uplink import Uplink

log = logging.getLogger("vistel.bus")


class MemoryNetwork:
    """What the buses of one process share: who reads, the last reliable values, who answers, who is present."""

    def __init__(self) -> None:
        self._buses: list[MemoryBus] = []
        self._last: dict[str, tuple[Topic, bytes]] = {}
        self._answers: dict[str, list[tuple[MemoryBus, Callable[[bytes], Message | None]]]] = {}
        self._tokens: dict[tuple[str, str, str], MemoryBus] = {}
        self._readers: dict[str, list[tuple[MemoryBus, dict[str, str], Inbox]]] = {}
        self._readers_of_key: dict[tuple[str, str], list[tuple[MemoryBus, Inbox]]] = {}
        self._listeners: list[Callable[[Topic, str, bytes], object]] = []

    def bus(
        self, conference: str, site: str, clock: Clock, stale_after_ns: int | None = STALE_AFTER_NS, owners: Owners | None = None
    ) -> MemoryBus:
        """A door for one site. Call it on the event loop. owners: whose messages are believed, None: everybody's."""
        bus = MemoryBus(self, conference, site, clock, stale_after_ns, owners)
        self._buses.append(bus)
        return bus

    def send(self, topic: Topic, key: str, payload: bytes) -> None:
        """Deliver bytes as they are, broken ones too."""
        if topic.delivery is Delivery.RELIABLE:
            self._last[key] = (topic, payload)
        readers = self._readers_of_key.get((topic.name, key))
        if readers is None:
            names = topic.match(key) or {}
            readers = [(bus, inbox) for bus, wanted, inbox in self._readers.get(topic.name, ()) if wanted.items() <= names.items()]
            self._readers_of_key[topic.name, key] = readers
        for bus, inbox in readers:
            bus.deliver(inbox, key, payload)

    def listen(self, heard: Callable[[Topic, str, bytes], object]) -> None:
        """`heard` is called with everything that is published from now on, before anybody receives it; not with what is sent as
        it is."""
        self._listeners.append(heard)

    def published(self, topic: Topic, key: str, payload: bytes) -> None:
        """A message has been put; for publications to call."""
        for heard in self._listeners:
            heard(topic, key, payload)
        self.send(topic, key, payload)

    def wanted(self, topic: Topic) -> bool:
        """Whether anybody subscribes to it."""
        return bool(self._readers.get(topic.name))

    def read(self, bus: MemoryBus, wanted: dict[str, str], inbox: Inbox) -> None:
        """`inbox` of `bus` receives what is sent to the keys that have the names `wanted`."""
        self._readers.setdefault(inbox.topic.name, []).append((bus, wanted, inbox))
        self._readers_of_key.clear()

    def forget(self, inbox: Inbox) -> None:
        """It receives nothing more."""
        readers = self._readers[inbox.topic.name]
        readers[:] = [r for r in readers if r[2] is not inbox]
        self._readers_of_key.clear()

    def history(self, topic: Topic) -> list[tuple[str, bytes]]:
        """The last value of each reliable key of `topic`."""
        return [(key, payload) for key, (t, payload) in self._last.items() if t is topic]

    def answer(self, key: str, request: bytes) -> bytes | None:
        """Ask whoever serves `key`; None when nobody does."""
        reply: Any = None
        for _, answer in self._answers.get(key, []):
            try:
                reply = answer(request)
            except Exception:
                log.exception("query not answered key=%s", key)
            if reply is not None:
                break
        if reply is None:
            return None
        if "header" in reply.DESCRIPTOR.fields_by_name:
            reply.header.version = MESSAGE_VERSION
        return reply.SerializeToString()

    def serve(self, bus: MemoryBus, key: str, answer: Callable[[bytes], Message | None]) -> None:
        """`answer` serves `key` until `bus` leaves."""
        self._answers.setdefault(key, []).append((bus, answer))

    def announce(self, bus: MemoryBus, token: str) -> None:
        """`bus` is present under `token` until it leaves."""
        self._tokens[bus.conference, bus.site, token] = bus
        self._tell(bus.conference, bus.site, token, alive=True)

    def present(self, conference: str) -> list[tuple[str, str]]:
        """(site, token) of all who are present."""
        return [(site, token) for c, site, token in self._tokens if c == conference]

    def leave(self, bus: MemoryBus) -> None:
        """Take everything of `bus` out."""
        if bus in self._buses:
            self._buses.remove(bus)
        self._answers = {key: [a for a in found if a[0] is not bus] for key, found in self._answers.items()}
        for name, owner in list(self._tokens.items()):
            if owner is bus:
                del self._tokens[name]
                self._tell(*name, alive=False)

    def _tell(self, conference: str, site: str, token: str, *, alive: bool) -> None:
        for bus in self._buses:
            bus.presence_changed(conference, site, token, alive)


class MemoryBus:
    """See `vistel.wire.bus.Bus`. Make it with `MemoryNetwork.bus`."""

    def __init__(
        self,
        network: MemoryNetwork,
        conference: str,
        site: str,
        clock: Clock,
        stale_after_ns: int | None,
        owners: Owners | None = None,
    ) -> None:
        self.conference = conference
        self.site = site
        self.counters = BusCounters()
        self.fence = Fence()
        self.uplink = Uplink()
        self._admission = Admission(owners, self.counters)
        self._network = network
        self._clock = clock
        self._stale_after_ns = stale_after_ns
        self._loop = asyncio.get_running_loop()
        self._publications: dict[str, _MemoryPublication] = {}
        self._inboxes: list[Inbox] = []
        self._watchers: list[Callable[[str, str, bool], None]] = []

    @property
    def connected(self) -> bool:
        """As `Bus.connected`: always."""
        return True

    def publish(self, topic: Topic, *, verbatim: bool = False, **names: str) -> Publication:
        """As `Bus.publish`."""
        key = topic.format(**self._filled(topic, names))
        if key not in self._publications:
            self._publications[key] = _MemoryPublication(self._network, topic, key, verbatim, self.fence)
        return self._publications[key]

    def withdraw(self, publisher: Publisher) -> None:
        """As `Bus.withdraw`."""
        for key, publication in list(self._publications.items()):
            if publication.topic.publisher is publisher:
                del self._publications[key]

    def subscribe(self, topic: Topic, *, queue_all: bool = False, polled: bool = False, **names: str) -> Inbox:
        """As `Bus.subscribe`. Raises ValueError for a QUERY topic."""
        if topic.delivery is Delivery.QUERY:
            raise ValueError(f"{topic.name} is asked for with query(), not subscribed to")
        wanted = {"conference": self.conference} | names

        def closed() -> None:
            self._inboxes.remove(inbox)
            self._network.forget(inbox)

        inbox = Inbox(
            topic,
            self.counters,
            self._loop,
            queue_all=queue_all,
            polled=polled,
            stale_after_ns=self._stale_after_ns,
            on_close=closed,
            fence=self.fence,
            admission=self._admission,
        )
        self._inboxes.append(inbox)
        self._network.read(self, wanted, inbox)
        for key, payload in self._network.history(topic):
            found = topic.match(key)
            if found is not None and wanted.items() <= found.items():
                self.deliver(inbox, key, payload)
        return inbox

    async def query(self, topic: Topic, request: Message | None = None, timeout_s: float = 1.0, **names: str) -> Any | None:
        """As `Bus.query`, answered at once: `timeout_s` is not needed."""
        key = topic.format(**self._filled(topic, names))
        await asyncio.sleep(0)
        payload = self._network.answer(key, request.SerializeToString() if request is not None else b"")
        return MessageDecoder(topic, self.counters).decode(key, payload) if payload is not None else None

    def serve(self, topic: Topic, answer: Callable[[bytes], Message | None], **names: str) -> None:
        """As `Bus.serve`."""
        self._network.serve(self, topic.format(**self._filled(topic, names)), answer)

    def announce(self, token: str) -> None:
        """As `Bus.announce`; it goes with `close`."""
        self._network.announce(self, token)

    def watch_presence(self, callback: Callable[[str, str, bool], None]) -> None:
        """As `Bus.watch_presence`."""
        self._watchers.append(callback)
        for site, token in self._network.present(self.conference):
            if self._admission.present(site):
                self._loop.call_soon(callback, site, token, True)

    async def close(self) -> None:
        """Leave; readers end."""
        self._network.leave(self)
        for inbox in list(self._inboxes):
            inbox.close()

    def deliver(self, inbox: Inbox, key: str, payload: bytes) -> None:
        """A message for one of its inboxes has been sent; for the network to call."""
        inbox.push(key, payload, self._clock.now_ns())

    def presence_changed(self, conference: str, site: str, token: str, alive: bool) -> None:
        """Someone came or went; for the network to call."""
        if conference == self.conference and self._admission.present(site):
            for callback in self._watchers:
                self._loop.call_soon(callback, site, token, alive)

    def _filled(self, topic: Topic, names: dict[str, str]) -> dict[str, str]:
        mine = {"conference": self.conference, "site": self.site}
        return {f: mine[f] for f in topic.fields if f in mine} | names


class _MemoryPublication:
    def __init__(self, network: MemoryNetwork, topic: Topic, key: str, verbatim: bool, fence: Fence) -> None:
        self._fence = fence if topic.publisher is Publisher.WORLD else None
        self._network = network
        self.topic = topic
        self._key = key
        self._verbatim = verbatim
        self._seq = 0

    @property
    def next_seq(self) -> int:
        return self._seq + 1

    def put(self, message: Any) -> None:
        """See `vistel.wire.bus.Publication`."""
        header = message.header
        self._seq = max(self._seq + 1, header.seq)
        if not self._verbatim:
            header.version, header.seq = MESSAGE_VERSION, self._seq
            if self._fence is not None and self._fence.own:
                header.term = self._fence.own
        self._network.published(self.topic, self._key, message.SerializeToString())
