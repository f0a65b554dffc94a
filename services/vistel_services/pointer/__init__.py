"""The pages of a site's guests: PointerFrame messages of what they do with mouse and keys."""

from vistel_services.devices.service import Config, DeviceService

__all__ = ["Config", "configure", "preload", "run"]

_service = DeviceService("pointer", "pointer")
configure = _service.configure
preload = _service.preload
run = _service.run
