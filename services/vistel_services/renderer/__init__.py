"""Draws the conference as a site sees it: figures that deform, the room, names, in a window and as video."""

from vistel_services.renderer.ready import preload
from vistel_services.renderer.service import Config, configure, run

__all__ = ["Config", "configure", "preload", "run"]
