"""The faces of a site: FaceFrame messages from phones with Live Link Face, face cameras and eye cameras."""

from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel_services.devices.service import Config, DeviceService

__all__ = ["Config", "configure", "preload", "run"]

_service = DeviceService("face", "face", "eye")
configure = _service.configure
preload = _service.preload


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """Run the devices until cancelled."""
    if config.devices:
        import cv2  # a site without cameras need not load it

        cv2.setNumThreads(1)  # teams of threads cost more than they bring for pictures of this size
    await _service.run(config, bus, clock)
