"""Follows the room over the bus: changes as they come, and the whole of it when something is missing."""

import asyncio
import logging
from collections.abc import Sequence

from vistel.v1.world_pb2 import WorldSnapshotRequest
from vistel.wire import background
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME
from vistel.wire.world.decoder import RoomState, WorldDecoder

log = logging.getLogger("vistel.wire")

PATIENCE_S = 1.0
"""How long to wait for a snapshot [s]."""
AGAIN_NS = 500_000_000
"""From one query to the next [ns]."""


class WorldListener:
    """A subscription to the room. A late joiner, and a receiver that has missed a message, queries a snapshot. `take` is called on
    the event loop and never waits."""

    def __init__(self, bus: Bus, clock: Clock, people: Sequence[str] = ()) -> None:
        """people: whose details are received as well, when more moves than is published to everybody."""
        self._bus, self._clock = bus, clock
        self._details = [bus.subscribe(BY_NAME["world_detail"], queue_all=True, polled=True, participant=p) for p in people]
        self._states = bus.subscribe(BY_NAME["world_state"], queue_all=True, polled=True)
        self._decoder = WorldDecoder()
        self._asking: asyncio.Task[None] | None = None
        self._background = background.current()
        self._ask_ns = clock.now_ns()
        self._from_snapshots: list[tuple[RoomState, int]] = []
        self._logged = 0

    def take(self) -> list[tuple[RoomState, int]]:
        """The steps received since the last call, in order, each with the conference time of its arrival. Steps of one message
        count as if each had arrived as soon as it was done, so that transit times compare."""
        out, self._from_snapshots = self._from_snapshots, []
        states = self._states.take()
        for inbox in self._details:  # each is published before the message it goes with
            for sample in inbox.take():
                self._decoder.receive_detail(sample.message)
        for sample in states:
            steps = self._decoder.read(sample.message)
            newest_ns: int = sample.message.header.t_ns
            out += [(now, sample.received_ns - (newest_ns - now.t_ns)) for now in steps]
        self._look_after()
        return out

    @property
    def right(self) -> bool:
        """Whether the sender has confirmed what is known, and it never differed."""
        return self._decoder.agreed > 0 and self._decoder.differed == 0

    def close(self) -> None:
        """Stop listening."""
        if self._asking is not None:
            self._asking.cancel()
        for inbox in (self._states, *self._details):
            inbox.close()

    def _look_after(self) -> None:
        if self._decoder.differed > self._logged:
            self._logged = self._decoder.differed
            log.error("event=world_differs step=%d action=ask_for_all", self._decoder.now.step)
        if not self._decoder.lost or self._asking is not None or self._clock.now_ns() < self._ask_ns:
            return
        self._asking = self._background.start(self._ask(), "world snapshot")

    async def _ask(self) -> None:
        try:
            snapshot = await self._bus.query(BY_NAME["world_snapshot"], WorldSnapshotRequest(state_only=True), PATIENCE_S)
            now = self._decoder.begin(snapshot) if snapshot is not None else None
            if now is not None:
                self._from_snapshots.append((now, self._clock.now_ns()))
        finally:
            self._ask_ns, self._asking = self._clock.now_ns() + AGAIN_NS, None
