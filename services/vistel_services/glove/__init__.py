"""The gloves of a site: bytes of CyberGloves, 5DT Data Gloves and VRPN servers in, GloveFrame messages out."""

from __future__ import annotations

import asyncio
import functools
import logging
from dataclasses import dataclass
from pathlib import Path

from vistel.conference.devices import GloveConfig
from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.protocol import fivedt, fivedt_calibration
from vistel.protocol.fivedt_calibration import FiveDtCalibration
from vistel.protocol.glove_calibration import GloveCalibration, open_calibration
from vistel.protocol.vrpn import SIMULATED_GLOVE, parse_address
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME
from vistel_services.devices.device import Driver, keep_running
from vistel_services.devices.hid_transport import find_hid, open_hid
from vistel_services.devices.tcp_transport import open_tcp
from vistel_services.devices.transport import OpenTransport, open_serial
from vistel_services.devices.vrpn_driver import VrpnDriver
from vistel_services.glove.decoder import CyberGloveDecoder
from vistel_services.glove.driver import CyberGloveDriver
from vistel_services.glove.fivedt_driver import HIGHEST, FiveDtDecoder, FiveDtDriver
from vistel_services.glove.vrpn import VrpnGloveDecoder

__all__ = ["Config", "CyberGloveDecoder", "FiveDtDecoder", "GloveDevice", "VrpnGloveDecoder", "configure", "decoder_of", "run"]
log = logging.getLogger("vistel.glove")

_VRPN = ("vrpn", "vrpn_pinch")


@dataclass(frozen=True)
class GloveDevice:
    """One glove."""

    name: str
    kind: str
    port: str
    baud: int
    right: bool
    sensors: int
    calibration: GloveCalibration | FiveDtCalibration | None
    """None: a pinch glove, whose contacts need none."""
    announce: Path | None = None
    """Where a simulated VRPN server says its port."""


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
            glove.kind,
            str(paths.device(name)) if glove.port == "sim" else glove.port,
            glove.baud,
            side == "right",
            glove.sensors,
            _calibration(glove),
            announce=paths.device(name) if glove.kind in _VRPN and glove.port == "sim" else None,
        )
        for p in site.participants
        for side, glove in sorted(p.gloves.items())
    ]
    return Config(tuple(devices), conference.record_raw)


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """One task per glove, until cancelled."""
    async with asyncio.TaskGroup() as group:
        for d in config.devices:
            group.create_task(keep_running(_driver(d), _opener(d, clock), bus, clock, log, raw=config.raw), name=d.name)
        await asyncio.Event().wait()


def _calibration(glove: GloveConfig) -> GloveCalibration | FiveDtCalibration | None:
    if glove.kind == "vrpn_pinch":
        return None
    if glove.kind == "cyberglove":
        return open_calibration(glove.calibration)
    return fivedt_calibration.load_calibration(glove.calibration, HIGHEST.get(glove.kind, fivedt.HIGHEST))


def _driver(d: GloveDevice) -> Driver:
    if d.kind in _VRPN:
        name = SIMULATED_GLOVE if d.announce else parse_address(d.port)[0]
        calibration = d.calibration if isinstance(d.calibration, FiveDtCalibration) else None
        decoder = VrpnGloveDecoder(d.name, name, right=d.right, sensors=d.sensors, calibration=calibration)
        has = f"{d.sensors} sensors" if calibration is not None else "contacts"
        return VrpnDriver(d.name, BY_NAME["glove"], decoder, name, has, pinged=True)
    if isinstance(d.calibration, GloveCalibration):
        return CyberGloveDriver(d.name, right=d.right, sensors=d.sensors, calibration=d.calibration, baud=d.baud)
    assert d.calibration is not None
    decoder = FiveDtDecoder(
        d.name, d.kind, right=d.right, sensors=d.sensors, calibration=d.calibration, reports=d.port == "usb", baud=d.baud
    )
    return FiveDtDriver(d.kind, decoder, right=d.right, sensors=d.sensors)


def _opener(d: GloveDevice, clock: Clock) -> OpenTransport:
    if d.kind in _VRPN:
        _, host, port = ("", "127.0.0.1", 0) if d.announce else parse_address(d.port)
        return open_tcp(host, port, clock, d.announce)
    if d.port != "usb":
        return open_serial(d.port, d.baud, clock)
    what = fivedt.ultra_name(right=d.right, sensors=d.sensors)
    wanted = functools.partial(fivedt.product_is, right=d.right, sensors=d.sensors)
    return open_hid(find_hid(fivedt.VENDOR_ID, wanted, what, fivedt.product_name), clock)


def decoder_of(glove: GloveConfig, device: str) -> CyberGloveDecoder | FiveDtDecoder | VrpnGloveDecoder:
    """What reads the recorded bytes of a glove of the conference file. Raises CalibrationError."""
    right = device.endswith("-right")
    calibration = _calibration(glove)
    if isinstance(calibration, GloveCalibration):
        return CyberGloveDecoder(device, right=right, sensors=glove.sensors, calibration=calibration)
    if glove.kind in _VRPN or calibration is None:
        return VrpnGloveDecoder(device, "", right=right, sensors=glove.sensors, calibration=calibration)
    return FiveDtDecoder(
        device, glove.kind, right=right, sensors=glove.sensors, calibration=calibration, reports=glove.port == "usb"
    )
