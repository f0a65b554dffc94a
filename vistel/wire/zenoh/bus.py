"""The bus over Eclipse Zenoh: client sessions of one router, which may live in this process or be far away.

How a topic travels:

- NEWEST: dropped rather than queued, everywhere; the reader gets the newest value per key and nothing that is
  late.
- RELIABLE: `vistel.wire.reliable` over messages that may be dropped too. Zenoh's own blocking delivery would
  close
  the link of a slow reader and stall every other one, and its own recovery was seen to hold commands back for
  10 s.
- QUERY: Zenoh queries.
- Presence: Zenoh liveliness tokens, which go when a process goes (a frozen one after the lease of 2 s).
"""

# zenoh's stubs leave return types out
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false
import asyncio
import contextlib
import logging
import secrets
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from weakref import WeakSet

import zenoh
from google.protobuf.message import DecodeError, Message

from vistel.wire import background
from vistel.wire.bus import BusCounters, Publication
from vistel.wire.clock import Clock
from vistel.wire.fence import Fence
from vistel.wire.inbox import QUEUE_LIMIT, STALE_AFTER_NS, Inbox, wake
from vistel.wire.owners import Admission, Owners
from vistel.wire.topics import MESSAGE_VERSION, Delivery, Publisher, Topic
from vistel.wire.uplink import Uplink
from vistel.wire.zenoh.at_exit import close_at_exit, closed
from vistel.wire.zenoh.config import Json, TlsFiles, as_text, router_config
from vistel.wire.zenoh.endpoints import free_port
from vistel.wire.zenoh.gate import Gate
from vistel.wire.zenoh.publication import ZenohPublication, undeclare
from vistel.wire.zenoh.pump import RING, Pump
from vistel.wire.zenoh.reliable_reader import ReliableReader
from vistel.wire.zenoh.session import BusError, check_endpoints, close_session, open_session, reason

log = logging.getLogger("vistel.bus")

BEAT_S = 1.0
"""A reliable key that was silent for so long repeats the number of its last message [s]."""

MOST_TOKENS = 256
"""Of one site, whose presence is told."""


class Router:
    """A router inside this process. It publishes and subscribes nothing: a reader that is slow cannot slow it down."""

    def __init__(self, session: zenoh.Session, endpoints: list[str]) -> None:
        self._session = session
        self.endpoints = endpoints
        close_at_exit(self, self.close)

    @property
    def endpoint(self) -> str:
        """Where clients on this machine find it."""
        return self.endpoints[0]

    @property
    def is_linked(self) -> bool:
        """Whether it has a link to another router."""
        return bool(self._session.info.routers_zid())

    @staticmethod
    def open(
        listen: str | Sequence[str] | None = None,
        *,
        tls: TlsFiles | tuple[str, str, str] | None = None,
        access: Json | None = None,
        connect: Sequence[str] = (),
    ) -> "Router":
        """Listen on `listen` ("quic/host:port", "tls/…", "tcp/…"), by default on a free port of the loopback interface.

        access: who may publish what (`vistel.wire.zenoh.access`). connect: further routers to join. Raises BusError.
        """
        endpoints = [listen] if isinstance(listen, str) else list(listen or [f"tcp/127.0.0.1:{free_port()}"])
        check_endpoints(endpoints)
        config = router_config(endpoints, _tls(tls), access, list(connect))
        try:
            session = zenoh.open(zenoh.Config.from_json5(as_text(config)))
        except zenoh.ZError as e:
            raise BusError(f"bus: cannot listen on {', '.join(endpoints)}: {reason(e)}") from e
        return Router(session, endpoints)

    def close(self) -> None:
        """Stop routing; clients keep trying to come back to the same endpoint."""
        closed(self)
        close_session(self._session)


class ZenohBus:
    """A site's connection to the conference (`vistel.wire.bus.Bus`). Make it with `open`, on the event loop that will use it."""

    def __init__(
        self,
        session: zenoh.Session,
        conference: str,
        site: str,
        clock: Clock,
        *,
        loop: asyncio.AbstractEventLoop,
        gate: Gate | None = None,
        stale_after_ns: int | None = STALE_AFTER_NS,
        owners: Owners | None = None,
    ) -> None:
        self.conference = conference
        self.site = site
        self.counters = BusCounters()
        self.fence = Fence()
        self.uplink = Uplink()
        self._admission = Admission(owners, self.counters)
        self._session = session
        self._gate = gate
        self._clock = clock
        self._loop = loop
        self._stale_after_ns = stale_after_ns
        self._epoch = secrets.randbits(63) | 1
        self._publications: dict[str, ZenohPublication] = {}
        self._readers: list[ReliableReader] = []
        self._inboxes = WeakSet[Inbox]()
        self._held: list[Any] = []  # zenoh undeclares what nobody refers to
        self._subscribed: list[list[Any]] = []  # the same, until they are closed
        self._beating: asyncio.Task[None] | None = None
        self._background = background.current()
        close_at_exit(self, self._close_now)

    @staticmethod
    async def open(
        *,
        conference: str,
        site: str,
        clock: Clock,
        endpoints: Sequence[str],
        tls: TlsFiles | tuple[str, str, str] | None = None,
        connect_s: float = 10.0,
        stale_after_ns: int | None = STALE_AFTER_NS,
        owners: Owners | None = None,
    ) -> "ZenohBus":
        """Connect to the first router of `endpoints` that answers within `connect_s`. Raises BusError.

        Where none answers over the protocol of the first endpoint (a network without UDP), the next protocol gets its share of that
        time, and the session stays with the protocol that was answered.

        tls: (ca, certificate, key) files. stale_after_ns: None shows late motion too (for a reader of the
        past). owners: whose messages are believed, None: everybody's; `vistel.conference.connect` has them from the file.
        """
        check_endpoints(endpoints)
        session, gate = await open_session(endpoints, _tls(tls), connect_s)
        loop = asyncio.get_running_loop()
        return ZenohBus(session, conference, site, clock, loop=loop, gate=gate, stale_after_ns=stale_after_ns, owners=owners)

    @property
    def connected(self) -> bool:
        """Whether a router is there now."""
        return not self._session.is_closed() and bool(self._session.info.routers_zid())

    def publish(self, topic: Topic, *, verbatim: bool = False, **names: str) -> Publication:
        """As `Bus.publish`. The first RELIABLE key starts the heartbeat, by which receivers notice what they have lost."""
        key = topic.format(**self._filled(topic, names))
        found = self._publications.get(key)
        if found is None:
            found = ZenohPublication(self._session, topic, key, self._epoch, verbatim, self.fence, self.uplink)
            self._publications[key] = found
            if topic.delivery is Delivery.RELIABLE and self._beating is None:
                self._beating = self._background.start(self._beat(), "bus heartbeat")
        return found

    def withdraw(self, publisher: Publisher) -> None:
        """As `Bus.withdraw`."""
        for key, publication in list(self._publications.items()):
            if publication.topic.publisher is publisher:
                del self._publications[key]
                publication.undeclare()
        # Receivers know senders by their epoch, and listen to none again that another one has followed.
        self._epoch = secrets.randbits(63) | 1

    def subscribe(self, topic: Topic, *, queue_all: bool = False, polled: bool = False, **names: str) -> Inbox:
        """As `Bus.subscribe`. Raises ValueError for a QUERY topic."""
        if topic.delivery is Delivery.QUERY:
            raise ValueError(f"{topic.name} is asked for with query(), not subscribed to")
        held: list[Any] = []
        inbox = Inbox(
            topic,
            self.counters,
            self._loop,
            queue_all=queue_all,
            polled=polled,
            stale_after_ns=self._stale_after_ns,
            on_close=lambda: self._unsubscribe(held),
            fence=self.fence,
            admission=self._admission,
        )
        self._inboxes.add(inbox)
        pattern = topic.pattern(self.conference, **names)
        if topic.delivery is Delivery.RELIABLE:
            reader = ReliableReader(self._session, pattern, inbox, loop=self._loop, clock=self._clock, counters=self.counters)
            self._readers.append(reader)
            held.append(reader)
            return inbox

        def arrived(burst: list[zenoh.Sample]) -> None:
            now_ns = self._clock.now_ns()
            inbox.push_all([(str(s.key_expr), s.payload.to_bytes(), now_ns) for s in burst])

        held.append(Pump(self._session, pattern, arrived, QUEUE_LIMIT if queue_all else RING))
        self._subscribed.append(held)
        return inbox

    @property
    def waiting(self) -> dict[str, int]:
        """How many messages of each subscribed topic have arrived and were not taken."""
        out = dict[str, int]()
        for inbox in self._inboxes:
            out[inbox.topic.name] = out.get(inbox.topic.name, 0) + inbox.waiting
        return out

    def _unsubscribe(self, held: list[Any]) -> None:
        undeclare(held)
        self._subscribed = [other for other in self._subscribed if other is not held]

    async def query(self, topic: Topic, request: Message | None = None, timeout_s: float = 1.0, **names: str) -> Any | None:
        """As `Bus.query`: the first valid answer of all who serve the topic."""
        key = topic.format(**self._filled(topic, names))
        answered: asyncio.Future[Any | None] = self._loop.create_future()

        def settle(message: Any | None) -> None:
            if not answered.done():
                answered.set_result(message)

        def reply(r: zenoh.Reply) -> None:
            message = self._parse_reply(topic, r)
            if message is not None:
                wake(self._loop, lambda: settle(message))

        self._session.get(
            key,
            zenoh.handlers.Callback(reply, lambda: wake(self._loop, lambda: settle(None))),
            payload=request.SerializeToString() if request is not None else None,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.INTERACTIVE_HIGH,
            timeout=timeout_s,
        )
        try:
            async with asyncio.timeout(timeout_s):
                return await answered
        except TimeoutError:
            return None

    def serve(self, topic: Topic, answer: Callable[[bytes], Message | None], **names: str) -> None:
        """As `Bus.serve`. An exception of `answer` is logged, and there is no answer."""
        key = topic.format(**self._filled(topic, names))

        def on_loop(query: zenoh.Query) -> None:
            with query:
                try:
                    message: Any = answer(query.payload.to_bytes() if query.payload is not None else b"")
                except Exception:
                    log.exception("query not answered topic=%s", topic.name)
                    return
                if message is None:
                    return
                if "header" in message.DESCRIPTOR.fields_by_name:
                    message.header.version = MESSAGE_VERSION
                with contextlib.suppress(zenoh.ZError):  # the one who asked has gone
                    query.reply(key, message.SerializeToString())

        self._held.append(self._session.declare_queryable(key, lambda query: wake(self._loop, lambda: on_loop(query))))

    def announce(self, token: str) -> None:
        """As `Bus.announce`."""
        key = f"vistel/{self.conference}/alive/{self.site}/{token}"
        self._held.append(self._session.liveliness().declare_token(key))

    def watch_presence(self, callback: Callable[[str, str, bool], None]) -> None:
        """As `Bus.watch_presence`."""
        present: set[str] = set()

        def on_loop(key: str, site: str, token: str, alive: bool) -> None:
            full = alive and sum(k.startswith(key[: -len(token)]) for k in present) >= MOST_TOKENS
            if full or alive == (key in present):
                return
            (present.add if alive else present.discard)(key)
            callback(site, token, alive)

        def changed(sample: zenoh.Sample) -> None:
            key, alive = str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT
            _, _, _, site, token = (*key.split("/", 4), "", "")[:5]
            if token and self._admission.present(site):
                wake(self._loop, lambda: on_loop(key, site, token, alive))

        pattern = f"vistel/{self.conference}/alive/**"
        self._held.append(self._session.liveliness().declare_subscriber(pattern, changed, history=True))

    async def close(self) -> None:
        """Leave the conference; takes at most two seconds, also when the network hangs."""
        if self._beating is not None:
            self._beating.cancel()
        for reader in self._readers:
            reader.undeclare()
        await asyncio.to_thread(self._close_now)

    def _close_now(self) -> None:
        closed(self)
        if self._gate is not None:
            self._gate.close()
        self._held.clear()
        self._subscribed.clear()
        close_session(self._session)

    def _filled(self, topic: Topic, names: dict[str, str]) -> dict[str, str]:
        mine = {"conference": self.conference, "site": self.site}
        return {f: mine[f] for f in topic.fields if f in mine} | names

    def _parse_reply(self, topic: Topic, reply: zenoh.Reply) -> Any | None:
        if reply.ok is None:
            return None
        message: Any = topic.message()
        try:
            message.ParseFromString(reply.ok.payload.to_bytes())
        except DecodeError:
            self.counters.corrupt += 1
            return None
        has_header = "header" in topic.message.DESCRIPTOR.fields_by_name
        if has_header and message.header.version != MESSAGE_VERSION:
            self.counters.unknown_version += 1
            return None
        return message

    async def _beat(self) -> None:
        while True:
            await asyncio.sleep(BEAT_S)
            for publication in list(self._publications.values()):
                publication.beat()


def _tls(tls: TlsFiles | tuple[str, str, str] | None) -> TlsFiles | None:
    return TlsFiles(*(Path(p) for p in tls)) if isinstance(tls, tuple) else tls
