"""A reliable subscription over Zenoh: history first, then order, and repair of what the network dropped.

What arrives while too much waits already (a reader that does not read, an event loop that computes) is dropped as if the
network had dropped it: the gap is seen at the next message or heartbeat and the sender asked again. What a sender has
meanwhile let go of (`vistel.wire.reliable.CACHE_MESSAGES`, `CACHE_BYTES`) is counted as lost and logged.
"""

# zenoh's stubs leave return types out
# pyright: reportUnknownMemberType=false
import asyncio
import contextlib
import logging
import threading
from collections import Counter, deque

import zenoh

from vistel.wire import background
from vistel.wire import inbox as inboxes
from vistel.wire.bus import BusCounters
from vistel.wire.clock import Clock
from vistel.wire.inbox import Inbox, wake
from vistel.wire.reliable import Quota, ReceiveOrder, Stamp
from vistel.wire.zenoh.pump import Pump

log = logging.getLogger("vistel.bus")

RETRY_S = 0.25
GONE_S = 30.0
"""A gap is declared lost when nothing was heard of its sender for so long, with a router there: it is gone. One that was started
again is known at once; one behind a link that is cut comes back."""
PATIENCE_S = 120.0
"""The same with a sender that is heard: it, or what is between, is only too busy to answer in time."""

MOST_REPAIRS = 64
"""Keys of one sender whose gaps are repaired at once. For the others it is asked at the sender's next word."""

LOG_S = 1.0
"""Losses are logged together, once in so many seconds."""

_Arrival = tuple[str, Stamp, bytes, int, bool]


class ReliableReader:
    """Feeds an inbox with the messages of `pattern`, each once and in the order of its sender."""

    def __init__(
        self,
        session: zenoh.Session,
        pattern: str,
        inbox: Inbox,
        *,
        loop: asyncio.AbstractEventLoop,
        clock: Clock,
        counters: BusCounters,
    ) -> None:
        self._session = session
        self._pattern = pattern
        self._loop = loop
        self._clock = clock
        self._inbox = inbox
        self._counters = counters
        self._orders: dict[str, ReceiveOrder] = {}
        self._quota = Quota()
        self._lost: dict[str, int] = {}
        self._repairs: dict[str, asyncio.Task[None]] = {}
        self._repairing: Counter[str] = Counter()
        self._lock = threading.Lock()  # of the next three
        self._arrivals: deque[_Arrival] = deque()
        self._arrived_bytes = 0
        self._woken = False
        self._history_done = False
        self._closed = False
        self._background = background.current()
        self._pump = Pump(session, pattern, self._arrived)  # what its ring drops leaves a gap, which is asked for again
        self._history = self._background.start(self._ask_for_history(), f"history {pattern}")

    def undeclare(self) -> None:
        """Stop."""
        self._closed = True
        self._history.cancel()
        for task in self._repairs.values():
            task.cancel()
        self._pump.undeclare()

    def _arrived(self, burst: list[zenoh.Sample], repeated: bool = False) -> None:
        """On another thread: note it and wake the loop, once per burst."""
        now_ns = self._clock.now_ns()
        with self._lock:
            for sample in burst:
                key = str(sample.key_expr)
                if not self._inbox.admits(key, now_ns):
                    continue
                stamp = Stamp.from_bytes(sample.attachment.to_bytes()) if sample.attachment is not None else None
                if stamp is None:
                    self._counters.corrupt += 1
                elif len(self._arrivals) >= inboxes.RELIABLE_LIMIT or self._arrived_bytes >= inboxes.RELIABLE_BYTES:
                    self._counters.overflow += 1
                else:
                    payload = sample.payload.to_bytes()
                    self._arrivals.append((key, stamp, payload, now_ns, repeated))
                    self._arrived_bytes += len(payload)
            if self._woken:
                return
            self._woken = True
        wake(self._loop, self._drain)

    def _drain(self) -> None:
        """Put in order what has arrived and hand it on, unless the reader is behind."""
        while (arrival := self._next_arrival()) is not None:
            key, stamp, payload, now_ns, repeated = arrival
            order = self._orders.get(key)
            if order is None:
                # A key that was not in the history began after this subscription: everything it said counts.
                from_last = repeated or not self._history_done
                order = self._orders[key] = ReceiveOrder.starting(stamp, from_last=from_last, quota=self._quota)
            lost_before = order.lost
            for message in order.offer(stamp, payload):
                self._inbox.push(key, message, now_ns)
            self._report_lost(key, order.lost - lost_before)
            if order.missing() and key not in self._repairs and not self._closed and self._repairing[_sender(key)] < MOST_REPAIRS:
                self._repairing[_sender(key)] += 1
                self._repairs[key] = self._background.start(self._repair(key, order), f"repair {key}")

    def _next_arrival(self) -> _Arrival | None:
        with self._lock:
            if not self._arrivals or self._inbox.full:
                self._woken = False
                return None
            arrival = self._arrivals.popleft()
            self._arrived_bytes -= len(arrival[2])
            return arrival

    async def _ask_for_history(self) -> None:
        while not self._closed:
            if self._session.info.routers_zid():
                await self._ask(self._pattern, 2.0)
                self._drain()
                self._history_done = True
                return
            await asyncio.sleep(0.05)

    async def _repair(self, key: str, order: ReceiveOrder) -> None:
        heard, asked_s = order.heard, self._loop.time()
        heard_s = asked_s
        try:
            while (gap := order.missing()) and not self._closed:
                if self._inbox.full:
                    await asyncio.sleep(RETRY_S)
                    self._drain()
                    continue
                before = (order.epoch, order.next)
                await self._ask(f"{key}?epoch={order.epoch};from={gap[0]};to={gap[1]}", 1.0)
                self._drain()
                now_s = self._loop.time()
                progress = (order.epoch, order.next) != before
                if progress or not self._session.info.routers_zid():
                    asked_s = heard_s = now_s
                if order.heard != heard:
                    heard, heard_s = order.heard, now_s
                if now_s - heard_s >= GONE_S or now_s - asked_s >= PATIENCE_S:
                    lost_before = order.lost
                    for message in order.give_up():
                        self._inbox.push(key, message, self._clock.now_ns())
                    self._report_lost(key, order.lost - lost_before)
                    if order.missing() is None or not order.waiting:
                        order.skip_to(order.highest + 1)
                    asked_s = heard_s = now_s
                elif not progress:
                    await asyncio.sleep(RETRY_S)
        finally:
            self._repairs.pop(key, None)
            self._repairing[_sender(key)] -= 1

    async def _ask(self, selector: str, timeout_s: float) -> None:
        """Send a request; the answers come in through `_arrived`. Returns when all who could answer have."""
        done = asyncio.Event()

        def reply(r: zenoh.Reply) -> None:
            if r.ok is not None:
                self._arrived([r.ok], repeated=True)

        self._session.get(
            selector,
            zenoh.handlers.Callback(reply, lambda: wake(self._loop, done.set)),
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.INTERACTIVE_HIGH,
            timeout=timeout_s,
        )
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(timeout_s + 0.5):
                await done.wait()

    def _report_lost(self, key: str, count: int) -> None:
        if not count:
            return
        self._counters.lost += count
        if not self._lost:
            self._loop.call_later(LOG_S, self._log_lost)
        self._lost[key] = self._lost.get(key, 0) + count

    def _log_lost(self) -> None:
        for key, count in self._lost.items():
            log.error("reliable messages lost key=%s count=%d", key, count)
        self._lost.clear()


def _sender(key: str) -> str:
    """The site, or world, whose key it is."""
    return "/".join(key.split("/", 4)[:4])
