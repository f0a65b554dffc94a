"""The trackers of a site: TrackerFrame messages from Polhemus units, VMC suites, VRPN servers and kinds of other packages."""

from vistel_services.tracker.service import Config, configure, preload, run

__all__ = ["Config", "configure", "preload", "run"]
