"""What people say to the room: from Voice messages to Commands, answered in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vistel_services.speech.config import Config, configure

if TYPE_CHECKING:
    from vistel.conference.model import Conference
    from vistel.wire.bus import Bus
    from vistel.wire.clock import Clock

__all__ = ["Config", "configure", "preload", "run"]


def preload(conference: Conference) -> None:
    """Load what its sites will need."""
    if any(site.speech is not None for site in conference.sites):
        import vistel_services.speech.service  # noqa: F401


async def run(config: Config | None, bus: Bus, clock: Clock) -> None:
    """Until cancelled; at a site where nobody speaks to the room, nothing."""
    if config is None:
        return
    from vistel_services.speech.service import run_speech  # a site without speech need not load it

    await run_speech(config, bus, clock)
