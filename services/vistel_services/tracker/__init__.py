"""The trackers of a site: bytes of FASTRAK, LIBERTY, PATRIOT, VRPN servers and VR suites in, TrackerFrame messages out."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.protocol.vrpn import SIMULATED, parse_address
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME
from vistel_services.devices.device import Driver, keep_running
from vistel_services.devices.tcp_transport import open_tcp
from vistel_services.devices.transport import OpenTransport, open_serial
from vistel_services.devices.udp_transport import open_udp
from vistel_services.devices.vrpn_driver import VrpnDriver
from vistel_services.tracker.decoder import FastrakDecoder, LibertyDecoder
from vistel_services.tracker.fastrak import FastrakDriver
from vistel_services.tracker.liberty import LibertyDriver
from vistel_services.tracker.vmc import VmcDecoder, VmcDriver
from vistel_services.tracker.vrpn import VrpnDecoder

__all__ = [
    "Config",
    "FastrakDecoder",
    "LibertyDecoder",
    "TrackerDevice",
    "VmcDecoder",
    "VrpnDecoder",
    "configure",
    "decoder_of",
    "run",
]
log = logging.getLogger("vistel.tracker")


@dataclass(frozen=True)
class TrackerDevice:
    """One unit. stations: role to station, from 1; hemisphere: the side the receivers stay on, transmitter frame."""

    name: str
    kind: str
    port: str
    baud: int
    stations: Mapping[str, int]
    hemisphere: tuple[float, float, float]
    height_m: float = 1.75
    """Of who wears it."""
    second: bool = False
    """Of two synchronised FASTRAKs: its stations are numbered from 5."""
    announce: Path | None = None
    """Where a simulated suite finds the UDP port, or a simulated VRPN server says its TCP port."""


@dataclass(frozen=True)
class Config:
    """All trackers of a site. raw: publish their bytes too."""

    devices: tuple[TrackerDevice, ...]
    raw: bool


def configure(conference: Conference, site: Site, paths: RunPaths) -> Config:
    """From the conference file; a simulated device's port is a link among the run's files."""
    devices = [
        TrackerDevice(
            name := f"{p.name}-tracker",
            p.tracker.kind,
            str(paths.device(name)) if p.tracker.port == "sim" else p.tracker.port,
            p.tracker.baud,
            {str(role): n for role, n in p.tracker.stations.items() if n <= 4 or not p.tracker.second_port},
            p.tracker.hemisphere,
            p.height,
            announce=paths.device(name) if p.tracker.kind in ("vmc", "vrpn") and p.tracker.port == "sim" else None,
        )
        for p in site.participants
        if p.tracker is not None
    ]
    devices += [
        TrackerDevice(
            name := f"{p.name}-tracker-2",
            p.tracker.kind,
            str(paths.device(name)) if p.tracker.second_port == "sim" else p.tracker.second_port,
            p.tracker.baud,
            {str(role): n - 4 for role, n in p.tracker.stations.items() if n > 4},
            p.tracker.hemisphere,
            second=True,
        )
        for p in site.participants
        if p.tracker is not None and p.tracker.second_port
    ]
    devices += [
        TrackerDevice(
            p.device,
            p.tracker.kind,
            str(paths.device(p.device)) if p.tracker.port == "sim" else p.tracker.port,
            p.tracker.baud,
            {p.thing: p.tracker.station},
            p.tracker.hemisphere,
        )
        for p in site.props
    ]
    return Config(tuple(devices), conference.record_raw)


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """One task per tracker, until cancelled."""
    async with asyncio.TaskGroup() as group:
        for d in config.devices:
            group.create_task(keep_running(_driver(d), _opener(d, clock), bus, clock, log, raw=config.raw), name=d.name)
        await asyncio.Event().wait()


def _opener(d: TrackerDevice, clock: Clock) -> OpenTransport:
    if d.kind == "vrpn":
        _, host, port = ("", "127.0.0.1", 0) if d.announce else parse_address(d.port)
        return open_tcp(host, port, clock, d.announce)
    if d.kind != "vmc":
        return open_serial(d.port, d.baud, clock)
    return open_udp(0 if d.announce else int(d.port), clock, d.announce)


def _driver(d: TrackerDevice) -> Driver:
    if d.kind == "vmc":
        return VmcDriver(d.name, d.port, d.height_m)
    if d.kind == "vrpn":
        name = SIMULATED if d.announce else parse_address(d.port)[0]
        return VrpnDriver(d.name, BY_NAME["tracker"], VrpnDecoder(d.name, name), name, f"{len(d.stations)} sensors")
    if d.kind == "fastrak":
        return FastrakDriver(d.name, d.stations, d.hemisphere, d.baud, second=d.second)
    return LibertyDriver(d.name, d.kind, d.stations, d.hemisphere, d.baud)


def decoder_of(kind: str, device: str, height_m: float) -> FastrakDecoder | LibertyDecoder | VmcDecoder | VrpnDecoder:
    """What reads the recorded bytes of a tracker of this kind of the conference file, on a person so tall."""
    if kind == "vrpn":
        return VrpnDecoder(device, "")
    if kind == "vmc":
        return VmcDecoder(device, height_m)
    return FastrakDecoder(device, first=4 if device.endswith("-tracker-2") else 0) if kind == "fastrak" else LibertyDecoder(device)
