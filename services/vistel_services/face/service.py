"""The faces of a site: FaceFrame messages from phones with Live Link Face, face cameras and eye cameras."""

from __future__ import annotations

import logging

import cv2

from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.devices.kind import Role
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel_services.devices import service
from vistel_services.devices.service import Config

log = logging.getLogger("vistel.face")

ROLES: tuple[Role, ...] = ("face", "eye")


def configure(conference: Conference, site: Site, paths: RunPaths) -> Config:
    """From the conference file. Raises CalibrationError (one line)."""
    return service.configure(ROLES, conference, site, paths)


def preload(conference: Conference) -> None:
    """Load the drivers, ahead of `run`."""
    service.preload(ROLES, conference)


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """Run the devices until cancelled."""
    if config.devices:
        cv2.setNumThreads(1)  # teams of threads cost more than they bring for pictures of this size
    await service.run(config, bus, clock, log)
