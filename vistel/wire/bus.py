"""What a service sees of the bus. `vistel.wire.zenoh.bus` is the real one, `MemoryBus` joins services in one process.

Both deliver messages as protobuf objects of the topic's type, check `Header.version`, and drop and count what
does not parse: a service never sees a broken message.
"""

from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from google.protobuf.message import Message

from vistel.wire.fence import Fence
from vistel.wire.topics import Publisher, Topic
from vistel.wire.uplink import Uplink


class Sample(NamedTuple):
    """One message that arrived.

    names: what the key's braces held (site, participant, device, ...). received_ns: conference time of arrival.
    """

    topic: Topic
    key: str
    names: dict[str, str]
    message: Any
    received_ns: int


class Publication(Protocol):
    """A declared key to put messages on."""

    @property
    def next_seq(self) -> int:
        """The `header.seq` of the message that is put next."""
        ...

    def put(self, message: Message) -> None:
        """Send; never blocks long. Set `header.t_ns` yourself; `header.version` and `header.seq` are filled in here.

        A `header.seq` above the last one is kept, so that a replay can send the numbers it has recorded.
        """
        ...


class Subscription(Protocol):
    """Messages of one topic.

    NEWEST topics keep only the newest per key and drop what is older than 250 ms on arrival after a stall;
    RELIABLE topics keep everything in order.
    """

    def __aiter__(self) -> AsyncIterator[Sample]: ...

    def take(self) -> list[Sample]:
        """What has arrived since the last call, without waiting (NEWEST: at most one per key, unless `queue_all`)."""
        ...

    def close(self) -> None:
        """No more arrives; iteration ends."""
        ...


class Bus(Protocol):
    """A site's connection to the conference. Keys are filled from `conference`, and from `site` for the site's own topics."""

    conference: str
    site: str
    fence: Fence
    """The term under which this side's world publishes, and the terms of what it receives."""
    uplink: Uplink
    """What there is room for on the way to the others."""

    @property
    def connected(self) -> bool:
        """Whether a router is there now."""
        ...

    def publish(self, topic: Topic, *, verbatim: bool = False, **names: str) -> Publication:
        """Declare a key of `topic`; conference and site are filled in unless named.

        verbatim: messages keep the header they have, for a replay of what was recorded.
        """
        ...

    def withdraw(self, publisher: Publisher) -> None:
        """Take back the keys declared as `publisher`, their last values too: another side publishes there now. What is published
        again afterwards is that of a sender who has just begun."""
        ...

    def subscribe(self, topic: Topic, *, queue_all: bool = False, polled: bool = False, **names: str) -> Subscription:
        """Everything on `topic` in this conference; `names` narrow it. RELIABLE topics first deliver the last values.

        `queue_all` makes a NEWEST subscription keep every message in order (recorder, posture); up to 4096, then the oldest go and
        are counted. `polled`: only `take` will be used, so the event loop is not woken for every message.
        """
        ...

    async def query(self, topic: Topic, request: Message | None = None, timeout_s: float = 1.0, **names: str) -> Any | None:
        """Ask the one who serves a QUERY topic; the reply, or None when none came in time. names: those of the topic's own."""
        ...

    def serve(self, topic: Topic, answer: Callable[[bytes], Message | None], **names: str) -> None:
        """Answer queries; `answer` gets the request's bytes and is called on the event loop. None: no answer; someone else may."""
        ...

    def announce(self, token: str) -> None:
        """Declare presence under vistel/{conference}/alive/{site}/{token}; it goes when the process goes."""
        ...

    def watch_presence(self, callback: Callable[[str, str, bool], None]) -> None:
        """`callback(site, token, alive)` on the event loop for every present and future token."""
        ...

    async def close(self) -> None:
        """Leave the conference: nothing arrives any more, and this side's presence ends."""
        ...


@dataclass
class BusCounters:
    """What the bus dropped."""

    received: int = 0
    corrupt: int = 0
    unknown_version: int = 0
    stale: int = 0
    overflow: int = 0
    fenced: int = 0
    """Published for a room by a world that no longer leads it."""
    lost: int = 0
    """Reliable messages whose sender could not repeat them."""
    refused: Counter[str] = field(default_factory=Counter[str])
    """In the name of somebody who belongs to another site (`vistel.wire.owners`), by topic."""


Service = Callable[[Any, "Bus", Any], Awaitable[None]]
"""`async def run(config, bus, clock) -> None`; runs until cancelled and cleans up in `finally`."""
