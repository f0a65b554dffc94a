"""A program's part in a running conference, for programs that run an event loop of their own (see `vistel.join` for others)."""

from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import asynccontextmanager
from typing import NamedTuple

from vistel.conference.connect import connect
from vistel.conference.model import Conference, Participant
from vistel.figure.posture.posture import Posture
from vistel.messages.postures import posture_of
from vistel.session.asking import POLL_NS, Answer, Asker
from vistel.session.publisher import ParticipantPublisher
from vistel.session.room_view import RoomView, view_of
from vistel.space.actions import Action
from vistel.wire.bus import Bus, Sample
from vistel.wire.clock import Clock, SystemClock
from vistel.wire.clock_sync import set_clock
from vistel.wire.motion import MotionDecoder
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener


class LivePosture(NamedTuple):
    """A participant's posture as it arrived. t_ns: conference time at which their sensors were sampled."""

    participant: str
    t_ns: int
    posture: Posture


class AsyncSession:
    """Watches a running room and gives commands in the name of `participant`."""

    def __init__(self, bus: Bus, clock: Clock, participant: str, conference: Conference | None = None) -> None:
        """conference: the file's; without it the participant has no look of their own."""
        self.participant = participant
        self._crowded = conference is not None and bool(conference.crowd)
        people = (p for site in conference.sites for p in site.participants) if conference is not None else ()
        self._person = next((p for p in people if p.name == participant), Participant(name=participant))
        self._room = RoomView()
        self._bus, self._clock = bus, clock
        self._world = WorldListener(bus, clock)
        self._asker = Asker(bus, clock, participant)

    @property
    def room(self) -> RoomView:
        """The newest step that has arrived; empty until the world has sent the whole room."""
        steps = self._world.take()
        if steps:
            self._room = view_of(steps[-1][0])
        return self._room

    def close(self) -> None:
        """End the subscriptions."""
        self._world.close()
        self._asker.close()

    async def ask(self, command: str | Action) -> Answer:
        """As `Asker.ask`; what has happened in the room meanwhile is in `room`."""
        return await self._asker.ask(command)

    async def steps(self, every_s: float = 0.1) -> AsyncIterator[RoomView]:
        """The room whenever it has gone on, at most every `every_s` seconds. The first comes when the room is known."""
        seen = 0
        while True:
            room = self.room
            if room.things and room.step > seen:
                seen = room.step
                yield room
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

    def publish(self, display_name: str = "", avatar: str = "", height_m: float | None = None) -> ParticipantPublisher:
        """Take part with a body: announce the participant, then `put` postures. Other sites draw them as `avatar`, a built-in
        person. What is not given is as in the conference file."""
        person = self._person
        look = avatar or (person.avatar if person.avatar.startswith("builtin") else "builtin")
        return ParticipantPublisher(
            self._bus,
            self._clock,
            self.participant,
            display_name or person.display_name or self.participant,
            look,
            person.height if height_m is None else height_m,
            crowded=self._crowded,
        )


@asynccontextmanager
async def opened(conference: Conference, site: str, participant: str, hub: str) -> AsyncGenerator[AsyncSession]:
    """A session in the name of a participant of a site, over the router `hub`. Raises BusError."""
    clock = SystemClock()
    bus = await connect(conference, site, clock, hub)
    await set_clock(bus, clock)
    session = AsyncSession(bus, clock, participant, conference)
    try:
        yield session
    finally:
        session.close()
        await bus.close()
