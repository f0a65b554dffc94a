"""Activities: short programs that watch a room and change it, such as a puzzle, a molecule, a lump of clay.

    async def play(room: Room) -> None:
        await room.ask("create green ball 6 cm here")
        async for _ in room.steps():
            ...

    run(play)      # python my_activity.py conference.toml --as aiko --hub tcp/127.0.0.1:7447

An activity asks in the name of a participant who is in the room.
"""

from __future__ import annotations

import argparse
import asyncio
import secrets
import signal
import sys
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.conference.files import ConferenceError, load
from vistel.conference.model import Conference
from vistel.messages.commands import message_of
from vistel.space.commands.actions import Action
from vistel.space.commands.phrase import PhraseError, read
from vistel.v1.command_pb2 import CommandResult
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener
from vistel.wire.world.room_now import RoomNow
from vistel.wire.zenoh.bus import BusError, ZenohBus

PATIENCE_NS = 3_000_000_000
"""How long an answer is waited for."""
LOOK_NS = 20_000_000
"""How often news are looked for."""


@dataclass(frozen=True, eq=False)
class ThingNow:
    """A thing as it is: position (3,) [m] and rotation (4,) (x, y, z, w), room frame; colour: 0xRRGGBBAA; holders:
    participants."""

    id: str
    name: str
    shape: str
    colour: int
    position: F64
    rotation: F64
    holders: tuple[str, ...] = ()
    still: bool = False


@dataclass(frozen=True)
class Answer:
    """What became of what was asked: things it was done to or made, or the reason why it was not."""

    done: bool
    things: tuple[str, ...]
    reason: str


class Room:
    """A running room, watched and asked over the bus. Everything in it is as of the newest step heard."""

    def __init__(self, bus: Bus, clock: Clock, participant: str) -> None:
        self.participant = participant
        self.step = 0
        self.t_ns = 0
        self.things: dict[str, ThingNow] = {}
        self.people: tuple[str, ...] = ()
        self.touching: frozenset[tuple[str, str]] = frozenset()
        self._bus, self._clock = bus, clock
        self._world = WorldListener(bus, clock)
        self._results = bus.subscribe(BY_NAME["command_result"], queue_all=True, participant=participant)
        self._commands = bus.publish(BY_NAME["command"], participant=participant)
        self._answers: dict[str, CommandResult] = {}

    def close(self) -> None:
        """Stop listening."""
        self._world.close()
        self._results.close()

    async def ask(self, what: str | Action) -> Answer:
        """Ask for something, by a line as `vistel ask` takes it or by an action, and wait for what became of it.

        Raises PhraseError for a line that is no command.
        """
        action = read(what) if isinstance(what, str) else what
        command = message_of(action, secrets.token_hex(8), self.participant)
        command.header.t_ns = self._clock.now_ns()
        self._commands.put(command)
        until = self._clock.now_ns() + PATIENCE_NS
        while self._clock.now_ns() < until:
            self._listen()
            result = self._answers.pop(command.id, None)
            if result is not None:
                return Answer(result.outcome == CommandResult.OUTCOME_DONE, tuple(result.things), result.reason)
            await self._clock.sleep_until_ns(self._clock.now_ns() + LOOK_NS)
        return Answer(False, (), "the world did not answer; is it running?")

    async def steps(self, every_s: float = 0.1) -> AsyncIterator[Room]:
        """The room again and again, whenever it has gone on, at most every `every_s`. It begins when the room is known."""
        seen = 0
        while True:
            self._listen()
            if self.things and self.step > seen:
                seen = self.step
                yield self
                await self._clock.sleep_until_ns(self._clock.now_ns() + int(every_s * 1e9))
            else:
                await self._clock.sleep_until_ns(self._clock.now_ns() + LOOK_NS)

    def apart(self, a: str, b: str) -> float:
        """Distance between the centres of two things [m]; infinite when one is not there."""
        if a not in self.things or b not in self.things:
            return float("inf")
        return float(np.linalg.norm(self.things[a].position - self.things[b].position))

    def touched(self, thing: str) -> bool:
        """Whether anybody touches a thing."""
        return any(thing in pair for pair in self.touching)

    def _listen(self) -> None:
        for sample in self._results.take():
            self._answers[sample.message.id] = sample.message
        news = self._world.take()
        if news:
            self._hear(news[-1][0])

    def _hear(self, now: RoomNow) -> None:
        self.things = {
            t.id: ThingNow(t.id, t.name, t.shape, t.colour, *now.poses[t.id], now.holders(t.id), t.id not in now.moving)
            for t in now.things.values()
            if t.id in now.poses
        }
        self.step, self.t_ns = now.step, now.t_ns
        self.people = now.participants
        self.touching = frozenset((t.target, t.source) for t in now.touches)


Activity = Callable[[Room], Coroutine[Any, Any, None]]


def run(activity: Activity, arguments: list[str] | None = None) -> None:
    """The whole program round an activity: reads the command line, joins the conference, plays until it ends or Ctrl-C."""
    parser = argparse.ArgumentParser(description=(activity.__doc__ or "").strip() or None)
    parser.add_argument("conference", type=Path, help="conference file")
    parser.add_argument("--as", dest="who", help="participant who asks; default: the first of the file")
    parser.add_argument("--hub", help="router; default from the file")
    args = parser.parse_args(arguments)
    try:
        sys.exit(asyncio.run(_joined(activity, args.conference, args.who, args.hub)))
    except (ConferenceError, BusError, PhraseError) as e:
        sys.exit(f"error: {e}")


async def _joined(activity: Activity, file: Path, who: str | None, hub: str | None) -> int:
    conference = load(file)
    people = {p.name: site.name for site in conference.sites for p in site.participants}
    name = who or next(iter(people), "")
    if name not in people:
        raise BusError(f"--as {name}: no such participant; there are {', '.join(people)}")
    if not hub and not conference.bus.endpoints:
        raise BusError("no router: name one with --hub; `vistel up` prints it")
    async with joined(conference, people[name], name, hub or conference.bus.endpoints[0]) as room:
        playing = asyncio.create_task(activity(room))
        for signum in (signal.SIGINT, signal.SIGTERM):
            asyncio.get_running_loop().add_signal_handler(signum, playing.cancel)
        await asyncio.wait([playing])
        if not playing.cancelled():
            playing.result()
    return 0


@asynccontextmanager
async def joined(conference: Conference, site: str, participant: str, hub: str) -> AsyncIterator[Room]:
    """A conference's room, in the name of a participant of a site, by way of a router. Raises BusError."""
    clock = SystemClock()
    tls = conference.bus.tls if conference.bus.mode == "routed" else None
    files = (str(tls.ca), str(tls.certificate), str(tls.key)) if tls else None
    bus = await ZenohBus.open(conference=conference.name, site=site, clock=clock, endpoints=[hub], tls=files)
    room = Room(bus, clock, participant)
    try:
        yield room
    finally:
        room.close()
        await bus.close()
