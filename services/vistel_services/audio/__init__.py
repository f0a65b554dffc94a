"""The sound of a site: microphones to Voice messages; received voices to the loudspeaker, delayed to match their pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vistel_services.audio.config import Config, Microphone, configure

if TYPE_CHECKING:
    from vistel.conference.model import Conference
    from vistel.wire.bus import Bus
    from vistel.wire.clock import Clock

__all__ = ["Config", "Microphone", "configure", "preload", "run"]


def preload(conference: Conference) -> None:
    """Load what the sites of a conference need."""
    if any(site.audio is not None for site in conference.sites):
        import vistel_services.audio.service  # noqa: F401


async def run(config: Config | None, bus: Bus, clock: Clock) -> None:
    """Runs until cancelled; returns at once at a site without sound."""
    if config is None:
        return
    from vistel_services.audio.service import run_audio  # not needed at a site without sound

    await run_audio(config, bus, clock)
