"""What somebody else has just said: a microphone also hears the person beside, and voices from the loudspeaker."""

from __future__ import annotations

from collections import deque

from vistel.v1.speech_pb2 import Utterance

_BEFORE_NS = 200_000_000
"""What begins at most so long before the same words of somebody else is those words, heard a second time."""
_AFTER_NS = 1_000_000_000
"""The same, for what begins after them."""
_KEPT = 24


class Echoes:
    """Commands that people said lately, whoever's microphone heard them, at any site."""

    def __init__(self) -> None:
        self._commands: deque[tuple[str, str, int]] = deque(maxlen=_KEPT)

    def add(self, utterance: Utterance) -> None:
        """Somebody was understood."""
        if utterance.text and utterance.state != Utterance.STATE_REJECTED:
            self._commands.append((utterance.participant, utterance.text, utterance.start_ns))

    def of(self, participant: str, text: str, begin_ns: int) -> str:
        """Who said it, if what this participant's microphone heard at `begin_ns` was somebody else; "" if not."""
        for who, spoken, start_ns in self._commands:
            if who != participant and spoken == text and -_BEFORE_NS <= begin_ns - start_ns <= _AFTER_NS:
                return who
        return ""
