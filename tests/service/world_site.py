"""A conference of one process: people played by the made-up meeting, the real world service, time on a string."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from waiting import until

from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.figure.posture.posture import Posture
from vistel.v1.motion_pb2 import Participant
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.motion import MotionEncoder, MotionSample
from vistel.wire.owners import Owners
from vistel.wire.topics import BY_NAME
from vistel.wire.world.decoder import RoomState, WorldDecoder
from vistel_services import world
from vistel_sim.motion.meeting import Meeting
from vistel_sim.motion.source import simulated_people

START_NS = 1_700_000_000_000_000_000
TICK_NS = 16_666_667
PEOPLE = (("tokyo", "aiko"), ("paris", "bruno"), ("lagos", "chidi"))
AVATAR = "builtin:person=carla"
"""Of all of them: one person is made, and for other tests too."""

CONFERENCE = Conference.model_validate(
    {"sites": [{"name": site, "participants": [{"name": who, "avatar": AVATAR}]} for site, who in PEOPLE]}
)
RECORDED = ("participant", "motion", "command", "world_inputs", "world_state", "world_key", "hand_force", "command_result")


async def ended(task: asyncio.Task[None], clock: SimulatedClock) -> None:
    """End a world. Time passes meanwhile: if another world is there it may take the room over first."""
    task.cancel()
    while not task.done():
        await clock.advance_to_ns(clock.now_ns() + TICK_NS)
    await asyncio.gather(task, return_exceptions=True)


async def killed(task: asyncio.Task[None]) -> None:
    """End a world at once, even if another one could take its room over."""
    task.cancel()
    for _ in range(3):
        await asyncio.sleep(0)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


class WorldSite:
    """`log` is what a recorder would have: (topic, names, message, log time); owners: whose messages the world believes."""

    def __init__(self, folder: Path, owners: Owners | None = None) -> None:
        self.clock = SimulatedClock(START_NS)
        self.network = MemoryNetwork()
        self.config = world.configure(CONFERENCE, None, RunPaths(folder / "run", folder / "out"))
        self.meeting = Meeting(list(simulated_people(CONFERENCE).values()), 3, 1)
        self.buses: dict[str, MemoryBus] = {}
        self.encoders: dict[str, MotionEncoder] = {}
        self.log: list[tuple[str, dict[str, str], Any, int]] = []
        self.asking: MemoryBus | None = None
        self.away: set[str] = set()
        self.owners = owners
        self._task: asyncio.Task[None] | None = None
        self._bus: MemoryBus | None = None
        self._readers: list[Any] = []
        self._tick = 0

    @asynccontextmanager
    async def open(self) -> AsyncIterator[WorldSite]:
        """Sites with their people, a recorder, and a world."""
        watching = self.network.bus("demo", "hub", self.clock)
        self._readers = [watching.subscribe(BY_NAME[name], queue_all=True) for name in RECORDED]
        for site, who in PEOPLE:
            bus = self.buses[who] = self.network.bus("demo", site, self.clock)
            bus.announce("process-capture")
            self.encoders[who] = MotionEncoder()
            about = Participant(participant=who, site=site, display_name=who, avatar=AVATAR, height_m=1.75)
            bus.publish(BY_NAME["participant"], participant=who).put(about)
        self.asking = self.network.bus("demo", "hub", self.clock)
        await self.start()
        try:
            yield self
        finally:
            await self.kill()

    async def start(self) -> None:
        """Start a world and let it come up."""
        bus = self._bus = self.network.bus("demo", "hub", self.clock, owners=self.owners)
        self._task = asyncio.create_task(world.run(self.config, bus, self.clock))
        await until(lambda: self.clock._sleepers or self._task.done(), "its kernels, made on a thread")

    async def kill(self) -> None:
        """As SIGKILL would: at once. (What it writes at its end is taken away, as if it had never been written.)"""
        if self._task is None or self._bus is None:
            return
        folder = self.config.folder
        assert folder is not None
        kept: dict[str, bytes] = {}
        for path in filter(Path.is_file, folder.iterdir()) if folder.exists() else ():
            with suppress(FileNotFoundError):  # an old one that the world has just taken away
                kept[path.name] = path.read_bytes()
        await killed(self._task)
        await self._bus.close()
        for path in filter(Path.is_file, folder.iterdir()) if folder.exists() else ():
            path.unlink(missing_ok=True)  # the world's disk may still be at work
        for name, data in kept.items():
            (folder / name).write_bytes(data)
        self._task = None

    def posture(self, who: str, t_s: float) -> Posture:
        return self.meeting.posture(who, t_s)

    def send(self, who: str, t_s: float) -> None:
        """One motion of somebody, as their posture service would send it."""
        p = self.posture(who, t_s)
        publication = self.buses[who].publish(BY_NAME["motion"], participant=who)
        stance = np.array([*p.stance.position, p.stance.heading])
        sample = MotionSample(publication.next_seq, self.clock.now_ns(), p.dofs, p.hands, stance, p.gaze)
        publication.put(self.encoders[who].encode(sample))

    async def play(self, seconds: float, from_s: float | None = None) -> None:
        """`seconds` of the meeting; `from_s`: jump there first."""
        if from_s is not None:
            self._tick = round(from_s * 60)
        for _ in range(round(seconds * 60)):
            self._tick += 1
            for who in self.buses:
                if who not in self.away:
                    self.send(who, self._tick / 60)
            await self.clock.advance_to_ns(self.clock.now_ns() + TICK_NS)
            self.record()

    def record(self) -> None:
        for reader in self._readers:
            for s in reader.take():
                self.log.append((s.topic.name, s.names, s.message, s.received_ns))

    def rooms(self) -> list[RoomState]:
        """What somebody who has listened from the beginning knows, step by step."""
        decoder = WorldDecoder()
        return [now for topic, _, m, _ in self.log if topic == "world_state" for now in decoder.read(m)]

    def keys(self) -> list[Any]:
        return [m for topic, _, m, _ in self.log if topic == "world_key"]

    def results(self) -> list[Any]:
        return [m for topic, _, m, _ in self.log if topic == "command_result"]


def scenario(folder: Path, play: Callable[[WorldSite], Awaitable[None]], owners: Owners | None = None) -> WorldSite:
    """Run `play` in a site whose world keeps its room in `folder`; the site, closed. owners: whose messages the world believes."""

    async def whole() -> WorldSite:
        site = WorldSite(folder, owners)
        async with site.open():
            await play(site)
        return site

    return asyncio.run(whole())
