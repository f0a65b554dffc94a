"""The drivers of a guest's page, of its camera and of its headset (`DeviceKind.driver`). The console's gateway sends to them what
it has checked, on this machine."""

from pathlib import Path

from vistel.conference.device_list import Device
from vistel.protocol.pages.camera_body import CameraBodyDecoder
from vistel.protocol.pages.headset import HeadsetDecoder
from vistel.protocol.pages.pointer import PointerDecoder
from vistel.wire.topics import BY_NAME
from vistel_services.devices.device import Decoder, Link
from vistel_services.devices.sender_driver import SenderDriver
from vistel_services.devices.service import Connected, udp_opener


class PageDriver(SenderDriver):
    """Streams from the beginning: a seat that nobody has taken yet is no fault."""

    async def start(self, link: Link) -> str:
        """See `Driver.start`."""
        return self._about()


def page(device: Device, link: Path | None) -> Connected:
    """A page of the console. link: the file in which the gateway finds the port."""
    return _connected(device, link, PointerDecoder(device.name), "the page of a guest", "nobody has entered here")


def camera(device: Device, link: Path | None) -> Connected:
    """The camera of such a page."""
    return _connected(device, link, CameraBodyDecoder(device.name), "the camera of a guest's page", "no guest uses it")


def headset(device: Device, link: Path | None) -> Connected:
    """The headset with which a guest has entered by such a page."""
    return _connected(device, link, HeadsetDecoder(device.name), "the headset of a guest's page", "no guest uses it")


def _connected(device: Device, link: Path | None, decoder: Decoder, about: str, absent: str) -> Connected:
    driver = PageDriver(device.name, BY_NAME[device.kind.topic], decoder, about, "", lambda: about)
    return Connected(driver, udp_opener(device, link), absent=absent)
