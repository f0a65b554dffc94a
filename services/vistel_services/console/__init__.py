"""A page on which anybody with a browser sees the room live, and how the conference goes (docs/how-to/watch-in-a-browser.md)."""

from importlib import import_module

from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock

__all__ = ["configure", "run"]


def configure(conference: Conference, site: Site | None, paths: RunPaths) -> tuple[Conference, RunPaths]:
    """The console is of the whole conference."""
    return conference, paths


async def run(config: tuple[Conference, RunPaths], bus: Bus, clock: Clock) -> None:
    """Serve until cancelled. What draws and computes is loaded when somebody looks."""
    await import_module("vistel_services.console.service").run(*config, bus, clock)
