"""The sound of a site: microphones to Voice messages, everybody's voices to the loudspeaker, as late as their pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vistel_services.audio.config import Config, Microphone, configure

if TYPE_CHECKING:
    from vistel.wire.bus import Bus
    from vistel.wire.clock import Clock

__all__ = ["Config", "Microphone", "configure", "run"]


async def run(config: Config | None, bus: Bus, clock: Clock) -> None:
    """Until cancelled; at a site without sound, nothing."""
    if config is None:
        return
    from vistel_services.audio.service import run_audio  # noqa: PLC0415  a site without sound need not load it

    await run_audio(config, bus, clock)
