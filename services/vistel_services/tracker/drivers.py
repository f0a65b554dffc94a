"""The drivers of the built-in kinds of trackers (`DeviceKind.driver`)."""

from functools import partial
from pathlib import Path

from vistel.capture.vmc_frames import VmcDecoder
from vistel.conference.device_list import Device
from vistel.conference.devices import AnyTracker
from vistel.devices.transport.serial_port import open_serial
from vistel.protocol.vrpn import SIMULATED, parse_address
from vistel.protocol.vrpn_frames import VrpnTrackerDecoder
from vistel.wire.topics import BY_NAME
from vistel_services.devices.sender_driver import SenderDriver
from vistel_services.devices.service import Connected, udp_opener
from vistel_services.devices.vrpn_driver import VrpnDriver, open_vrpn
from vistel_services.tracker.fastrak import FastrakDriver
from vistel_services.tracker.liberty import LibertyDriver

_HEIGHT_M = 1.75
"""Of a body whose wearer is not known [m]."""


def fastrak(device: Device, link: Path | None) -> Connected:
    """A FASTRAK; of two synchronised units the second adds `first_station` to its station numbers."""
    keys = device.config_as(AnyTracker)
    driver = FastrakDriver(device.name, device.stations, keys.hemisphere, keys.baud, first_station=device.first_station)
    return Connected(driver, partial(open_serial, str(link or device.port), keys.baud))


def liberty(device: Device, link: Path | None) -> Connected:
    """A LIBERTY or PATRIOT, by the name of its kind."""
    keys = device.config_as(AnyTracker)
    driver = LibertyDriver(device.name, keys.kind, device.stations, keys.hemisphere, keys.baud)
    return Connected(driver, partial(open_serial, str(link or device.port), keys.baud))


def vmc(device: Device, link: Path | None) -> Connected:
    """A suite that sends VMC."""
    height_m = device.participant.height if device.participant is not None else _HEIGHT_M
    missing = f"no tracking suite sends VMC to UDP port {link or device.port}"
    decoder = VmcDecoder(device.name, height_m)
    driver = SenderDriver(
        device.name, BY_NAME["tracker"], decoder, "a VMC tracking suite", missing, lambda: "a tracked body over VMC"
    )
    return Connected(driver, udp_opener(device, link))


def vrpn(device: Device, link: Path | None) -> Connected:
    """A tracker of a VRPN server."""
    name = SIMULATED if device.simulated else parse_address(device.port)[0]
    driver = VrpnDriver(
        device.name, BY_NAME["tracker"], VrpnTrackerDecoder(device.name, name), name, f"{len(device.stations)} sensors"
    )
    return Connected(driver, open_vrpn(device.port, link))
