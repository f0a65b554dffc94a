"""Draws the conference as a site sees it: figures that deform, the room, names, in a window and as video."""

import contextlib
from importlib import import_module

from vistel.conference.model import Conference
from vistel.render import preparation
from vistel_services.renderer.service import Config, configure, run

__all__ = ["Config", "configure", "preload", "run"]


def preload(conference: Conference) -> None:
    """Load and make ahead what the renderers of a conference need."""
    preparation.preload(conference)
    if any(site.display.stream_at for site in conference.sites):
        import_module("aiohttp.web")
    if any(site.display.window for site in conference.sites):
        for module in ("glfw", "imgui_bundle"):
            with contextlib.suppress(ImportError, OSError):  # said where the window is opened
                import_module(module)
