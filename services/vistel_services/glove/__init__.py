"""The gloves of a site: GloveFrame messages from CyberGloves, 5DT Data Gloves, VRPN servers and kinds of other packages."""

from vistel_services.glove.service import Config, configure, preload, run

__all__ = ["Config", "configure", "preload", "run"]
