"""A conference with seats for guests on one event loop: the console, and the services that make figures of what pages say."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
import pytest
from browser import Page
from waiting import until

from vistel.conference.console import ConsoleConfig
from vistel.conference.invitations import Invitation, digest_of_token, invite
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.conference.seats import seat_place
from vistel.figure.avatar.cache_folder import default_cache
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import rotation_y
from vistel.protocol.pages.headset import UNIT_M
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_services import pointer, posture, world
from vistel_services.console import guests, service
from vistel_services.serving import server

HOUR_NS = 3_600_000_000_000
AGAIN_S = 1.1
"""From one reaction of a guest to the next: the world takes one a second."""
GUESTS = {
    "name": "guests",
    "participants": [{"name": f"guest-{n}", "guest": True, "avatar": "builtin:person=carla", "height": 1.71} for n in (1, 2)],
}


class GuestRoom:
    """heard: who was said to be in the room, and who to have left; moved, pointed, seen, worn: messages of each participant and
    device; spoken: whose voice, and its messages."""

    def __init__(self, folder: Path, console: ConsoleConfig | None = None, *more: dict[str, Any]) -> None:
        """more: other sites, whose services the test runs."""
        self.conference = Conference.model_validate({"name": "c", "sites": [GUESTS, *more]}).model_copy(
            update={"console": console or ConsoleConfig(at="127.0.0.1:0")}
        )
        self.paths = RunPaths(folder, folder)
        self.network, self.clock = MemoryNetwork(), SystemClock()
        self.address = ""
        self._servers: list[Any] = []
        watching = self.network.bus("c", "hub", self.clock)
        self._about = watching.subscribe(BY_NAME["participant"], polled=True)
        self._motion = watching.subscribe(BY_NAME["motion"], queue_all=True, polled=True)
        self._pointer = watching.subscribe(BY_NAME["pointer"], queue_all=True, polled=True)
        self._cameras = watching.subscribe(BY_NAME["camera_body"], queue_all=True, polled=True)
        self._headsets = watching.subscribe(BY_NAME["headset"], queue_all=True, polled=True)
        self._voices = watching.subscribe(BY_NAME["voice"], queue_all=True, polled=True)
        self.heard: list[Any] = []
        self.spoken: list[Any] = []
        self.moved: list[str] = []
        self.pointed: list[Any] = []
        self.seen: list[Any] = []
        self.worn: list[Any] = []

    def invited(self, participant: str = "guest-1", name: str = "Ann", lasts_ns: int = HOUR_NS) -> str:
        """The token of a new link."""
        token = f"a-token-of-a-link-{participant}-{name}-{lasts_ns}"
        until_ns = self.clock.now_ns() + lasts_ns
        invite(self.paths.run, Invitation(participant, name, "builtin:person=carla", digest_of_token(token), until_ns))
        return token

    def take(self) -> None:
        """Look at what has been published."""
        self.heard += [s.message for s in self._about.take()]
        self.moved += [s.names["participant"] for s in self._motion.take()]
        self.spoken += [(s.names["participant"], s.message) for s in self._voices.take()]
        self.pointed += [s.message for s in self._pointer.take()]
        self.seen += [s.message for s in self._cameras.take()]
        self.worn += [s.message for s in self._headsets.take()]

    async def until(self, holds: Any, what: str) -> None:
        """Wait for what is published."""

        def look() -> bool:
            self.take()
            return bool(holds())

        await until(look, what)

    @contextlib.asynccontextmanager
    async def serving(self, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[GuestRoom]:
        """Its services run."""
        opened, real = self._servers, service.open_server

        async def open_server(*given: Any) -> Any:
            opened.append(await real(*given))
            return opened[0]

        site, clock = self.conference.sites[0], self.clock
        there = self.network.bus("c", site.name, clock)
        with monkeypatch.context() as patched:
            patched.setattr(service, "open_server", open_server)
            patched.setattr(server, "_SILENT_S", 3600.0)  # pages are in this process: what stands still is the machine, not a page
            tasks = [
                asyncio.create_task(service.run(self.conference, self.paths, self.network.bus("c", "hub", clock), clock)),
                asyncio.create_task(pointer.run(pointer.configure(self.conference, site, self.paths), there, clock)),
                asyncio.create_task(posture.run(posture.configure(self.conference, site, self.paths), there, clock)),
            ]
            try:
                await until(lambda: opened, "the console's server", tasks=tasks)
                self.address = str(opened[0].address)
                await until(lambda: self.paths.device("guest-2-pointer").exists(), "the devices of guests", tasks=tasks)
                yield self
            finally:
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)

    def cut(self) -> None:
        """Break every connection to the console, as a network that goes does."""
        for connection in self._servers[0]._runner.server.connections:
            if connection.transport is not None:
                connection.transport.abort()

    @contextlib.asynccontextmanager
    async def led(self) -> AsyncIterator[asyncio.Task[None]]:
        """A world leads the room; its task, which ends early where it fails."""
        config, bus = world.configure(self.conference, None, self.paths), self.network.bus("c", "hub", self.clock)
        leading = asyncio.create_task(world.run(config, bus, self.clock))
        try:
            yield leading
        finally:
            leading.cancel()
            await asyncio.gather(leading, return_exceptions=True)

    @contextlib.asynccontextmanager
    async def opened(self, token: str) -> AsyncIterator[GuestPage]:
        """A page that has shown the token of a link."""
        async with aiohttp.ClientSession() as session, session.ws_connect(f"http://{self.address}/guest") as socket:
            await socket.send_json({"token": token})
            yield GuestPage(socket)


def own_cache(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Nothing is kept on this machine from before but people, who take seconds to make."""
    people, cache = default_cache(), folder / "cache"
    people.mkdir(parents=True, exist_ok=True)
    (cache / "vistel").mkdir(parents=True)
    (cache / "vistel" / people.name).symlink_to(people)
    patch.setenv("XDG_CACHE_HOME", str(cache))


def in_room(folder: Path, patch: pytest.MonkeyPatch, play: Callable[[GuestRoom], Awaitable[None]], **options: Any) -> None:
    """Play in a room of its own. options: of `GuestRoom`."""

    async def played() -> None:
        async with GuestRoom(folder, **options).serving(patch) as room:
            await play(room)

    asyncio.run(played())


async def visit_with_faults(
    room: GuestRoom, record: Callable[[], bytes], wrong_of: Callable[[bytes], Sequence[bytes]], came: list[Any]
) -> None:
    """A guest whose page sends what is in order too early, then what is not, then what is, and then too much that is not: this ends
    the visit. record: what is in order now; wrong_of: made of that, what is not; came: what of it has come to the bus."""
    async with room.opened(room.invited()) as page:
        await page.told("invited")
        await page.socket.send_bytes(record())  # before she is in the room
        await page.socket.send_json({"person": "carla"})
        right = record()
        wrong = wrong_of(right)
        for said in (*wrong, right):
            await page.socket.send_bytes(said)
        await room.until(lambda: came, "what is in order")
        for _ in range(guests.MOST_FAULTY):
            await page.socket.send_bytes(wrong[0])
        assert await page.code() == guests.MISBEHAVED
    room.take()


async def visit_with_a_flood(room: GuestRoom, record: Callable[[], bytes], came: list[Any]) -> None:
    """A guest whose page sends a thousand records at once: this ends the visit, and few have come to the bus."""
    async with room.opened(room.invited()) as page:
        await page.enter()
        for _ in range(1000):
            await page.socket.send_bytes(record())
        assert await page.code() == guests.MISBEHAVED
    room.take()
    assert len(came) <= guests.MOST_A_SECOND


async def at_the_door(tab: Page, room: GuestRoom, token: str, width: int, height: int) -> None:
    """Open a link in a browser, until a person can be chosen. Skips where the browser cannot draw."""
    await tab.open(f"http://{room.address}/join#{token}", width, height)
    await tab.until("document.documentElement.dataset.begun")
    if not await tab.value("Boolean(window.guest)"):
        pytest.skip("this Chromium has no WebGL")
    await tab.until("!document.getElementById('door').hidden")


def place(numbers: object) -> np.ndarray:
    """Of a pose, or of a wrist, in the seat's frame [m]."""
    return np.array(list(numbers)[:3]) * UNIT_M  # type: ignore[call-overload]


async def figure_near(tab: Page, room: GuestRoom, joint: str, in_seat: np.ndarray, most_m: float) -> None:
    """Wait until a joint of the guest's figure, as the page shows what is on the bus, is so near a place."""
    position, heading = seat_place(room.conference.room, room.conference.seat_of("guest-1"))
    x, y, z = (position + rotation_y(heading) @ in_seat).tolist()
    at = f"window.guest.joints('guest-1')[{JOINT_INDEX[joint]}]"
    await tab.until(f"(p => p && Math.hypot(p[0] - {x}, p[1] - {y}, p[2] - {z}) < {most_m})({at})")


class GuestPage:
    """What a page does, without a browser. newest: words of each kind, and heard_words: all of them, while it is `listening`."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket
        self.newest: dict[str, dict[str, Any]] = {}
        self.heard_words: list[dict[str, Any]] = []

    @contextlib.asynccontextmanager
    async def listening(self) -> AsyncIterator[asyncio.Task[None]]:
        """As an open page: it takes whatever comes, until this task ends, because the console has ended the visit."""

        async def listen() -> None:
            async for said in self.socket:
                if said.type is aiohttp.WSMsgType.TEXT:
                    words = said.json()
                    self.newest[words["kind"]] = words
                    self.heard_words.append(words)

        task = asyncio.create_task(listen())
        try:
            yield task
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    async def shown(
        self,
        kind: str,
        such: Callable[[dict[str, Any]], bool],
        do: Callable[[], Awaitable[object]],
        tasks: Iterable[asyncio.Task[Any]] = (),
    ) -> None:
        """Do it, again and again, until such words of a kind have come. For what is shown some seconds, while `listening`: a busy
        machine may look only when it is over. Fails as soon as one of `tasks` has ended."""
        before = len(self.heard_words)

        def came() -> bool:
            return any(words["kind"] == kind and such(words) for words in self.heard_words[before:])

        while not came():
            await do()
            again_s = time.monotonic() + AGAIN_S
            await until(lambda again_s=again_s: came() or time.monotonic() > again_s, kind, tasks=tasks)

    def in_the_world(self, participant: str) -> bool:
        """Whether the world has them: their figure touches something. Before this, it refuses what they ask. While `listening`."""
        return any(participant in pair for pair in self.newest.get("held", {}).get("touching", ()))

    async def told(self, kind: str) -> dict[str, Any]:
        """The next words of a kind."""
        async for said in self.socket:
            if said.type is aiohttp.WSMsgType.TEXT and (words := said.json())["kind"] == kind:
                return words
        raise AssertionError(f"closed with {self.socket.close_code} before it told {kind}")

    async def enter(self, person: str = "carla") -> None:
        """Be in the room."""
        await self.told("invited")
        await self.socket.send_json({"person": person})

    async def code(self) -> int | None:
        """With what the gateway closes."""
        async for _ in self.socket:
            pass
        return self.socket.close_code
