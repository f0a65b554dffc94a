"""The trackers of a site: TrackerFrame messages from Polhemus units, VMC suites, VRPN servers and kinds of other packages."""

from vistel_services.devices.service import Config, DeviceService

__all__ = ["Config", "configure", "preload", "run"]

_service = DeviceService("tracker", "tracker")
configure = _service.configure
preload = _service.preload
run = _service.run
