"""The gloves of a site: GloveFrame messages from CyberGloves, 5DT Data Gloves, VRPN servers and kinds of other packages."""

from vistel_services.devices.service import Config, DeviceService

__all__ = ["Config", "configure", "preload", "run"]

_service = DeviceService("glove", "glove")
configure = _service.configure
preload = _service.preload
run = _service.run
