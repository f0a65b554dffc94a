"""The pages of a site's guests: PointerFrame messages of what they do with mouse and keys, CameraBodyFrame messages of what their
camera sees, HeadsetFrame messages of what their headset measures, Voice messages of what they say."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel_services.devices import service
from vistel_services.pointer.voices import Microphones, microphones, run_microphones

__all__ = ["Config", "configure", "preload", "run"]

_service = service.DeviceService("pointer", "pointer", "camera_body", "headset")
preload = _service.preload


@dataclass(frozen=True)
class Config:
    """The pages of a site: their mouse and keys, cameras, headsets and microphones."""

    devices: service.Config
    microphones: Microphones


def configure(conference: Conference, site: Site, paths: RunPaths) -> Config:
    """The pages of a site's guests."""
    return Config(_service.configure(conference, site, paths), microphones(conference, site, paths))


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """Publish what pages say until cancelled."""
    async with asyncio.TaskGroup() as group:
        group.create_task(_service.run(config.devices, bus, clock))
        group.create_task(run_microphones(config.microphones, bus, clock))
