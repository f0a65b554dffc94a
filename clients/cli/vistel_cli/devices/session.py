"""Runs the devices of a conference file without a conference, to calibrate or watch them."""

import asyncio
import logging
import tempfile
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from vistel.conference.device_list import simulated_names
from vistel.conference.model import Conference, Participant, Site
from vistel.conference.paths import RunPaths
from vistel.wire import background
from vistel.wire.clock import Clock, SystemClock
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_cli.waiting import waiting
from vistel_sim.limbs import own_limbs
from vistel_sim.motion.open import CALIBRATION
from vistel_sim.process import run_simulators

_LOOK_S = 0.1


@dataclass(frozen=True)
class DeviceSession:
    """begin_ns: when simulated people began to move. details: the newest status text of each device."""

    bus: MemoryBus
    clock: Clock
    begin_ns: int
    tasks: list[asyncio.Task[None]]
    details: dict[str, str]

    def now_s(self) -> float:
        """Seconds since simulated people began to move."""
        return (self.clock.now_ns() - self.begin_ns) * 1e-9

    def check(self) -> None:
        """Raises what ended one of its tasks."""
        for task in self.tasks:
            if task.done() and (fault := task.exception()) is not None:
                raise fault

    def listen(self, topic: str, take: Callable[[Any], object]) -> None:
        """Give every message of a topic to `take`."""

        async def follow() -> None:
            async for sample in self.bus.subscribe(BY_NAME[topic], queue_all=True):
                take(sample.message)

        self.tasks.append(background.start(follow(), topic))

    async def until(self, done: Callable[[], bool], at_most_s: float) -> bool:
        """Wait for `done`; False when it takes longer."""
        with waiting("waiting for the devices"):
            for _ in range(round(at_most_s / _LOOK_S)):
                if done():
                    return True
                self.check()
                await asyncio.sleep(_LOOK_S)
        return done()


def alone(conference: Conference, site: Site, person: Participant) -> Conference:
    """The conference with `person` alone. Simulated devices of that person perform the moves of a calibration."""
    there = site.model_copy(update={"participants": [person.model_copy(update={"motion": CALIBRATION})], "props": []})
    return conference.model_copy(update={"sites": [there]})


@contextmanager
def _quietly() -> Iterator[None]:
    """Suppresses the log of services; the command prints the facts itself."""
    ours = logging.getLogger("vistel")
    before = ours.level
    ours.setLevel(logging.ERROR)
    try:
        yield
    finally:
        ours.setLevel(before)


@asynccontextmanager
async def running(conference: Conference, services: Sequence[ModuleType]) -> AsyncIterator[DeviceSession]:
    """Runs the services of every site and the simulated devices, for as long as the block lasts."""
    clock = SystemClock()
    network = MemoryNetwork()
    with tempfile.TemporaryDirectory(prefix="vistel-") as folder, _quietly():
        paths = RunPaths(Path(folder), Path(folder))
        with waiting("starting the devices"):
            limbs = own_limbs(conference)
        begin_ns = clock.now_ns()
        session = DeviceSession(network.bus(conference.name, "here", clock, None), clock, begin_ns, [], {})
        session.listen("device_status", lambda status: session.details.update({status.device: status.detail}))
        if simulated_names(conference):
            moves = run_simulators(conference, paths, clock, start_ns=begin_ns, limbs=limbs)
            session.tasks.append(background.start(moves, "simulators"))
        for site in conference.sites:
            bus = network.bus(conference.name, site.name, clock, None)
            for service in services:
                running = service.run(service.configure(conference, site, paths), bus, clock)
                session.tasks.append(background.start(running, service.__name__))
        try:
            yield session
        finally:
            for task in session.tasks:
                task.cancel()
            await asyncio.gather(*session.tasks, return_exceptions=True)
