"""`vistel.join`: a running conference from a plain program, a notebook or a script, without an event loop of one's own."""

import asyncio
import threading
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Coroutine, Iterator
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar, cast

from vistel.conference.files import ConferenceError, load
from vistel.conference.model import Conference
from vistel.conference.running import NONE_HERE, conferences_here, router_of
from vistel.figure.posture.posture import Posture
from vistel.session.asking import Answer
from vistel.session.publisher import ParticipantPublisher
from vistel.session.room_view import RoomView
from vistel.session.session import AsyncSession, LivePosture, opened
from vistel.space.actions import Action
from vistel.wire.bus import Sample
from vistel.wire.zenoh.at_exit import close_at_exit, closed

T = TypeVar("T")


def join(
    conference: str | Path | None = None, site: str | None = None, participant: str | None = None, hub: str | None = None
) -> "Session":
    """Join a running conference; use it in a `with`.

    conference: its file; default: that of the newest conference that runs on this machine. site, participant: in whose name;
    default: the first participant of the site, or of the file. hub: address of the router, such as "tcp/127.0.0.1:7447"; default:
    that of the newest conference of this name that runs on this machine, else the first endpoint of the file.

    Raises ConferenceError (one line) for a file, site or participant that cannot be used; BusError where no router answers.
    """
    return Session(opened(*place_of(None if conference is None else Path(conference), site, participant, hub)))


def place_of(file: Path | None, site: str | None, participant: str | None, hub: str | None) -> tuple[Conference, str, str, str]:
    """The conference of a file (None: the newest that runs on this machine), and the site, participant and router that a program
    joins it with. Raises ConferenceError."""
    elsewhere = False
    if file is None:
        here = conferences_here()
        if not here:
            raise ConferenceError(NONE_HERE)
        file, hub, elsewhere = Path(here[0].file), hub or here[0].hub, bool(here[0].site)
        participant = participant or (None if site else next(iter(here[0].people), None))
    conference = load(file, room_elsewhere=elsewhere)
    sites = {s.name: s for s in conference.sites}
    if site is not None and site not in sites:
        raise ConferenceError(f"{file}: no site is called {site!r}; there are {', '.join(sites)}")
    people = {p.name: s.name for s in conference.sites for p in s.participants if site in (None, s.name)}
    if participant is not None and participant not in people:
        where = f" at {site}" if site else ""
        raise ConferenceError(f"{file}: no participant{where} is called {participant!r}; there are {', '.join(people) or 'none'}")
    name = participant or next(iter(people), None)
    if name is None:
        raise ConferenceError(f"{file}: {site or 'the conference'} has no participant in whose name a program could join; add one")
    router = hub or router_of(conference)
    if router is None:
        raise ConferenceError(f"{file}: {conference.name} does not run on this machine; name its router with hub= or --hub")
    return conference, people[name], name, router


class Session:
    """A program's part in a running conference. Every method may be called from any thread; none needs an event loop."""

    def __init__(self, opening: AbstractAsyncContextManager[AsyncSession]) -> None:
        self._opening = opening
        self._session: AsyncSession | None = None

    def __enter__(self) -> Self:
        self._loop = asyncio.new_event_loop()
        # No daemon: Zenoh's own threads would be daemons, too, and abort the process when it ends.
        self._thread = threading.Thread(target=self._loop.run_forever, name="vistel session", daemon=False)
        self._thread.start()
        close_at_exit(self, lambda: self.__exit__(None, None, None))
        try:
            self._session = self._call(self._opening.__aenter__())
        except BaseException:
            self._stop()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        try:
            self._call(self._opening.__aexit__(None, None, None))
        finally:
            self._stop()

    @property
    def participant(self) -> str:
        """In whose name commands are given."""
        return self._joined.participant

    @property
    def room(self) -> RoomView:
        """The newest step of the world that has arrived; empty until the world has sent the whole room."""
        return self._call(_now(lambda: self._joined.room))

    def ask(self, command: str | Action) -> Answer:
        """Give a command and wait for the world's answer (see `AsyncSession.ask`)."""
        return self._call(self._joined.ask(command))

    def steps(self, every_s: float = 0.1) -> Iterator[RoomView]:
        """The room whenever it has gone on, at most every `every_s` seconds."""
        return self._each(self._joined.steps(every_s))

    def postures(self, participant: str | None = None) -> Iterator[LivePosture]:
        """Postures as they arrive, of everybody or of one participant."""
        return self._each(self._joined.postures(participant))

    def messages(self, topic: str, **names: str) -> Iterator[Sample]:
        """Every message of a topic from now on; `names` narrow it, such as `participant="ben"`."""
        return self._each(self._joined.messages(topic, **names))

    def publish(self, display_name: str = "", avatar: str = "", height_m: float | None = None) -> "Published":
        """Take part with a body: announce the participant, then `put` postures. What is not given is as in the conference file."""
        publisher = self._call(_now(lambda: self._joined.publish(display_name, avatar, height_m)))
        return Published(publisher, self._loop)

    @property
    def _joined(self) -> AsyncSession:
        if self._session is None:
            raise RuntimeError("a session is used in a `with`: with vistel.join(...) as session")
        return self._session

    def _call(self, work: Coroutine[Any, Any, T]) -> T:
        future = asyncio.run_coroutine_threadsafe(work, self._loop)
        try:
            return future.result()
        except BaseException:
            future.cancel()
            raise

    def _each(self, source: AsyncIterator[T]) -> Iterator[T]:
        try:
            while True:
                try:
                    yield self._call(_next(source))
                except StopAsyncIteration:
                    return
        finally:
            self._call(cast("AsyncGenerator[T]", source).aclose())

    def _stop(self) -> None:
        closed(self)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


class Published:
    """A participant whose postures come from this program."""

    def __init__(self, publisher: ParticipantPublisher, loop: asyncio.AbstractEventLoop) -> None:
        self._publisher, self._loop = publisher, loop

    def put(self, posture: Posture, t_ns: int | None = None) -> None:
        """Publish a posture. t_ns: conference time of its capture; default: now."""
        self._loop.call_soon_threadsafe(self._publisher.put, posture, t_ns)


async def _next(source: AsyncIterator[T]) -> T:
    return await anext(source)


async def _now(work: Callable[[], T]) -> T:
    return work()
