"""Devices of a conference file run by the command itself, without a conference: to calibrate them, or to look at them."""

from __future__ import annotations

import asyncio
import logging
import tempfile
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from vistel.conference.model import Conference, Participant, Site
from vistel.conference.paths import RunPaths
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel_cli.launch import simulated_devices
from vistel_sim.motion.open import CALIBRATION
from vistel_sim.process import run_simulators


@dataclass(frozen=True)
class DeviceSession:
    """begin_ns: when simulated people began to move."""

    bus: MemoryBus
    clock: SystemClock
    begin_ns: int
    tasks: list[asyncio.Task[None]]

    def check(self) -> None:
        """Raises what ended one of its tasks."""
        for task in self.tasks:
            if task.done() and (fault := task.exception()) is not None:
                raise fault


def alone(conference: Conference, site: Site, person: Participant) -> Conference:
    """The conference with nobody but `person`, who does the moves of a calibration where their devices are simulated."""
    there = site.model_copy(update={"participants": [person.model_copy(update={"motion": CALIBRATION})], "props": []})
    return conference.model_copy(update={"sites": [there]})


@asynccontextmanager
async def running(conference: Conference, services: Sequence[ModuleType]) -> AsyncIterator[DeviceSession]:
    """The services of every site, and what is simulated, for as long as the block lasts."""
    logging.getLogger("vistel").setLevel(logging.ERROR)
    clock = SystemClock()
    network = MemoryNetwork()
    with tempfile.TemporaryDirectory(prefix="vistel-") as folder:
        paths = RunPaths(Path(folder), Path(folder))
        begin_ns = clock.now_ns()
        session = DeviceSession(network.bus(conference.name, "here", clock, None), clock, begin_ns, [])
        if simulated_devices(conference):
            session.tasks.append(asyncio.create_task(run_simulators(conference, paths, clock, start_ns=begin_ns)))
        for site in conference.sites:
            bus = network.bus(conference.name, site.name, clock, None)
            for service in services:
                session.tasks.append(
                    asyncio.create_task(service.run(service.configure(conference, site, paths), bus, clock))
                )
        try:
            yield session
        finally:
            for task in session.tasks:
                task.cancel()
            await asyncio.gather(*session.tasks, return_exceptions=True)
