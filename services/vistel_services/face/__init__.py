"""The faces of a site: phones with Live Link Face and cameras on helmets in, FaceFrame messages out."""

from __future__ import annotations

import asyncio
import logging
from dataclasses import dataclass
from pathlib import Path

import cv2

from vistel.conference.model import Conference, FaceConfig, Site
from vistel.conference.paths import RunPaths
from vistel.vision.face_calibration import FaceCalibration, read_face
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel_services.camera_transport import CameraSource, open_camera
from vistel_services.device import keep_running
from vistel_services.face.camera import CameraDecoder, CameraDriver, FaceSight
from vistel_services.face.live_link import LiveLinkDecoder, LiveLinkDriver
from vistel_services.udp_transport import open_udp

__all__ = ["CameraDecoder", "Config", "FaceCamera", "LiveLinkDecoder", "Phone", "configure", "face_sight", "run"]
log = logging.getLogger("vistel.face")


@dataclass(frozen=True)
class Phone:
    """announce: where to write the port's number for a simulated one, else None."""

    name: str
    port: int
    announce: Path | None


@dataclass(frozen=True)
class FaceCamera:
    """A camera that sees marks. keep: publish its pictures too."""

    name: str
    source: CameraSource
    calibration: FaceCalibration | None
    mirrored: bool
    keep: bool


@dataclass(frozen=True)
class Config:
    """What sees the faces of a site. raw: publish the phones' packets too."""

    phones: tuple[Phone, ...]
    cameras: tuple[FaceCamera, ...]
    raw: bool


def configure(conference: Conference, site: Site, paths: RunPaths) -> Config:
    """From the conference file. Raises CalibrationError."""
    phones: list[Phone] = []
    cameras: list[FaceCamera] = []
    for p in site.participants:
        name = f"{p.name}-face"
        if p.face is not None and p.face.kind == "camera":
            source = CameraSource(announce=paths.device(name)) if p.face.simulated else CameraSource(p.face.source)
            keep = conference.record_raw and p.face.keep_pictures
            cameras.append(FaceCamera(name, source, _calibration(p.face), p.face.mirrored, keep))
        elif p.face is not None:
            announce = paths.device(name) if p.face.port == "sim" else None
            phones.append(Phone(name, 0 if p.face.port == "sim" else p.face.port, announce))
    return Config(tuple(phones), tuple(cameras), conference.record_raw)


def face_sight(face: FaceConfig) -> FaceSight:
    """What looks at the pictures of such a camera. Raises CalibrationError."""
    return FaceSight(_calibration(face), mirrored=face.mirrored)


def _calibration(face: FaceConfig) -> FaceCalibration | None:
    return None if face.calibration is None else read_face(face.calibration)


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """One task per phone and camera, until cancelled."""
    if config.cameras:
        cv2.setNumThreads(1)  # teams of threads cost more than they bring for pictures of this size
    async with asyncio.TaskGroup() as group:
        for d in config.phones:
            opener = open_udp(d.port, clock, d.announce)
            driver = LiveLinkDriver(d.name, d.port)
            group.create_task(keep_running(driver, opener, bus, clock, log, raw=config.raw), name=d.name)
        for c in config.cameras:
            group.create_task(_run_camera(c, bus, clock), name=c.name)
        await asyncio.Event().wait()


async def _run_camera(c: FaceCamera, bus: Bus, clock: Clock) -> None:
    driver = CameraDriver(c.name, FaceSight(c.calibration, mirrored=c.mirrored), "a camera that sees 13 marks")
    opener = open_camera(c.source, clock, driver.decoder.look, keep=c.keep)
    await keep_running(driver, opener, bus, clock, log, raw=c.keep)
