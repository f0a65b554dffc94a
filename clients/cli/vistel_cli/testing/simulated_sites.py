"""The sites of a conference in simulated time: devices, their drivers and postures, a quarter of a second at a time."""

from __future__ import annotations

import asyncio
from collections.abc import Generator
from dataclasses import replace

from vistel.conference.device_list import devices_of_site
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.wire import background
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.simulated_loop import LoopClock, SimulatedLoop
from vistel_cli.log.fast_sites import WINDOW_NS, PublishedMessages, Window, ended
from vistel_services import glove, posture, tracker
from vistel_services.devices.service import Config
from vistel_sim.device import SimulatedDevice, run_devices
from vistel_sim.faults import Fault
from vistel_sim.limbs import own_limbs
from vistel_sim.motion import open_motion
from vistel_sim.ports.wire_port import Wires
from vistel_sim.process import simulators

SERVICES = tracker, glove
"""Services of devices that take part."""


def simulated_sites(
    conference: Conference, begin_ns: int, paths: RunPaths, faults: tuple[Fault, ...]
) -> Generator[Window, None, None]:
    """What everybody at all sites says, without an end. Raises ValueError, one line, where a device is at no serial port, or for a
    fault of an unknown one. Nothing happens before the first window is asked for."""
    with asyncio.Runner(loop_factory=SimulatedLoop) as runner:
        sites = _Sites()
        runner.run(sites.begin(conference, begin_ns, paths, faults))
        try:
            while True:
                begin_ns += WINDOW_NS
                yield runner.run(sites.window(begin_ns))
        finally:
            runner.run(ended(sites.running))


class _Sites:
    """All sites on one bus; their devices are on wires of this process."""

    def __init__(self) -> None:
        self.running: list[asyncio.Task[None]] = []

    async def begin(self, conference: Conference, begin_ns: int, paths: RunPaths, faults: tuple[Fault, ...]) -> None:
        self._clock, network, wires = LoopClock(begin_ns), MemoryNetwork(), Wires()
        self._listener = PublishedMessages(network, self._clock)
        limbs = own_limbs(conference)
        motion = open_motion(conference, limbs)
        devices = simulators(conference, motion, paths, self._clock, begin_ns, faults=faults, limbs=limbs, port=wires.port)
        if other := [d.name for d in devices if not isinstance(d, SimulatedDevice)]:
            raise ValueError(f"simulated time: {', '.join(other)}: not at a serial port; leave it out")
        self.running.append(background.start(run_devices(devices), "devices"))
        for site in conference.sites:
            bus = network.bus(conference.name, site.name, self._clock)
            bauds = {d.name: int(getattr(d.config, "baud", 115200)) for d in devices_of_site(site)}
            for service in SERVICES:
                config = service.configure(conference, site, paths)
                wired = tuple(replace(c, opener=wires.opener(c.driver.name, bauds[c.driver.name])) for c in config.devices)
                work = service.run(Config(wired, config.raw), bus, self._clock)
                self.running.append(background.start(work, service.__name__))
            work = posture.run(posture.configure(conference, site, paths), bus, self._clock)
            self.running.append(background.start(work, "posture"))

    async def window(self, until_ns: int) -> Window:
        """Go on to `until_ns`."""
        await self._clock.sleep_until_ns(until_ns)
        for task in self.running:
            if task.done():
                task.result()
        return Window(until_ns, self._listener.take(), 0, ())
