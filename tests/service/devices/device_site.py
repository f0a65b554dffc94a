"""Simulated devices on real ptys and the services that read them, on one event loop in virtual time, for the tests beside
this file."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Coroutine, Iterable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import virtual_time
from virtual_time import LoopClock
from waiting import until

from vistel.conference.model import Conference, Participant, Site
from vistel.conference.paths import RunPaths
from vistel.v1.device_pb2 import DeviceStatus
from vistel.wire.clock import Clock
from vistel_services import glove, tracker
from vistel_sim.cyberglove import CyberGlove
from vistel_sim.device import Instrument, SimulatedDevice
from vistel_sim.fastrak import Fastrak
from vistel_sim.faults import Fault

STATE = DeviceStatus.State
HAND = [0.1, 0.05, 0.2, 0.3, 0.4, 0.1, 0.6, 0.4, 0.5, 0.0, 0.6, 0.4, 0.6, -0.05, 0.6, 0.4, 0.7, -0.1, 0.6, 0.4]


def pose(station: int, t_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Receivers that circle at 0.3 m/s and turn."""
    a = t_s + station
    half = 0.5 * math.sin(a)
    position = np.array([0.6 + 0.3 * math.cos(a), 0.3 * math.sin(a), -0.5])
    return position, np.array([0.0, 0.0, math.sin(half), math.cos(half)])


@dataclass
class RecordingBus:
    """Keeps what is published, in order."""

    conference: str = "test"
    site: str = "a"
    sent: list[tuple[str, str, Any]] = field(default_factory=list)

    def publish(self, topic: Any, **names: str) -> _Publication:
        return _Publication(self.sent, topic.name, names["device"])

    def on(self, topic: str, device: str) -> list[Any]:
        return [m for t, d, m in self.sent if (t, d) == (topic, device)]

    def states(self, device: str) -> list[int]:
        """The states a device went through."""
        out: list[int] = []
        for status in self.on("device_status", device):
            if not out or out[-1] != status.state:
                out.append(status.state)
        return out

    def status(self, device: str) -> DeviceStatus:
        sent = self.on("device_status", device)
        return sent[-1] if sent else DeviceStatus()


@dataclass
class _Publication:
    sent: list[tuple[str, str, Any]]
    topic: str
    device: str

    def put(self, message: Any) -> None:
        self.sent.append((self.topic, self.device, message))


def quiet_fastrak(**options: Any) -> Fastrak:
    return Fastrak(pose, **({"position_noise": 0.0, "angle_noise": 0.0, "restart_s": 0.2} | options))


def quiet_glove(**options: Any) -> CyberGlove:
    return CyberGlove(lambda t_s: HAND, **({"noise": 0.0, "restart_s": 0.2} | options))


@dataclass
class DeviceSite:
    """One participant, "ann", with whatever instruments are plugged in at the ports of her devices."""

    folder: Path
    bus: RecordingBus = field(default_factory=RecordingBus)
    clock: Clock = field(default_factory=LoopClock)
    start_ns: int = 0

    @asynccontextmanager
    async def running(
        self, instruments: dict[str, Instrument], faults: Iterable[Fault] = (), person: dict[str, Any] | None = None, **port: Any
    ):
        """Services and simulated devices, for as long as the block lasts. `port`: see SimulatedDevice."""
        conference = Conference(sites=[Site(name="a", participants=[Participant(name="ann", **(person or {}))])])
        paths = RunPaths(self.folder, self.folder)
        self.start_ns = self.clock.now_ns()
        tasks = [
            asyncio.create_task(
                SimulatedDevice(name, unit, paths.device(name), self.clock, self.start_ns, tuple(faults), **port).run()
            )
            for name, unit in instruments.items()
        ]
        for service in (tracker, glove):
            config = service.configure(conference, conference.sites[0], paths)
            tasks.append(asyncio.create_task(service.run(config, self.bus, self.clock)))
        try:
            yield self
            for task in tasks:
                assert not task.done() or task.exception() is None
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def until(self, condition: Callable[[], bool]) -> None:
        await until(condition)

    def truth(self, station: int, t_ns: int) -> tuple[np.ndarray, np.ndarray]:
        return pose(station, (t_ns - self.start_ns) * 1e-9)


class Running:
    """What runs side by side in a test until it is closed."""

    def __init__(self, work: Iterable[Coroutine[Any, Any, None]]) -> None:
        self.tasks = [asyncio.create_task(w) for w in work]

    async def until(self, condition: Callable[[], bool]) -> None:
        await until(condition)

    async def close(self) -> None:
        for task in self.tasks:
            task.cancel()
        await asyncio.gather(*self.tasks, return_exceptions=True)


def run(scenario: Coroutine[Any, Any, None]) -> None:
    """In virtual time."""
    virtual_time.run(scenario)
