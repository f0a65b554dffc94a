"""Which microphones are open. Kept on disk, so that a restarted service opens none that was muted."""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from vistel.v1.audio_pb2 import VoiceControl

log = logging.getLogger("vistel.audio")

PAGE = "their page"
"""The source of a guest's voice, in words."""


@dataclass
class MicrophoneSwitch:
    """The switch of one microphone. held: push-to-talk is pressed; set_ns: when it was last set, conference time."""

    muted: bool = False
    push_to_talk: bool = False
    held: bool = False
    set_ns: int = 0

    @property
    def open(self) -> bool:
        """Whether what it hears is sent."""
        return not self.muted and (self.held or not self.push_to_talk)


class MicrophoneSwitches:
    """The switches of a site's microphones, by participant. memory: the file in which they are kept, or None."""

    def __init__(self, push_to_talk: Mapping[str, bool], memory: Path | None) -> None:
        self._memory = memory
        self._switches = {name: MicrophoneSwitch(push_to_talk=wanted) for name, wanted in push_to_talk.items()}
        for name, kept in self._kept().items():
            if name in self._switches:
                self._switches[name] = MicrophoneSwitch(
                    bool(kept.get("muted")), bool(kept.get("push_to_talk")), set_ns=int(kept.get("set_ns", 0))
                )

    def __getitem__(self, participant: str) -> MicrophoneSwitch:
        return self._switches[participant]

    def follow(self, participant: str, message: VoiceControl) -> None:
        """Set a switch, as its participant wants it; those of others are ignored."""
        switch = self._switches.get(participant)
        if switch is None:
            return
        switch.muted, switch.push_to_talk, switch.held = message.muted, message.push_to_talk, message.talk
        self._keep(switch, message.header.t_ns)

    def mute(self, participant: str, t_ns: int) -> None:
        """The host has muted somebody at `t_ns`; what they have set themselves since counts."""
        switch = self._switches.get(participant)
        if switch is not None and t_ns > switch.set_ns:
            switch.muted = True
            self._keep(switch, t_ns)

    def _keep(self, switch: MicrophoneSwitch, t_ns: int) -> None:
        switch.set_ns = max(switch.set_ns, t_ns)
        if self._memory is not None:
            try:
                self._memory.write_text(json.dumps({n: asdict(b) for n, b in self._switches.items()}), "utf-8")
            except OSError as e:
                log.error("event=mute_not_kept path=%s reason=%r", self._memory, e.strerror)

    def _kept(self) -> dict[str, dict[str, int]]:
        if self._memory is None or not self._memory.exists():
            return {}
        try:
            return dict(json.loads(self._memory.read_text("utf-8")))
        except (OSError, ValueError, TypeError) as e:
            log.error("event=mute_not_known path=%s reason=%r action=all_muted", self._memory, str(e))
            return {name: {"muted": True} for name in self._switches}
