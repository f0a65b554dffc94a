"""Which of several worlds leads a room, and how the room goes from one to another.

Whoever holds the room's lease leads, under the lease's fencing token, the *term* (`vistel.wire.lease`). Who leads next
must have the newest steps: from a disk, or from the world that led last, which gives them over the bus and takes no further
step. If they lie on the disk of a world that is not there, the room waits for that one. A world is present on the bus under a
token that holds its term and place: that says who can be asked, never who may lead. Receivers drop what a lower term publishes
once a higher one has published (`vistel.wire.fence`), so that a world that was frozen and wakes does no harm.
"""

from __future__ import annotations

import asyncio
import contextlib
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
from vistel.wire.lease.lease import Holder
from vistel.wire.topics import BY_NAME, Publisher
from vistel.wire.world.presence import LEADS, LEAVING, WAITS, WorldToken, world_token
from vistel_services.world.leadership import Leadership

log = logging.getLogger("vistel.world")

ASK_S = 1.0
"""How long a world waits for one that has the newest steps: one that is there answers in milliseconds."""
SUCCESSOR_S = 1.0
"""For so long who gave the room away leaves the lease to who was given it, and others leave it to who has the newest steps."""
LOOK_S = 0.25
"""How often a world that waits looks at the lease."""
SOON_S = 0.02
"""How often it does while it has just been given the room."""
NEVER_NS = -(1 << 62)
"""Before every time."""

FollowMotion = Callable[[Sequence[str]], Awaitable[None]]
"""Waits until the motion of these participants can be decoded."""


@dataclass(frozen=True)
class Start:
    """A state of the room: the world, the term under which it was published last or is from now on, and when its next step is
    about [ns]; 0: at once."""

    world: World
    term: int
    due_ns: int = 0

    @property
    def newness(self) -> tuple[int, int]:
        """Of two states the greater one is the newer."""
        return self.term, self.world.step_number


@dataclass(frozen=True)
class RestartStates:
    """From where a world that waits can go on. kept: what its disk has, or the room as it begins; received: the newest state that
    the leader has published since, None if there is none."""

    kept: Callable[[], Start]
    received: Callable[[], World | None]


class Authority:
    """One world's place among the worlds of a room. Who leads, and presence; the steps are the service's."""

    def __init__(
        self, bus: Bus, clock: Clock, leadership: Leadership, place: str = "hub", on_given: Callable[[], None] = lambda: None
    ) -> None:
        """place: where this world is; on_given: called before somebody is given the room."""
        self._bus, self._clock, self._leadership, self._place, self._on_given = bus, clock, leadership, place, on_given
        self._me = secrets.token_hex(4)
        self._alive: set[tuple[str, str]] = set()
        self._changed = asyncio.Event()
        self._listener: Callable[[str, str, bool], None] | None = None
        self._steps: Start | None = None
        self._leading = False
        self._due_ns = 0
        self._gave_ns = NEVER_NS
        self._served = False
        self._over = asyncio.Event()
        self._late = False
        self._wanted = self._forced = False
        self._waits = False
        self._behind = ""
        self._told = self._looked = False
        bus.watch_presence(self._seen)

    def listen(self, listener: Callable[[str, str, bool], None]) -> None:
        """Who is present goes to `listener`, from now on and as it is now."""
        self._listener = listener
        for site, token in sorted(self._alive):
            listener(site, token, True)

    # -- leading -----------------------------------------------------------------------------------------------

    async def lead(self, start: Start) -> None:
        """Publish the room from now on, as long as `leads`. What a restart begins from is on the disk already."""
        self._steps, self._due_ns = start, start.due_ns
        self._waits, self._behind, self._wanted, self._forced, self._told = False, "", False, False, False
        self._over.clear()
        self._leading = await self._leadership.note_led()
        if self._leading:
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
        return self._leading and self._leadership.lasts

    async def retire(self) -> None:
        """Publish no more. The last messages are no longer repeated to late joiners: another world does that."""
        self._leading = False
        self._bus.withdraw(Publisher.WORLD)
        await self._leadership.release()

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
        try:
            asked = WorldHandoverRequest.FromString(request)
        except DecodeError:
            return None
        steps = self._steps
        if steps is None or asked.term != steps.term:
            return None
        if asked.phase == WorldHandoverRequest.PHASE_TAKE:
            if not any(doing == WAITS and place == asked.place for _, _, doing, place in self._others()):
                log.warning("room not given away to=%r reason='no world waits at that place'", asked.place[:64])
                return None
            log.info("room given away term=%d to=%s step=%d", steps.term, asked.place, steps.world.step_number)
            self._on_given()
            self._leading, self._gave_ns = False, self._clock.steady_ns()
            self._over.set()
            background.start(self._leadership.release(), "release")
        out = WorldHandover(private_state=steps.world.snapshot(), term=steps.term, due_ns=self._due_ns)
        out.header.t_ns = steps.world.t_ns
        return out

    # -- waiting and taking over -------------------------------------------------------------------------------

    async def led_last(self) -> bool:
        """Whether the world of this place has led last: then it is the one that the others wait for."""
        seen = await self._leadership.holder()
        return seen is not None and seen.led_term >= 0 and seen.led_place == self._place

    async def somebody(self, within_s: float) -> bool:
        """Wait until another world leads; False when none has come within that time, or this one is asked to lead."""
        self._wait()
        await self._until(lambda: self._wanted or bool(self._heard()), within_s)
        return bool(self._heard())

    async def follow(self, states: RestartStates, begins: Room, follow_motion: FollowMotion, starts: bool = False) -> Start:
        """Wait until this world has the newest steps and the lease. begins: as this side knows the room; follow_motion: see
        FollowMotion; starts: it takes the room from whoever leads, unasked."""
        self._wait()
        log.info("world waits place=%s", self._place)
        free_ns = soon_ns = 0
        while True:
            self._changed.clear()
            seen = await self._leadership.holder()
            now_ns = self._clock.steady_ns()
            if seen is None or seen.held:
                free_ns, self._behind, self._told = 0, "", False
            elif now_ns - self._gave_ns >= SUCCESSOR_S * 1e9 or self._steps is None or seen.term > self._steps.term:
                free_ns = free_ns or now_ns
                mine, patient = self._newest(states.kept, seen.led_term), now_ns - free_ns < SUCCESSOR_S * 1e9
                if mine.term < seen.led_term and not patient:
                    await self._take(seen.led_term, begins, follow_motion)
                    mine = self._newest(states.kept, seen.led_term)
                start = await self._next(seen, mine, states, starts, patient)
                if start is not None:
                    return start
            self._looked = True
            if seen is not None and seen.held and (starts or self._wanted or self._leaving(seen.term)):
                self._wanted = False
                if await self._take(seen.led_term, begins, follow_motion):
                    starts, soon_ns = False, self._clock.steady_ns() + round(SUCCESSOR_S * 1e9)
            soon = self._clock.steady_ns() < soon_ns
            await self._until(self._changed.is_set, None if self._told else SOON_S if soon else LOOK_S)

    async def _next(self, seen: Holder, mine: Start, states: RestartStates, starts: bool, patient: bool) -> Start | None:
        """From where this world leads, once it has acquired the lease that nobody holds; None if it waits on. patient: who has
        newer steps may yet come."""
        term, place = max(self._heard(), default=(-1, ""))
        world = mine.world
        if term > seen.term and term > mine.term and not self._forced:
            reason = f"{place} has led under term {term}, of which the lease here does not know"
            return self._fall_behind(reason, "give all worlds of the room the same [world] lease", patient)
        if mine.term < seen.led_term:
            lost = starts and not place and not patient and seen.led_place == self._place
            if not lost and not self._forced:
                where = f"the newest steps are at {seen.led_place} (term {seen.led_term}), where no world is"
                mend = "start the world there again, or move the room here by force"
                return self._fall_behind(f"{where}; here is step {world.step_number}", mend, patient)
            if self._forced:
                world = max(world, states.received() or world, key=lambda w: w.step_number)
            log.error("all steps after %d, led at %s under term %d, are lost", world.step_number, seen.led_place, seen.led_term)
        own = await self._leadership.acquire(seen, max(mine.term, term))
        return Start(world, own, mine.due_ns) if own >= 0 else None

    async def _take(self, term: int, begins: Room, follow_motion: FollowMotion) -> bool:
        """Get the steps of `term` from the world that has them in memory, which then takes no further one.

        What costs time is made ready from a first answer, while the other may still lead; the second only moves things. The other
        gives its room only to a world whose presence it sees.
        """
        first = await self._ask(WorldHandoverRequest.PHASE_PREPARE, term)
        if first is None:
            return False
        try:
            ready = World.restore(first.private_state)
            if (ready.seats, ready.source) != (len(begins.seats), begins.source):
                log.warning("the room that is led is another than the conference file's; it is taken over as it is")
            await follow_motion(ready.participants)
            last = await self._ask(WorldHandoverRequest.PHASE_TAKE, term)
            if last is None:
                return False
            self._steps = Start(World.restore(last.private_state, like=ready), term, last.due_ns)
            self._gave_ns = NEVER_NS
        except ValueError as e:
            log.error("room not taken over reason=%s", e)
            return False
        log.info("room taken over term=%d step=%d", term, self._steps.world.step_number)
        return True

    def _newest(self, kept: Callable[[], Start], led_term: int) -> Start:
        """Reading what is kept takes a second or two: not where this world has the last leader's steps in memory."""
        if self._steps is None:
            return kept()
        return self._steps if self._steps.term >= led_term else max(self._steps, kept(), key=lambda s: s.newness)

    def _fall_behind(self, reason: str, mend: str, patient: bool) -> None:
        """Another's steps are waited for: that is logged once, if they do not come soon."""
        self._behind = reason
        if not self._told and not patient:
            self._told = True
            log.error("room waits reason=%r mend=%r", reason, mend)

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
        if self._steps is not None and self.leads:
            return WorldMoveReply(outcome=WorldMoveReply.OUTCOME_LEADS, step=self._steps.world.step_number)
        if not self._waits or not self._looked:
            return None
        if self._behind and not asked.force:
            return WorldMoveReply(outcome=WorldMoveReply.OUTCOME_BEHIND, reason=self._behind)
        self._wanted, self._forced, self._told = True, asked.force, False
        self._changed.set()
        return WorldMoveReply(outcome=WorldMoveReply.OUTCOME_MOVING)

    async def _ask(self, phase: WorldHandoverRequest.Phase, term: int) -> WorldHandover | None:
        request = WorldHandoverRequest(phase=phase, term=max(0, term), place=self._place)
        return await self._bus.query(BY_NAME["world_handover"], request, timeout_s=ASK_S)

    async def _until(self, true: Callable[[], bool], within_s: float | None) -> None:
        """Wait until it is true, or for so long."""
        with contextlib.suppress(TimeoutError):
            async with within(self._clock, within_s) if within_s is not None else contextlib.nullcontext():
                while not true():
                    self._changed.clear()
                    await self._changed.wait()

    # -- presence ----------------------------------------------------------------------------------------------

    def _others(self) -> list[tuple[int, str, str, str]]:
        """Term, name, what they do and place of the other worlds that are present: those of this side's own site."""
        found = [world_token(token) for site, token in self._alive if site == self._bus.site]
        return [(t.term, t.name, t.doing, t.place) for t in found if t is not None and t.name != self._me]

    def _heard(self) -> list[tuple[int, str]]:
        """Term and place of those that lead or have led."""
        return [(term, place) for term, _, doing, place in self._others() if doing != WAITS]

    def _leaving(self, term: int) -> bool:
        return any(t == term and doing == LEAVING for t, _, doing, _ in self._others())

    def _seen(self, site: str, token: str, alive: bool) -> None:
        (self._alive.add if alive else self._alive.discard)((site, token))
        self._changed.set()
        if self._listener is not None:
            self._listener(site, token, alive)

    def _announce(self, doing: str) -> None:
        self._bus.announce(WorldToken(self._steps.term if self._steps else 0, self._me, doing, self._place).text)

    def _serve(self) -> None:
        if not self._served:
            self._served = True
            self._bus.serve(BY_NAME["world_handover"], self._answer)
            self._bus.serve(BY_NAME["world_move"], self._moved)
