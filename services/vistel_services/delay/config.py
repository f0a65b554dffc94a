"""The equipment of a site, from the conference file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.protocol.equipment import Register


@dataclass(frozen=True)
class Device:
    """address: "tcp:HOST:PORT", "rtu:PORT", "rtu+tcp:HOST:PORT"; announce: the file that has the address of a simulated
    device. delay_channel: of a delay unit, 0 for other devices. settings: what is desired from the start, by register."""

    name: str
    address: str
    announce: Path | None
    device_id: int
    registers: Mapping[str, Register]
    baud: int = 19200
    parity: str = "E"
    delay_channel: int = 0
    settings: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True)
class Config:
    """The devices of a site."""

    devices: tuple[Device, ...] = ()


def equipment_device(site: str, name: str) -> str:
    """The name of a simulated device."""
    return f"{site}-{name}"


def configure(conference: Conference, site: Site | None, paths: RunPaths) -> Config:
    """The equipment of `site`."""
    if site is None or site.audio is None:
        return Config()
    return Config(
        tuple(
            Device(
                e.name,
                e.address,
                paths.device(equipment_device(site.name, e.name)) if e.simulated else None,
                e.device_id,
                MappingProxyType(e.map()),
                e.baud,
                e.parity,
                e.channel if e.role == "delay" else 0,
                MappingProxyType(dict(e.settings)),
            )
            for e in site.audio.equipment
        )
    )
