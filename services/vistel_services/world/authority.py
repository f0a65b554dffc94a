"""Which of several worlds leads a room, and how it goes from one to another.

A world is present on the bus under a token that holds its term. One that starts, or is asked to, asks whoever leads for the
room and takes it over, step for step; one that is overtaken, or has given the room away, falls silent and waits. When it sees
nobody of a higher term any more, it leads again, if it has the newest steps: if those lie on the disk of a world that is not
there, it waits for that one. Receivers drop what a lower term publishes once a higher one has published (`vistel.wire.fence`), so
that a world that was frozen and wakes does no harm.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from dataclasses import dataclass
from typing import Any

from google.protobuf.message import DecodeError

from vistel.space.room import Room
from vistel.space.world import World
from vistel.v1.world_pb2 import WorldHandover, WorldHandoverRequest, WorldMoveReply, WorldMoveRequest
from vistel.wire import background
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, within
from vistel.wire.topics import BY_NAME, Publisher
from vistel.wire.world.presence import LEADS, LEAVING, MOST_TERM, WAITS, WorldToken, world_token

log = logging.getLogger("vistel.world")

ASK_S = 1.0
"""How long a world that starts waits for whoever leads: one that is there answers in milliseconds."""
SUCCESSOR_S = 1.0
"""Who was given the room and is not heard of for so long has failed; the room goes back."""

FollowMotion = Callable[[Sequence[str]], Awaitable[None]]
"""Waits until the motion of these participants can be decoded."""


@dataclass(frozen=True)
class Start:
    """From where a world leads: its state, its term, and when its next step is about [ns]; 0: at once."""

    world: World
    term: int
    due_ns: int = 0


@dataclass(frozen=True)
class RestartStates:
    """From where a world that waits can go on. complete: after the last step published under its term; received: the newest state
    that the leader has published since, None if there is none."""

    complete: Callable[[], Start]
    received: Callable[[], World | None]


class Authority:
    """One world's place among the worlds of a room. Terms and presence; the steps are the service's."""

    def __init__(
        self, bus: Bus, clock: Clock, place: str = "hub", on_given: Callable[[int, str], None] = lambda _term, _to: None
    ) -> None:
        """place: where this world is; on_given: called with the term and place of who is given the room, before they get it."""
        self._bus, self._clock, self._place, self._on_given = bus, clock, place, on_given
        self._me = secrets.token_hex(4)
        self._alive: set[tuple[str, str]] = set()
        self._changed = asyncio.Event()
        self._listener: Callable[[str, str, bool], None] | None = None
        self._leading: World | None = None
        self._due_ns = 0
        self._term = -1
        self._given = 0
        self._served = False
        self._over = asyncio.Event()
        self._late = False
        self._wanted = self._forced = False
        self._waits = False
        self._behind = ""
        bus.watch_presence(self._seen)

    def listen(self, listener: Callable[[str, str, bool], None]) -> None:
        """Who is present goes to `listener`, from now on and as it is now."""
        self._listener = listener
        for site, token in sorted(self._alive):
            listener(site, token, True)

    # -- leading -----------------------------------------------------------------------------------------------

    def lead(self, start: Start) -> None:
        """Publish the room from now on."""
        self._leading, self._term, self._given = start.world, start.term, 0
        self._waits, self._behind, self._wanted, self._forced = False, "", False, False
        self._over.clear()
        self._bus.fence.own = start.term
        self._announce(LEADS)
        self._serve()
        log.info("world leads term=%d step=%d place=%s", start.term, start.world.step_number, self._place)

    def next_step(self, due_ns: int) -> None:
        """When the step after the last one is about."""
        self._due_ns = due_ns

    @property
    def leads(self) -> bool:
        """Whether this world still publishes the room."""
        return self._leading is not None and not self.outranked

    def retire(self) -> None:
        """Publish no more. The last messages are no longer repeated to late joiners: another world does that."""
        self._leading = None
        self._bus.withdraw(Publisher.WORLD)

    @property
    def followed(self) -> bool:
        """Whether another world waits."""
        return bool(self._others())

    def leave(self, within_s: float) -> None:
        """Tell those who wait that they may take the room over."""
        self._clock.call_after(within_s, self._run_out)
        self._announce(LEAVING)

    def _run_out(self) -> None:
        self._late = True
        self._over.set()

    @property
    def late(self) -> bool:
        """Whether nobody has taken over what this world is leaving in time."""
        return self._late

    async def until_over(self, other: Coroutine[Any, Any, None]) -> None:
        """Wait for `other`, but no longer than this world leads and has time to leave."""
        tasks = [background.start(other, "step"), background.start(self._over.wait(), "over")]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
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
            if reason := self._objection(asked):
                log.warning("room not given away to=%r to_term=%d reason=%r", asked.place[:64], asked.term, reason)
                return None
            log.info(
                "room given away term=%d to_term=%d to=%s step=%d", self._term, asked.term, asked.place, self._leading.step_number
            )
            self._on_given(asked.term, asked.place)
            self._leading, self._given = None, asked.term
            self._over.set()
        return out

    def _objection(self, asked: WorldHandoverRequest) -> str:
        """Why the room is not given to who asks for it; empty where it is."""
        if asked.term != self._term + 1:
            return f"term {self._term + 1} comes next"
        if asked.term > MOST_TERM:
            return f"{MOST_TERM} is the last term; start the room anew from a snapshot"
        if not any(doing == WAITS and place == asked.place for _, _, doing, place in self._others()):
            return "no world waits at that place"
        return ""

    # -- taking over and waiting -------------------------------------------------------------------------------

    async def take_over(self, begins: Room, follow_motion: FollowMotion) -> Start | None:
        """The room of whoever leads it, who then is silent; None when nobody does. begins: as this side knows the room;
        follow_motion: see FollowMotion.

        What costs time is made ready from a first answer, while the other still leads; the second only moves things. The other
        gives its room only to a world whose presence it sees.
        """
        self._wait()
        first = await self._ask(WorldHandoverRequest.PHASE_PREPARE, 0)
        if first is None:
            return None
        try:
            ready = World.restore(first.private_state)
            if (ready.seats, ready.source) != (len(begins.seats), begins.source):
                log.warning("the room that is led is another than the conference file's; it is taken over as it is")
            await follow_motion(ready.participants)
            last = await self._ask(WorldHandoverRequest.PHASE_TAKE, first.term + 1)
            if last is None:
                return None
            world = World.restore(last.private_state, like=ready)
        except ValueError as e:
            log.error("room not taken over reason=%s", e)
            return None
        log.info("room taken over term=%d step=%d", first.term + 1, world.step_number)
        return Start(world, first.term + 1, last.due_ns)

    def resume(self, term: int) -> None:
        """This world has all steps that were published under `term`: it counts as having led then."""
        self._term = max(self._term, term)

    @property
    def outranked(self) -> bool:
        """Whether a world of a higher term is there, leading or not."""
        return any(rank > (self._term, self._me) for rank in self._ranks())

    async def somebody(self, within_s: float) -> bool:
        """Wait until another world leads or waits; False when none has come within that time, or this one is asked to lead."""
        self._wait()
        await self._within(within_s, lambda: self._wanted or bool(self._ranks()))
        return bool(self._ranks())

    async def follow(
        self, states: RestartStates, begins: Room, follow_motion: FollowMotion, newest: tuple[int, str] = (-1, "")
    ) -> Start:
        """Wait until this world is to lead. newest: highest term that is known of, and where it was led."""
        if self._given and not await self._within(SUCCESSOR_S, lambda: any(t >= self._given for t, _ in self._ranks())):
            log.error("the world that took the room over is not there; leading again term=%d", self._given + 1)
            return Start(states.complete().world, self._given + 1)
        newest = max(newest, (self._given, ""))
        self._wait()
        log.info("world waits term=%d place=%s", self._term, self._place)
        while True:
            above = sorted(t for t in self._others() if t[:2] > (self._term, self._me) and t[2] != WAITS)
            if above:
                newest, self._behind = max(newest, (above[-1][0], above[-1][3])), ""
                if self._wanted or any(doing == LEAVING for _, _, doing, _ in above):
                    taken = await self.take_over(begins, follow_motion)
                    if taken is not None:
                        return taken
                    self._wanted = False
            else:
                found = states.complete()
                if found.term >= newest[0]:
                    return Start(found.world, max(found.term, self._term) + 1)
                if self._forced:
                    world = max(found.world, states.received() or found.world, key=lambda w: w.step_number)
                    log.error(
                        "leading by force term=%d step=%d; all later steps, at %s, are lost",
                        newest[0] + 1,
                        world.step_number,
                        newest[1],
                    )
                    return Start(world, newest[0] + 1)
                self._fall_behind(newest, found.world.step_number)
            self._changed.clear()
            await self._changed.wait()

    def _fall_behind(self, newest: tuple[int, str], step: int) -> None:
        """Log once that this world does not have the newest steps."""
        if not self._behind:
            self._behind = (
                f"the newest steps are at {newest[1] or 'another place'} (term {newest[0]}), where no world is; here is step {step}"
            )
            log.error("room waits reason=%r mend='start the world there again, or move the room here by force'", self._behind)

    def _wait(self) -> None:
        if not self._waits:
            self._waits = True
            self._announce(WAITS)
            self._serve()

    def _moved(self, request: bytes) -> WorldMoveReply | None:
        """Somebody wants the room to be here."""
        try:
            asked = WorldMoveRequest.FromString(request)
        except DecodeError:
            return None
        if asked.place != self._place:
            return None
        if self._leading is not None and self.leads:
            return WorldMoveReply(outcome=WorldMoveReply.OUTCOME_LEADS, step=self._leading.step_number)
        if not self._waits:
            return None
        if self._behind and not asked.force:
            return WorldMoveReply(outcome=WorldMoveReply.OUTCOME_BEHIND, reason=self._behind)
        self._wanted, self._forced = True, asked.force
        self._changed.set()
        return WorldMoveReply(outcome=WorldMoveReply.OUTCOME_MOVING)

    async def _ask(self, phase: WorldHandoverRequest.Phase, term: int) -> WorldHandover | None:
        request = WorldHandoverRequest(phase=phase, term=term, place=self._place)
        return await self._bus.query(BY_NAME["world_handover"], request, timeout_s=ASK_S)

    async def _within(self, seconds: float, true: Callable[[], bool]) -> bool:
        try:
            async with within(self._clock, seconds):
                while not true():
                    self._changed.clear()
                    await self._changed.wait()
        except TimeoutError:
            return False
        return True

    # -- presence ----------------------------------------------------------------------------------------------

    def _others(self) -> list[tuple[int, str, str, str]]:
        """Term, name, what they do and place of the other worlds that are present: those of this side's own site."""
        found = [world_token(token) for site, token in self._alive if site == self._bus.site]
        return [(t.term, t.name, t.doing, t.place) for t in found if t is not None and t.name != self._me]

    def _ranks(self) -> list[tuple[int, str]]:
        """Term and name of those that lead or have led."""
        return [(term, name) for term, name, doing, _ in self._others() if doing != WAITS]

    def _seen(self, site: str, token: str, alive: bool) -> None:
        (self._alive.add if alive else self._alive.discard)((site, token))
        self._changed.set()
        if self._listener is not None:
            self._listener(site, token, alive)

    def _announce(self, doing: str) -> None:
        self._bus.announce(WorldToken(max(0, self._term), self._me, doing, self._place).text)

    def _serve(self) -> None:
        if not self._served:
            self._served = True
            self._bus.serve(BY_NAME["world_handover"], self._answer)
            self._bus.serve(BY_NAME["world_move"], self._moved)
