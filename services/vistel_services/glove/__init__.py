"""The gloves of a site: CyberGlove bytes in, GloveFrame messages out."""

from __future__ import annotations

import asyncio
import logging
from dataclasses import dataclass

from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.protocol.glove_calibration import GloveCalibration, open_calibration
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel_services.device import keep_running
from vistel_services.glove.decoder import CyberGloveDecoder
from vistel_services.glove.driver import CyberGloveDriver
from vistel_services.transport import open_serial

__all__ = ["Config", "CyberGloveDecoder", "GloveDevice", "configure", "run"]
log = logging.getLogger("vistel.glove")


@dataclass(frozen=True)
class GloveDevice:
    """One glove."""

    name: str
    port: str
    baud: int
    right: bool
    sensors: int
    calibration: GloveCalibration


@dataclass(frozen=True)
class Config:
    """All gloves of a site. raw: publish their bytes too."""

    devices: tuple[GloveDevice, ...]
    raw: bool


def configure(conference: Conference, site: Site, paths: RunPaths) -> Config:
    """From the conference file; a simulated glove's port is a link among the run's files. Raises CalibrationError."""
    devices = [
        GloveDevice(
            name := f"{p.name}-glove-{side}",
            str(paths.device(name)) if glove.port == "sim" else glove.port,
            glove.baud, side == "right", glove.sensors, open_calibration(glove.calibration),
        )
        for p in site.participants for side, glove in sorted(p.gloves.items())
    ]  # fmt: skip
    return Config(tuple(devices), conference.record_raw)


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """One task per glove, until cancelled."""
    async with asyncio.TaskGroup() as group:
        for d in config.devices:
            driver = CyberGloveDriver(
                d.name, right=d.right, sensors=d.sensors, calibration=d.calibration, baud=d.baud
            )
            opener = open_serial(d.port, d.baud, clock)
            group.create_task(keep_running(driver, opener, bus, clock, log, raw=config.raw), name=d.name)
        await asyncio.Event().wait()
