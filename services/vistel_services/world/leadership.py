"""Whether this world may lead its room: it holds the lease, and knows for how long."""

from __future__ import annotations

import asyncio
import logging
import math

from prometheus_client import Counter, Gauge

from vistel.wire import background
from vistel.wire.clock import Clock, sleep, within
from vistel.wire.lease.lease import Holder, Lease, LeaseStoreError
from vistel.wire.world.presence import MOST_TERM

log = logging.getLogger("vistel.world")

MARGIN = 0.2
"""Part of a lease that its holder leaves unused: for a step, and for clocks that do not run alike."""
RENEWALS = 5
"""How often a lease is renewed within its time."""
LOCK_LOOK_S = 1.0
"""How often a lock that has no end is looked at."""
ANSWER_S = 1.0
"""Longest wait for an answer of the store."""

_HELD = Gauge("vistel_world_lease_held_count", "Rooms whose lease this process holds")
_FAILED = Counter("vistel_world_lease_failed_total", "Requests that the lease store did not answer")
_LOST = Counter("vistel_world_lease_lost_total", "Times a lease ended while its world was leading")


class Leadership:
    """Acquires, renews and releases one lease, and reports a store that is gone once."""

    def __init__(self, lease: Lease, clock: Clock) -> None:
        self._lease, self._clock = lease, clock
        self._ends_ns = -math.inf
        self._renewing: asyncio.Task[None] | None = None
        self._gone = False

    @property
    def lasts(self) -> bool:
        """Whether this world may lead at this moment."""
        return self._clock.steady_ns() < self._ends_ns

    async def holder(self) -> Holder | None:
        """What the store knows; None while it is gone."""
        try:
            async with within(self._clock, ANSWER_S):
                known = await self._lease.holder()
        except (LeaseStoreError, TimeoutError) as e:
            self._failed(e)
            return None
        self._answered()
        return known

    async def acquire(self, seen: Holder, above: int) -> int:
        """The term under which this world leads from now on, above `above` and that of `seen`; -1 if it does not."""
        term = max(seen.term, above) + 1
        if term > MOST_TERM:
            log.error("lease not acquired: %d is the last term; start the room anew from a snapshot", MOST_TERM)
            return -1
        began_ns = self._clock.steady_ns()
        try:
            async with within(self._clock, ANSWER_S):
                if not await self._lease.acquire(seen, term):
                    return -1
        except (LeaseStoreError, TimeoutError) as e:
            self._failed(e)
            return -1
        self._answered()
        self._hold(began_ns)
        _HELD.inc()
        self._renewing = background.start(self._renew(), "lease")
        return term

    async def note_led(self) -> bool:
        """Let the store know that the newest steps are here from now on; False if that failed: then this world must not lead."""
        try:
            async with within(self._clock, ANSWER_S):
                return await self._lease.note_led() and self.lasts
        except (LeaseStoreError, TimeoutError) as e:
            self._failed(e)
            return False

    async def release(self) -> None:
        """Lead no longer, and let others."""
        if self._renewing is None:
            return
        if not self.lasts:
            _LOST.inc()
            log.error("lease ended; this world stops leading until it holds the lease again")
        self._renewing.cancel()
        self._renewing, self._ends_ns = None, -math.inf
        _HELD.dec()
        try:
            async with within(self._clock, ANSWER_S):
                await self._lease.release()
        except (LeaseStoreError, TimeoutError) as e:
            self._failed(e)

    async def close(self) -> None:
        """Give back what is open."""
        await self._lease.close()

    async def _renew(self) -> None:
        every_s = min(self._lease.lasts_s / RENEWALS, LOCK_LOOK_S if math.isinf(self._lease.lasts_s) else math.inf)
        while self.lasts:
            await sleep(self._clock, every_s)
            began_ns = self._clock.steady_ns()
            try:
                async with within(self._clock, ANSWER_S):
                    held = await self._lease.renew()
            except (LeaseStoreError, TimeoutError) as e:
                self._failed(e)
                continue
            self._answered()
            if held:
                self._hold(began_ns)
            else:
                self._ends_ns = -math.inf

    def _hold(self, since_ns: int) -> None:
        self._ends_ns = since_ns + (1 - MARGIN) * self._lease.lasts_s * 1e9

    def _failed(self, error: Exception) -> None:
        _FAILED.inc()
        if self._gone:
            return
        self._gone = True
        reason = str(error) or f"no answer within {ANSWER_S:.0f} s"
        if self.lasts:
            left_s = (self._ends_ns - self._clock.steady_ns()) * 1e-9
            log.error("lease store gone reason=%r; this world goes on leading until its lease ends in %.1f s", reason, left_s)
        else:
            log.error("lease store gone reason=%r; no world begins to lead until it is back", reason)

    def _answered(self) -> None:
        if self._gone:
            self._gone = False
            log.info("lease store back")
