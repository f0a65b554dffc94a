"""Whether microphones are open. Kept on disk too: a service that is started again must not open what was muted."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from vistel.v1.audio_pb2 import VoiceControl

log = logging.getLogger("vistel.audio")


@dataclass
class Button:
    """Of one microphone."""

    muted: bool = False
    push_to_talk: bool = False
    held: bool = False

    @property
    def open(self) -> bool:
        return not self.muted and (self.held or not self.push_to_talk)


class Buttons:
    """Of a site's microphones, by participant. memory: the file they are kept in, None for none."""

    def __init__(self, push_to_talk: Iterable[tuple[str, bool]], memory: Path | None) -> None:
        self._memory = memory
        self._buttons = {name: Button(push_to_talk=wanted) for name, wanted in push_to_talk}
        for name, kept in self._kept().items():
            if name in self._buttons:
                self._buttons[name] = Button(bool(kept.get("muted")), bool(kept.get("push_to_talk")))

    def __getitem__(self, participant: str) -> Button:
        return self._buttons[participant]

    def follow(self, participant: str, message: VoiceControl) -> None:
        """Be as asked; others' microphones are none of this site's."""
        button = self._buttons.get(participant)
        if button is None:
            return
        button.muted, button.push_to_talk, button.held = message.muted, message.push_to_talk, message.talk
        if self._memory is not None:
            try:
                self._memory.write_text(json.dumps({n: asdict(b) for n, b in self._buttons.items()}), "utf-8")
            except OSError as e:
                log.error("event=mute_not_kept path=%s reason=%r", self._memory, e.strerror)

    def _kept(self) -> dict[str, dict[str, bool]]:
        if self._memory is None or not self._memory.exists():
            return {}
        try:
            return dict(json.loads(self._memory.read_text("utf-8")))
        except (OSError, ValueError, TypeError) as e:
            log.error("event=mute_not_known path=%s reason=%r action=all_muted", self._memory, str(e))
            return {name: {"muted": True} for name in self._buttons}
