"""Which of several worlds leads a room, and how it goes from one to another.

A world is present on the bus under a token that holds its term. One that starts asks whoever leads for the room and takes
it over, step for step; one that is overtaken, or has given the room away, falls silent and waits. When it sees nobody of a
higher term any more, it leads again. Receivers drop what a lower term says once a higher one has spoken (`vistel.wire.fence`),
so that a world that was frozen and wakes does no harm.
"""

from __future__ import annotations

import asyncio
import logging
import math
import re
import secrets
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from dataclasses import dataclass
from typing import Any

from google.protobuf.message import DecodeError

from vistel.space.room import Room
from vistel.space.world import World
from vistel.v1.world_pb2 import WorldHandover, WorldHandoverRequest
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME, Publisher

log = logging.getLogger("vistel.world")

ASK_S = 1.0
"""How long a world that starts waits for whoever leads: one that is there answers in milliseconds."""
SUCCESSOR_S = 1.0
"""Who was given the room and is not heard of for so long has failed; the room goes back."""

_TOKEN = re.compile(r"world-(\d{1,9})-([0-9a-f]{8})(-leaving)?")

Listen = Callable[[Sequence[str]], Awaitable[None]]


@dataclass(frozen=True)
class Start:
    """From where a world leads: its state, its term, and when its next step is about [ns]; 0: at once."""

    world: World
    term: int
    due_ns: int = 0


class Authority:
    """One world's place among the worlds of a room. Terms and presence; the steps are the service's."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._me = secrets.token_hex(4)
        self._alive: set[tuple[str, str]] = set()
        self._changed = asyncio.Event()
        self._listener: Callable[[str, str, bool], None] | None = None
        self._leading: World | None = None
        self._due_ns = 0
        self._term = 0
        self._given = 0
        self._served = False
        self._over = asyncio.Event()
        self._leave_by = math.inf
        bus.watch_presence(self._seen)

    def listen(self, listener: Callable[[str, str, bool], None]) -> None:
        """Who is present goes to `listener`, from now on and as it is now."""
        self._listener = listener
        for site, token in sorted(self._alive):
            listener(site, token, True)

    # -- leading -----------------------------------------------------------------------------------------------

    def lead(self, start: Start) -> None:
        """Speak for the room from now on."""
        self._leading, self._term, self._given = start.world, start.term, 0
        self._over.clear()
        self._bus.fence.own = start.term
        self._bus.announce(self._token(start.term))
        if not self._served:
            self._served = True
            self._bus.serve(BY_NAME["world_handover"], self._answer)
        log.info("world leads term=%d step=%d", start.term, start.world.step_number)

    def next_step(self, due_ns: int) -> None:
        """When the step after the last one is about."""
        self._due_ns = due_ns

    @property
    def leads(self) -> bool:
        """Whether this world still speaks for the room."""
        return self._leading is not None and not any(rank > (self._term, self._me) for rank in self._others())

    def retire(self) -> None:
        """Speak no more. What was said last is no longer repeated to who comes late: another world does that."""
        self._leading = None
        self._bus.withdraw(Publisher.WORLD)

    @property
    def followed(self) -> bool:
        """Whether another world waits."""
        return bool(self._others())

    def leave(self, within_s: float) -> None:
        """Tell those who wait that they may take the room over."""
        self._leave_by = asyncio.get_running_loop().time() + within_s
        self._bus.announce(f"{self._token(self._term)}-leaving")

    @property
    def late(self) -> bool:
        """Whether nobody has taken over what this world is leaving in time."""
        return asyncio.get_running_loop().time() >= self._leave_by

    async def until_over(self, other: Coroutine[Any, Any, None]) -> None:
        """Wait for `other`, but no longer than this world leads and has time to leave."""
        tasks = [asyncio.create_task(other), asyncio.create_task(self._over.wait())]
        try:
            left_s = self._leave_by - asyncio.get_running_loop().time()
            await asyncio.wait(tasks, timeout=max(0.0, left_s), return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()

    def _answer(self, request: bytes) -> WorldHandover | None:
        if self._leading is None or not self.leads:
            return None
        try:
            asked = WorldHandoverRequest.FromString(request)
        except DecodeError:
            return None
        out = WorldHandover(private_state=self._leading.snapshot(), term=self._term, due_ns=self._due_ns)
        out.header.t_ns = self._leading.t_ns
        if asked.phase == WorldHandoverRequest.PHASE_TAKE:
            if asked.term <= self._term:
                return None
            log.info("room given away term=%d to_term=%d step=%d", self._term, asked.term, self._leading.step_number)
            self._leading, self._given = None, asked.term
            self._over.set()
        return out

    # -- taking over and waiting -------------------------------------------------------------------------------

    async def take_over(self, begins: Room, listen: Listen) -> Start | None:
        """The room of whoever leads it, who then is silent; None when nobody does. begins: as this side knows the room;
        listen: until all of some people can be heard.

        What costs time is made ready from a first answer, while the other still leads; the second only moves things.
        """
        first = await self._ask(WorldHandoverRequest.PHASE_PREPARE, 0)
        if first is None:
            return None
        try:
            ready = World.restore(first.private_state)
            if (ready.seats, ready.source) != (len(begins.seats), begins.source):
                log.warning("the room that is led is another than the conference file's; it is taken over as it is")
            await listen(ready.participants)
            last = await self._ask(WorldHandoverRequest.PHASE_TAKE, first.term + 1)
            if last is None:
                return None
            world = World.restore(last.private_state, like=ready)
        except ValueError as e:
            log.error("room not taken over reason=%s", e)
            return None
        log.info("room taken over term=%d step=%d", first.term + 1, world.step_number)
        return Start(world, first.term + 1, last.due_ns)

    async def follow(self, own: World, begins: Room, listen: Listen) -> Start:
        """Wait until this world is to lead; `own`: its state when it fell silent."""
        if self._given and not await self._within(SUCCESSOR_S, lambda: any(t >= self._given for t, _ in self._others())):
            log.error("the world that took the room over is not there; leading again term=%d", self._given + 1)
            return Start(own, self._given + 1)
        log.info("world waits term=%d", self._term)
        highest = self._term
        while True:
            above = [rank for rank in self._others() if rank > (self._term, self._me)]
            highest = max([highest, *(term for term, _ in above)])
            if not above:
                return Start(own, highest + 1)
            if any(token == f"world-{t}-{name}-leaving" for t, name in above for _, token in self._alive):
                taken = await self.take_over(begins, listen)
                if taken is not None:
                    return taken
            self._changed.clear()
            await self._changed.wait()

    async def _ask(self, phase: WorldHandoverRequest.Phase, term: int) -> WorldHandover | None:
        return await self._bus.query(
            BY_NAME["world_handover"], WorldHandoverRequest(phase=phase, term=term), timeout_s=ASK_S
        )

    async def _within(self, seconds: float, true: Callable[[], bool]) -> bool:
        try:
            async with asyncio.timeout(seconds):
                while not true():
                    self._changed.clear()
                    await self._changed.wait()
        except TimeoutError:
            return False
        return True

    def _others(self) -> list[tuple[int, str]]:
        """Term and name of the other worlds that are present: those of this side's own site."""
        found = [_TOKEN.fullmatch(token) for site, token in self._alive if site == self._bus.site]
        return [(int(m[1]), m[2]) for m in found if m is not None and m[2] != self._me]

    def _seen(self, site: str, token: str, alive: bool) -> None:
        (self._alive.add if alive else self._alive.discard)((site, token))
        self._changed.set()
        if self._listener is not None:
            self._listener(site, token, alive)

    def _token(self, term: int) -> str:
        return f"world-{term}-{self._me}"
