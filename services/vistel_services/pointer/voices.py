"""The microphones of guests' pages: what the console's gateway passes on becomes the voice of the guest, as any microphone's."""

from __future__ import annotations

import contextlib
import logging
from dataclasses import dataclass
from pathlib import Path

from vistel.audio.page_voice import PageVoice
from vistel.conference.device_names import microphone_name
from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.v1.audio_pb2 import Voice
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME
from vistel_services.devices.udp_transport import UdpTransport

log = logging.getLogger("vistel.pointer")

_LEVEL_NS = 240_000_000
"""How often a crowd is told how loud a voice is."""
_CONTROL_NS = 100_000_000
"""How soon a microphone is muted that somebody mutes."""


@dataclass(frozen=True)
class Microphones:
    """files: by participant, where the gateway finds the port; crowded: whether levels are published."""

    site: str
    files: dict[str, Path]
    crowded: bool


def microphones(conference: Conference, site: Site, paths: RunPaths) -> Microphones:
    """Those of the pages of a site."""
    files = {p.name: paths.device(microphone_name(p.name)) for p in site.participants if p.by_link}
    return Microphones(site.name, files, bool(conference.crowd))


async def run_microphones(config: Microphones, bus: Bus, clock: Clock) -> None:
    """Publish the voices of guests until cancelled."""
    controls = bus.subscribe(BY_NAME["voice_control"], polled=True, site=config.site)
    with contextlib.ExitStack() as open_now:
        open_now.callback(controls.close)
        pages = {name: _Page(name, config, bus) for name in config.files}
        for name, file in config.files.items():
            transport = UdpTransport(0, clock, pages[name].take, file, "", ())
            open_now.callback(transport.close)
        due_ns = clock.now_ns()
        while True:
            for sample in controls.take():
                if page := pages.get(sample.names["participant"]):
                    page.open = not sample.message.muted and (sample.message.talk or not sample.message.push_to_talk)
            await clock.sleep_until_ns(due_ns := max(due_ns + _CONTROL_NS, clock.now_ns()))


class _Page:
    def __init__(self, participant: str, config: Microphones, bus: Bus) -> None:
        self.open = True
        self._voice, self._told_ns = PageVoice(), 0
        self._publication = bus.publish(BY_NAME["voice"], participant=participant)
        self._levels = bus.publish(BY_NAME["voice_level"], participant=participant) if config.crowded else None

    def take(self, data: bytes, now_ns: int) -> None:
        """What the gateway has passed on."""
        message = self._voice.message(data, now_ns) if self.open else None
        if message is None:
            return
        self._publication.put(message)
        if self._levels is not None and now_ns - self._told_ns >= _LEVEL_NS:
            self._told_ns = now_ns
            level = Voice(level_db=message.level_db, talking=message.talking)
            level.header.t_ns = message.header.t_ns
            self._levels.put(level)
