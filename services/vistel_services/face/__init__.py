"""The faces of a site: packets of Live Link Face in, FaceFrame messages out."""

from __future__ import annotations

import asyncio
import logging
from dataclasses import dataclass
from pathlib import Path

from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel_services.device import keep_running
from vistel_services.face.live_link import LiveLinkDecoder, LiveLinkDriver
from vistel_services.udp_transport import open_udp

__all__ = ["Config", "FaceDevice", "LiveLinkDecoder", "configure", "run"]
log = logging.getLogger("vistel.face")


@dataclass(frozen=True)
class FaceDevice:
    """One phone. announce: where to write the port's number for a simulated one, else None."""

    name: str
    port: int
    announce: Path | None


@dataclass(frozen=True)
class Config:
    """All phones of a site. raw: publish their packets too."""

    devices: tuple[FaceDevice, ...]
    raw: bool


def configure(conference: Conference, site: Site, paths: RunPaths) -> Config:
    """From the conference file."""
    devices = [
        FaceDevice(name := f"{p.name}-face", 0, paths.device(name)) if p.face.port == "sim"
        else FaceDevice(f"{p.name}-face", p.face.port, None)
        for p in site.participants if p.face is not None
    ]  # fmt: skip
    return Config(tuple(devices), conference.record_raw)


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """One task per phone, until cancelled."""
    async with asyncio.TaskGroup() as group:
        for d in config.devices:
            opener = open_udp(d.port, clock, d.announce)
            driver = LiveLinkDriver(d.name, d.port)
            group.create_task(keep_running(driver, opener, bus, clock, log, raw=config.raw), name=d.name)
        await asyncio.Event().wait()
