"""What the room says to somebody: short replies by espeak-ng, where it is installed, on the site's loudspeaker."""

from __future__ import annotations

import asyncio
import logging

import numpy as np

from vistel.arrays import F32
from vistel.audio.opus import FRAME, FRAME_NS, RATE, Encoder
from vistel.speech.grammar import Language
from vistel.speech.synthesis import PLAIN, SynthesisError, synthesise, voices
from vistel.v1.audio_pb2 import Voice
from vistel.wire import background
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME

log = logging.getLogger("vistel.speech")

_LOUD = 0.3
_ROOM_NS = 400_000_000
"""How long a loudspeaker's sound is still in the room."""
_LONGEST = 80
"""Letters of a reply that are said."""
_READINGS = {"本当": "ほんとう", "何": "なん", "返事": "へんじ"}


def _sound(text: str, language: Language) -> F32:
    """(n,) at RATE, -1 to 1. Raises SynthesisError."""
    pcm, rate = synthesise(text, PLAIN[language], words_per_minute=190)
    count = int(len(pcm) * RATE / rate)
    return _LOUD * np.interp(np.arange(count) * (rate / RATE), np.arange(len(pcm)), pcm).astype(np.float32)


class SpokenReplies:
    """Says one thing after the other; 20 ms at each `round`."""

    def __init__(self, language: Language, bus: Bus, participant: str, *, aloud: bool) -> None:
        self._language: Language = language
        self._voice = bus.publish(BY_NAME["spoken_reply"], participant=participant)
        self._aloud = aloud and "espeak-ng" in voices()
        self._encoder = Encoder()
        self._tasks: set[asyncio.Task[None]] = set()
        self._left = np.zeros(0, np.float32)
        self._playing: tuple[int, int] = (-1, -1)

    def say(self, text: str, now_ns: int) -> None:
        """As soon as it is synthesised."""
        for kanji, kana in _READINGS.items():
            text = text.replace(kanji, kana) if self._language == "ja" else text
        if not self._aloud:
            return
        task = background.start(self._synthesise(text[:_LONGEST]), "synthesise")
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def round(self, now_ns: int) -> None:
        """Send the next 20 ms."""
        if not len(self._left):
            return
        frame = np.zeros(FRAME, np.float32)
        part = self._left[:FRAME]
        frame[: len(part)] = part
        self._left = self._left[FRAME:]
        message = Voice(opus=self._encoder.encode(frame), level_db=-20.0)
        message.header.t_ns = now_ns
        self._voice.put(message)
        self._playing = (self._playing[0] if now_ns - self._playing[1] < _ROOM_NS else now_ns, now_ns + FRAME_NS)
        if not len(self._left):
            end = Voice()
            end.header.t_ns = now_ns + FRAME_NS
            self._voice.put(end)

    def spoke_at(self, t_ns: int) -> bool:
        """Whether the room's own voice could be heard then."""
        return self._playing[0] <= t_ns < self._playing[1] + _ROOM_NS

    def close(self) -> None:
        """Say no more."""
        for task in self._tasks:
            task.cancel()

    async def _synthesise(self, text: str) -> None:
        try:
            sound = await asyncio.to_thread(_sound, text, self._language)
        except SynthesisError as e:
            log.debug("event=reply_unsaid reason=%r", str(e))
            return
        self._left = np.concatenate([self._left, sound])
