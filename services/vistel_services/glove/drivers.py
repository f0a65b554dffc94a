"""The drivers of the built-in kinds of gloves (`DeviceKind.driver`)."""

from functools import partial
from pathlib import Path

from vistel.conference.device_list import Device
from vistel.conference.devices import GloveConfig
from vistel.devices.transport.hid import find_hid, open_hid
from vistel.devices.transport.serial_port import open_serial
from vistel.protocol import fivedt as fivedt_protocol
from vistel.protocol.fivedt_calibration import load_calibration
from vistel.protocol.glove_calibration import open_calibration
from vistel.protocol.glove_frames import FiveDtDecoder, highest_of
from vistel.protocol.vrpn import SIMULATED_GLOVE, parse_address
from vistel.protocol.vrpn_frames import VrpnGloveDecoder
from vistel.wire.topics import BY_NAME
from vistel_services.devices.service import Connected
from vistel_services.devices.vrpn_driver import VrpnDriver, open_vrpn
from vistel_services.glove.cyberglove import CyberGloveDriver
from vistel_services.glove.fivedt import FiveDtDriver


def cyberglove(device: Device, link: Path | None) -> Connected:
    """A CyberGlove."""
    keys = device.config_as(GloveConfig)
    calibration = open_calibration(keys.calibration)
    driver = CyberGloveDriver(device.name, right=device.right, sensors=keys.sensors, calibration=calibration, baud=keys.baud)
    return Connected(driver, partial(open_serial, str(link or device.port), keys.baud))


def fivedt(device: Device, link: Path | None) -> Connected:
    """A 5DT Data Glove, by the name of its kind; an Ultra may be on USB."""
    keys, right = device.config_as(GloveConfig), device.right
    calibration = load_calibration(keys.calibration, highest_of(keys.kind))
    usb = device.port == "usb"
    decoder = FiveDtDecoder(
        device.name, keys.kind, right=right, sensors=keys.sensors, calibration=calibration, reports=usb, baud=keys.baud
    )
    driver = FiveDtDriver(keys.kind, decoder, right=right, sensors=keys.sensors)
    if not usb:
        return Connected(driver, partial(open_serial, str(link or device.port), keys.baud))
    wanted = partial(fivedt_protocol.product_is, right=right, sensors=keys.sensors)
    title = fivedt_protocol.ultra_name(right=right, sensors=keys.sensors)
    find = find_hid(fivedt_protocol.VENDOR_ID, wanted, title, fivedt_protocol.product_name)
    return Connected(driver, partial(open_hid, find))


def vrpn(device: Device, link: Path | None) -> Connected:
    """A glove of a VRPN server: a 5DT glove's channels, or the contacts of pinch gloves, which need no calibration."""
    keys = device.config_as(GloveConfig)
    calibration = load_calibration(keys.calibration, highest_of(keys.kind)) if device.kind.calibration else None
    name = SIMULATED_GLOVE if device.simulated else parse_address(device.port)[0]
    decoder = VrpnGloveDecoder(device.name, name, right=device.right, sensors=keys.sensors, calibration=calibration)
    about = f"{keys.sensors} sensors" if calibration is not None else "contacts"
    driver = VrpnDriver(device.name, BY_NAME["glove"], decoder, name, about, pinged=True)
    return Connected(driver, open_vrpn(device.port, link))
