"""A conference in simulated time, whole and in this process: devices, drivers, postures, world and log on one clock.

Bytes of simulated devices go through the drivers, and messages through the bus in memory. No socket, no port and no other process
takes part, so the same conference with the same seed gives the same log, byte for byte, however busy the machine is. Nobody speaks
in it and nothing is drawn.
"""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Callable, Coroutine, Iterable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from vistel.conference.device_list import Device, devices_of, devices_of_site
from vistel.conference.files import load, text_without_tokens
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.v1.command_pb2 import Command
from vistel.wire import background
from vistel.wire.log import LogWriter
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.simulated_loop import LoopClock, SimulatedLoop
from vistel.wire.topics import BY_NAME
from vistel_cli.log.fast_sites import WINDOW_NS, Heard, ended
from vistel_cli.log.fast_world import write_said
from vistel_services import glove, posture, tracker, world
from vistel_services.devices.service import Config
from vistel_sim.device import SimulatedDevice, run_devices
from vistel_sim.faults import Fault, fault_from_text
from vistel_sim.limbs import own_limbs
from vistel_sim.motion import open_motion
from vistel_sim.ports.wire_port import Wires
from vistel_sim.process import simulators

BEGIN_NS = 1_700_000_000_000_000_000
"""Conference time at which every simulated conference begins [ns]."""
SERVICES = tracker, glove
"""Services of devices that take part."""


class SimulatedConference:
    """Use it in a `with`, or call `end`. log: a log like any other, whole up to now after each `live`."""

    def __init__(self, conference: Conference, log: Path, faults: Iterable[Fault] = ()) -> None:
        """faults: of its devices, at times from its beginning. Raises ValueError, one line, for a device that is not simulated at a
        serial port, or a fault of an unknown one; OSError where `log` cannot be written."""
        self.log = log
        room = conference.world.model_copy(update={"folder": None})  # begins anew, and is kept nowhere
        self._conference = conference.model_copy(update={"record_raw": True, "world": room})
        if out := [d.name for d in devices_of(conference) if not _on_a_wire(d)]:
            raise ValueError(f"simulated time: {', '.join(out)}: only simulated trackers and gloves at serial ports can take part")
        self._asked = 0
        self._ends = ExitStack()
        folder = Path(self._ends.enter_context(tempfile.TemporaryDirectory(prefix="vistel-")))
        text = text_without_tokens(self._conference.model_dump(mode="json", exclude_none=True))
        self._writer = self._ends.enter_context(LogWriter(log, text))
        self._runner = self._ends.enter_context(asyncio.Runner(loop_factory=SimulatedLoop))
        self._running: list[asyncio.Task[None]] = []
        try:
            self._runner.run(self._begin(RunPaths(folder, folder), tuple(faults)))
        except BaseException:
            self._ends.close()
            raise

    @classmethod
    def of_file(cls, file: Path, log: Path, faults: Iterable[str] = ()) -> Self:
        """That of a conference file. faults: DEVICE:KIND:AT_S:FOR_S. Raises ConferenceError, and as the constructor does."""
        return cls(load(file), log, [fault_from_text(text) for text in faults])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.end()

    @property
    def now_s(self) -> float:
        """Seconds since it began."""
        return (self._now_ns - BEGIN_NS) * 1e-9

    def live(self, seconds: float) -> None:
        """Let so many seconds of the conference pass. Raises what a service ended with."""
        until_ns = self._now_ns + round(seconds * 1e9)
        while self._now_ns < until_ns:
            self._now_ns = min(self._now_ns + WINDOW_NS, until_ns)
            self._runner.run(self._live(self._now_ns))
            self._write()
        self._writer.flush()

    def live_until(self, condition: Callable[[], bool], what: str, *, within_s: float = 60.0) -> None:
        """Let it pass until `condition` holds, looked at every quarter of a second. Raises AssertionError that names `what` it
        waited for."""
        until_s = self.now_s + within_s
        while not condition():
            if self.now_s >= until_s:
                raise AssertionError(f"waited {within_s:g} s of the conference for {what}")
            self.live(WINDOW_NS * 1e-9)

    def ask(self, participant: str, command: Command) -> None:
        """Publish a command of a participant, now. Its id, sender and time are filled in. Raises KeyError for an unknown one."""
        site = {p.name: s.name for s in self._conference.sites for p in s.participants}[participant]
        self._asked += 1
        asked = Command()
        asked.CopyFrom(command)
        asked.id, asked.participant, asked.header.t_ns = f"{participant}-{self._asked}", participant, self._now_ns
        self._runner.run(self._publish(site, participant, asked))

    def end(self) -> None:
        """End it, and close its log."""
        if self._running:
            self._runner.run(ended(self._running))
            self._running.clear()
            self._write()
        self._ends.close()

    async def _begin(self, paths: RunPaths, faults: tuple[Fault, ...]) -> None:
        conference, self._now_ns = self._conference, BEGIN_NS
        self._clock, self._network, wires = LoopClock(BEGIN_NS), MemoryNetwork(), Wires()
        self._heard = Heard(self._network, self._clock)
        self._buses: dict[str, MemoryBus] = {}
        limbs = own_limbs(conference)
        motion = open_motion(conference, limbs)
        devices = simulators(conference, motion, paths, self._clock, BEGIN_NS, faults=faults, limbs=limbs, port=wires.port)
        if other := [d.name for d in devices if not isinstance(d, SimulatedDevice)]:
            raise ValueError(f"simulated time: {', '.join(other)}: not at a serial port; leave it out")
        self._start("devices", run_devices(devices))
        for site in conference.sites:
            bus = self._buses[site.name] = self._network.bus(conference.name, site.name, self._clock)
            bauds = {d.name: int(getattr(d.config, "baud", 115200)) for d in devices_of_site(site)}
            for service in SERVICES:
                config = service.configure(conference, site, paths)
                wired = tuple(replace(c, opener=wires.opener(c.driver.name, bauds[c.driver.name])) for c in config.devices)
                self._start(service.__name__, service.run(Config(wired, config.raw), bus, self._clock))
            self._start("posture", posture.run(posture.configure(conference, site, paths), bus, self._clock))
        hub = self._network.bus(conference.name, "hub", self._clock)
        self._start("world", world.run(world.configure(conference, None, paths), hub, self._clock))

    def _start(self, name: str, work: Coroutine[Any, Any, None]) -> None:
        self._running.append(background.start(work, name))

    async def _live(self, until_ns: int) -> None:
        await self._clock.sleep_until_ns(until_ns)
        for task in self._running:
            if task.done():
                task.result()

    async def _publish(self, site: str, participant: str, command: Command) -> None:
        self._buses[site].publish(BY_NAME["command"], participant=participant).put(command)

    def _write(self) -> None:
        # By their keys, too: tasks that are cancelled at the end speak in no certain order.
        write_said(self._writer, sorted(self._heard.take(), key=lambda s: (s.at_ns, s.place, s.key)))


def _on_a_wire(device: Device) -> bool:
    return device.simulated and device.kind.role in ("tracker", "glove")
