"""What arrives on a bus, counted key by key: for who shows how much flows from where."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, cast

from vistel.wire.bus import Bus, Sample, Subscription
from vistel.wire.topics import Delivery, Topic

_MOST_GAP = 500
"""Messages that can be missing at once; more is another sender under the same key, or one that was paused."""


@dataclass
class Arrived:
    """What has arrived under one key. bytes: of the messages, without what the network adds; lost: by the numbers of the sender,
    None where older messages are left out on purpose; sent_ns: `t_ns` of the newest [conference time, ns]."""

    topic: str
    names: dict[str, str]
    lost: int | None
    messages: int = 0
    bytes: int = 0
    sent_ns: int = 0
    _seq: int = field(default=0, repr=False)

    def count(self, message: Any) -> None:
        """One more."""
        self.messages += 1
        self.bytes += message.ByteSize()
        self.sent_ns = max(self.sent_ns, message.header.t_ns)
        missing = message.header.seq - self._seq - 1 if self._seq else 0
        if self.lost is not None and 0 < missing <= _MOST_GAP:
            self.lost += missing
        self._seq = message.header.seq


class Arrivals:
    """Counts what those take who subscribe with `bus`; each topic should be subscribed to there once."""

    def __init__(self, bus: Bus) -> None:
        self.of_key: dict[str, Arrived] = {}
        self.bus = cast("Bus", _CountedBus(bus, self.of_key))

    def begin_again(self) -> None:
        """Time has leapt: numbers of senders do not go on, and nothing has arrived."""
        self.of_key.clear()


class _CountedBus:
    """A bus whose subscriptions count."""

    def __init__(self, bus: Bus, of_key: dict[str, Arrived]) -> None:
        self._bus, self._of_key = bus, of_key

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bus, name)

    def subscribe(self, topic: Topic, *, queue_all: bool = False, polled: bool = False, **names: str) -> Subscription:
        subscription = self._bus.subscribe(topic, queue_all=queue_all, polled=polled, **names)
        all_come = queue_all or topic.delivery is Delivery.RELIABLE
        return cast("Subscription", _CountedSubscription(subscription, self._of_key, lost=0 if all_come else None))


class _CountedSubscription:
    def __init__(self, subscription: Subscription, of_key: dict[str, Arrived], *, lost: int | None) -> None:
        self._subscription, self._of_key, self._lost = subscription, of_key, lost

    def __getattr__(self, name: str) -> Any:
        return getattr(self._subscription, name)

    def take(self) -> list[Sample]:
        samples = self._subscription.take()
        for sample in samples:
            arrived = self._of_key.get(sample.key)
            if arrived is None:
                arrived = self._of_key[sample.key] = Arrived(sample.topic.name, sample.names, self._lost)
            arrived.count(sample.message)
        return samples
