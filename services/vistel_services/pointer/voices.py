"""What guests' pages say: what the console's gateway passes on becomes the voice of the guest, as any microphone's, their lines
of the chat, the pictures that they show, and what they ask of panels."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from vistel.audio.delay_policy import MATCH
from vistel.audio.microphone_switches import PAGE, MicrophoneSwitches
from vistel.audio.page_voice import PageVoice
from vistel.conference.device_names import microphone_name
from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.devices.transport.udp import UdpTransport
from vistel.messages.chat import ChatError, line_message
from vistel.protocol.pages.pointer import asked_of, line_of, picture_of
from vistel.protocol.pages.screen import part_of
from vistel.session.chat import lines_of
from vistel.session.microphone_controls import MicrophoneControls
from vistel.session.page_writing import GUEST_COMMANDS
from vistel.speech.visemes.reader import VisemeReader
from vistel.v1.audio_pb2 import SoundStatus
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.link.voice_levels import VoiceLevels
from vistel.wire.parcels import part_name
from vistel.wire.topics import BY_NAME

log = logging.getLogger("vistel.pointer")

_CONTROL_NS = 100_000_000
"""How soon a microphone is muted that somebody mutes."""
_REPORT_NS = 250_000_000


@dataclass(frozen=True)
class Microphones:
    """files: by participant, where the gateway finds the port; memory: file of their switches; crowded: whether levels are
    published; reports: whether their state is, which the audio service does where the site has one; sites: of all participants."""

    site: str
    files: dict[str, Path]
    memory: Path
    crowded: bool
    reports: bool
    sites: Mapping[str, str]


def microphones(conference: Conference, site: Site, paths: RunPaths) -> Microphones:
    """Those of the pages of a site."""
    files = {p.name: paths.device(microphone_name(p.name)) for p in site.participants if p.by_link}
    sites = {p.name: s.name for s in conference.sites for p in s.participants}
    return Microphones(site.name, files, paths.run / f"{site.name}-pages.json", bool(conference.crowd), site.audio is None, sites)


async def run_microphones(config: Microphones, bus: Bus, clock: Clock) -> None:
    """Publish the voices of guests until cancelled."""
    switches = MicrophoneSwitches(dict.fromkeys(config.files, False), config.memory)
    controls = MicrophoneControls(bus, config.site, switches)
    status = bus.publish(BY_NAME["sound_status"])
    with contextlib.ExitStack() as open_now:
        open_now.callback(controls.close)
        for name, file in config.files.items():
            transport = UdpTransport(0, clock, _Page(name, switches, config, bus).take, file, "", ())
            open_now.callback(transport.close)
        due_ns = reported_ns = clock.now_ns()
        while True:
            controls.take()
            if config.reports and due_ns - reported_ns >= _REPORT_NS:
                reported_ns = due_ns
                status.put(_report(config, switches, due_ns))
            await clock.sleep_until_ns(due_ns := max(due_ns + _CONTROL_NS, clock.now_ns()))


def _report(config: Microphones, switches: MicrophoneSwitches, now_ns: int) -> SoundStatus:
    message = SoundStatus(site=config.site, policy=str(MATCH), loudspeaker=PAGE, acoustic_known=True)
    message.header.t_ns = now_ns
    for name in config.files:
        message.microphones.add(participant=name, source=PAGE, open=True, muted=not switches[name].open)
    return message


class _Page:
    def __init__(self, participant: str, switches: MicrophoneSwitches, config: Microphones, bus: Bus) -> None:
        self._participant, self._switches, self._bus = participant, switches, bus
        self._commands = bus.publish(BY_NAME["command"], participant=participant)
        self._screen = bus.publish(BY_NAME["screen"], participant=participant)
        self._voice = PageVoice(VisemeReader().feed)
        self._publication = bus.publish(BY_NAME["voice"], participant=participant)
        self._sites = config.sites
        levels = bus.publish(BY_NAME["voice_level"], participant=participant) if config.crowded else None
        self._levels = VoiceLevels(levels)

    def take(self, data: bytes, now_ns: int) -> None:
        """What the gateway has passed on."""
        if (line := line_of(data)) is not None:
            line_id, text, to = line
            with contextlib.suppress(ChatError, KeyError):  # nobody to read it is there
                at = self._sites[to] if to else ""
                lines_of(self._bus, self._participant, to, at).put(line_message(text, now_ns, line_id))
            return
        if (picture := picture_of(data)) is not None:
            digest, number, part = picture
            part.header.t_ns = now_ns
            self._bus.publish(BY_NAME["picture_part"], picture=digest, part=part_name(number)).put(part)
            return
        if (shown := part_of(data)) is not None:
            shown.header.t_ns = now_ns
            self._screen.put(shown)
            return
        if (command := asked_of(data)) is not None and command.WhichOneof("action") in GUEST_COMMANDS:
            command.participant, command.header.t_ns = self._participant, now_ns
            self._commands.put(command)
            return
        message = self._voice.message(data, now_ns) if self._switches[self._participant].open else None
        if message is None:
            return
        self._publication.put(message)
        self._levels.tell(message)
