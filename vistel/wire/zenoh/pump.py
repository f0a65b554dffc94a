"""A thread that carries what a Zenoh subscription receives into Python, a burst at a time.

Zenoh puts samples into a ring that drops its oldest when it is full, so that a process that is busy never holds up the network: its
own other subscriptions, the router, or anyone behind it. The thread takes all that lies there at once: a process whose event loop
computes for 30 ms has to be interrupted once, not once per message.
"""

# zenoh's stubs leave return types out
# pyright: reportUnknownMemberType=false
import contextlib
import logging
import threading
from collections.abc import Callable

import zenoh

from vistel.wire.zenoh.at_exit import started

log = logging.getLogger("vistel.bus")

BURST = 512
RING = 1024
"""Samples that wait for the thread. A ring's memory, a quarter of a kilobyte for each, is used all round: it grows until the ring
has been filled once, which takes hours where the ring is large and messages are few."""


class Pump:
    """Subscribes to `pattern` and calls `deliver` with lists of samples, in order, on a thread of its own."""

    def __init__(
        self, session: zenoh.Session, pattern: str, deliver: Callable[[list[zenoh.Sample]], None], capacity: int = RING
    ) -> None:
        """capacity: samples that wait; beyond that the oldest go."""
        self._deliver = deliver
        ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(capacity)
        self._subscriber = session.declare_subscriber(pattern, ring)
        started(threading.Thread(target=self._run, name=f"bus {pattern}", daemon=True))

    def undeclare(self) -> None:
        """Stop; the thread ends."""
        with contextlib.suppress(zenoh.ZError):
            self._subscriber.undeclare()

    def _run(self) -> None:
        received = self._subscriber.handler  # the subscriber itself would stay borrowed while it waits
        while True:
            try:
                sample: zenoh.Sample | None = received.recv()
                burst: list[zenoh.Sample] = []
                while sample is not None and len(burst) < BURST:
                    burst.append(sample)
                    sample = received.try_recv()
                if sample is not None:
                    burst.append(sample)
            except zenoh.ZError:
                return  # undeclared, or the session was closed
            try:
                self._deliver(burst)
            except Exception:
                log.exception("messages not delivered count=%d", len(burst))
