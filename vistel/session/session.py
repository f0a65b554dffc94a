"""A program's part in a running conference, for programs that run an event loop of their own (see `vistel.join` for others)."""

import secrets
from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import NamedTuple

from vistel.conference.connect import connect
from vistel.conference.model import Conference
from vistel.figure.posture.posture import Posture
from vistel.messages.commands import message_of
from vistel.messages.postures import posture_of
from vistel.session.publisher import ParticipantPublisher
from vistel.session.room_view import RoomView, view_of
from vistel.space.actions import Action
from vistel.space.commands.phrase import read
from vistel.v1.command_pb2 import CommandResult
from vistel.wire.bus import Bus, Sample
from vistel.wire.clock import Clock, SystemClock
from vistel.wire.motion import MotionDecoder
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener

ANSWER_NS = 3_000_000_000
"""How long `ask` waits for the world's answer."""
POLL_NS = 20_000_000
"""How often `ask` and `steps` look for news: a little more often than the world takes steps."""


@dataclass(frozen=True)
class Answer:
    """What became of a command. things: ids of those it changed or made. reason: why it was refused, else empty."""

    done: bool
    things: tuple[str, ...]
    reason: str


class LivePosture(NamedTuple):
    """A participant's posture as it arrived. t_ns: conference time at which their sensors were sampled."""

    participant: str
    t_ns: int
    posture: Posture


class AsyncSession:
    """Watches a running room and gives commands in the name of `participant`."""

    def __init__(self, bus: Bus, clock: Clock, participant: str) -> None:
        self.participant = participant
        self.room = RoomView()
        """The newest step that has arrived; empty until the world has sent the whole room."""
        self._bus, self._clock = bus, clock
        self._world = WorldListener(bus, clock)
        self._results = bus.subscribe(BY_NAME["command_result"], queue_all=True, participant=participant)
        self._commands = bus.publish(BY_NAME["command"], participant=participant)
        self._answers: dict[str, CommandResult] = {}

    def close(self) -> None:
        """End the subscriptions."""
        self._world.close()
        self._results.close()

    async def ask(self, command: str | Action) -> Answer:
        """Give a command, as a line that `vistel ask` takes or as an action, and wait for the world's answer.

        Raises PhraseError for a line that is no command.
        """
        action = read(command) if isinstance(command, str) else command
        message = message_of(action, secrets.token_hex(8), self.participant)
        message.header.t_ns = self._clock.now_ns()
        self._commands.put(message)
        until = self._clock.now_ns() + ANSWER_NS
        while self._clock.now_ns() < until:
            self._receive()
            result = self._answers.pop(message.id, None)
            if result is not None:
                return Answer(result.outcome == CommandResult.OUTCOME_DONE, tuple(result.things), result.reason)
            await self._clock.sleep_until_ns(self._clock.now_ns() + POLL_NS)
        return Answer(False, (), "the world did not answer; is it running?")

    async def steps(self, every_s: float = 0.1) -> AsyncIterator[RoomView]:
        """The room whenever it has gone on, at most every `every_s` seconds. The first comes when the room is known."""
        seen = 0
        while True:
            self._receive()
            if self.room.things and self.room.step > seen:
                seen = self.room.step
                yield self.room
                await self._clock.sleep_until_ns(self._clock.now_ns() + int(every_s * 1e9))
            else:
                await self._clock.sleep_until_ns(self._clock.now_ns() + POLL_NS)

    async def messages(self, topic: str, **names: str) -> AsyncIterator[Sample]:
        """Every message of a topic from now on (docs/reference/topics.md); `names` narrow it, such as `participant="ben"`.

        Raises KeyError for a topic that does not exist.
        """
        subscription = self._bus.subscribe(BY_NAME[topic], queue_all=True, polled=False, **names)
        try:
            async for sample in subscription:
                yield sample
        finally:
            subscription.close()

    async def postures(self, participant: str | None = None) -> AsyncIterator[LivePosture]:
        """Postures as they arrive, of everybody or of one participant."""
        decoders: dict[str, MotionDecoder] = {}
        names = {"participant": participant} if participant else {}
        async for sample in self.messages("motion", **names):
            motion = decoders.setdefault(sample.key, MotionDecoder()).decode(sample.message)
            if motion is not None:
                yield LivePosture(sample.names["participant"], motion.t_ns, posture_of(motion))

    def publish(self, display_name: str = "", avatar: str = "", height_m: float = 1.75) -> ParticipantPublisher:
        """Take part with a body: announce the participant, then `put` postures. Other sites draw them as `avatar`."""
        return ParticipantPublisher(self._bus, self._clock, self.participant, display_name or self.participant, avatar, height_m)

    def _receive(self) -> None:
        for sample in self._results.take():
            self._answers[sample.message.id] = sample.message
        steps = self._world.take()
        if steps:
            self.room = view_of(steps[-1][0])


@asynccontextmanager
async def opened(conference: Conference, site: str, participant: str, hub: str) -> AsyncGenerator[AsyncSession]:
    """A session in the name of a participant of a site, over the router `hub`. Raises BusError."""
    clock = SystemClock()
    bus = await connect(conference, site, clock, hub)
    session = AsyncSession(bus, clock, participant)
    try:
        yield session
    finally:
        session.close()
        await bus.close()
