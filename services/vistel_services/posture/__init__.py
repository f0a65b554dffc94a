"""From tracker and glove frames to what each participant of a site does: the Motion stream."""

from vistel.capture.config import Config, configure
from vistel_services.posture.service import preload, run

__all__ = ["Config", "configure", "preload", "run"]
