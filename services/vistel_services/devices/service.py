"""Runs the devices of a site, whatever their kind: bytes in, messages out. The services of trackers, gloves and faces use it."""

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from vistel.conference.device_list import Device, devices_of, devices_of_site
from vistel.conference.devices import UdpPort
from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.devices.kind import Role, load
from vistel.devices.transport import OpenTransport
from vistel.devices.transport.udp import open_udp
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel_services.devices.device import Driver, keep_running


@dataclass(frozen=True)
class Connected:
    """A device's driver, and how its port is opened. keeps_raw: its bytes may be recorded; absent: what its silence means, in a
    line, where it sends when somebody comes; empty: it is started again for that."""

    driver: Driver
    opener: Callable[[Clock], OpenTransport]
    keeps_raw: bool = True
    absent: str = ""


@dataclass(frozen=True)
class Config:
    """The devices of a service. raw: publish their bytes too."""

    devices: tuple[Connected, ...]
    raw: bool


def connect(device: Device, link: Path | None = None) -> Connected:
    """What `DeviceKind.driver` gives for a device. link: the file by which its simulator or its page is found, None for other
    devices or for recorded bytes. Raises GloveCalibrationError or FaceCalibrationError (one line)."""
    return load(device.kind.driver)(device, link)


def udp_opener(device: Device, link: Path | None) -> Callable[[Clock], OpenTransport]:
    """Opens the UDP port of the file for whom the file allows; or, for a device found by the file `link`, any of this machine."""
    if device.found_by_file:
        return partial(open_udp, 0, announce=link)
    keys = device.config if isinstance(device.config, UdpPort) else UdpPort()
    return partial(open_udp, int(device.port), listen=keys.listen, senders=keys.senders)


class DeviceService:
    """The service of a site's devices with some roles."""

    def __init__(self, name: str, *roles: Role) -> None:
        """name: as the log calls it."""
        self._log, self._roles = logging.getLogger(f"vistel.{name}"), roles

    def configure(self, conference: Conference, site: Site, paths: RunPaths) -> Config:
        """The devices of a site. Raises GloveCalibrationError or FaceCalibrationError (one line)."""
        wanted = [d for d in devices_of_site(site) if d.kind.role in self._roles]
        return Config(tuple(connect(d, paths.device(d.name) if d.found_by_file else None) for d in wanted), conference.record_raw)

    def preload(self, conference: Conference) -> None:
        """Import the drivers that a conference needs, ahead of `configure`."""
        for reference in {d.kind.driver for d in devices_of(conference) if d.kind.role in self._roles}:
            load(reference)

    async def run(self, config: Config, bus: Bus, clock: Clock) -> None:
        """One task for each device, until cancelled."""
        async with asyncio.TaskGroup() as group:
            for d in config.devices:
                raw = config.raw and d.keeps_raw
                running = keep_running(d.driver, d.opener(clock), bus, clock, self._log, raw=raw, absent=d.absent)
                group.create_task(running, name=d.driver.name)
            await asyncio.Event().wait()
