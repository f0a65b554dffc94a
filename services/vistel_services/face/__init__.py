"""The faces of a site: phones with Live Link Face, face and eye cameras on helmets in; FaceFrame messages out."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2

from vistel.conference.devices import EyeConfig, FaceConfig
from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.vision.face_calibration import read_face
from vistel.vision.gaze_calibration import read_gaze
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel_services.devices.camera_transport import CameraSource, open_camera
from vistel_services.devices.device import keep_running
from vistel_services.devices.udp_transport import open_udp
from vistel_services.face.camera import CameraDecoder, CameraDriver, EyeSight, FaceSight, Sight
from vistel_services.face.live_link import LiveLinkDecoder, LiveLinkDriver

__all__ = ["Camera", "CameraDecoder", "Config", "LiveLinkDecoder", "Phone", "configure", "run", "sight_of"]
log = logging.getLogger("vistel.face")


@dataclass(frozen=True)
class Phone:
    """announce: where to write the port's number for a simulated one, else None."""

    name: str
    port: int
    announce: Path | None


@dataclass(frozen=True)
class Camera:
    """look: makes what sees something in its pictures; about: it, in words. keep: publish its pictures too."""

    name: str
    source: CameraSource
    look: Callable[[], Sight]
    about: str
    keep: bool


@dataclass(frozen=True)
class Config:
    """What sees the faces of a site. raw: publish the phones' packets too."""

    phones: tuple[Phone, ...]
    cameras: tuple[Camera, ...]
    raw: bool


def configure(conference: Conference, site: Site, paths: RunPaths) -> Config:
    """From the conference file. Raises CalibrationError."""
    phones: list[Phone] = []
    cameras: list[Camera] = []
    for p in site.participants:
        if p.face is not None and p.face.kind == "camera":
            cameras.append(_camera(f"{p.name}-face", p.face, conference, paths))
        elif p.face is not None:
            name = f"{p.name}-face"
            announce = paths.device(name) if p.face.port == "sim" else None
            phones.append(Phone(name, 0 if p.face.port == "sim" else p.face.port, announce))
        if p.eye is not None:
            cameras.append(_camera(f"{p.name}-eye", p.eye, conference, paths))
    return Config(tuple(phones), tuple(cameras), conference.record_raw)


def _camera(name: str, camera: FaceConfig | EyeConfig, conference: Conference, paths: RunPaths) -> Camera:
    source = CameraSource(announce=paths.device(name)) if camera.simulated else CameraSource(camera.source)
    about = "a face camera" if isinstance(camera, FaceConfig) else f"a camera at the {camera.eye} eye"
    return Camera(name, source, sight_of(camera), about, conference.record_raw and camera.keep_pictures)


def sight_of(camera: FaceConfig | EyeConfig) -> Callable[[], Sight]:
    """What sees something in the pictures of such a camera. Raises CalibrationError."""
    if isinstance(camera, FaceConfig):
        face = None if camera.calibration is None else read_face(camera.calibration)
        return lambda: FaceSight(face, mirrored=camera.mirrored)
    gaze = None if camera.calibration is None else read_gaze(camera.calibration)
    return lambda: EyeSight(gaze)


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


async def _run_camera(c: Camera, bus: Bus, clock: Clock) -> None:
    driver = CameraDriver(c.name, c.look(), c.about)
    opener = open_camera(c.source, clock, driver.decoder.look, keep=c.keep)
    await keep_running(driver, opener, bus, clock, log, raw=c.keep)
