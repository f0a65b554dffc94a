"""One participant's voice, from messages to sound for a recogniser, and when each moment of it was said."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vistel.audio.opus import FRAME, FRAME_NS, RATE
from vistel.audio.stream import VoiceStream
from vistel.speech.features import Resampler
from vistel.v1.audio_pb2 import Voice

F32 = NDArray[np.float32]

BEHIND_NS = 60_000_000
"""How long frames that come late are waited for."""
REST_NS = 1_500_000_000
"""Silence that is listened to; after it nothing is done until somebody speaks again."""
_FLOOR = 2e-4
"""Of the noise that stands for silence nobody sent, root mean square."""


class Ear:
    """`hear` what comes, `listen` every 20 ms."""

    def __init__(self) -> None:
        self._stream = VoiceStream()
        self._resampler = Resampler(float(RATE))
        noise = np.random.default_rng(3).standard_normal(FRAME)
        self._quiet = np.asarray(_FLOOR * noise, np.float32)
        self._silent_ns = REST_NS
        self._begin_ns = 0
        self._fed = 0

    @property
    def resting(self) -> bool:
        """Nobody speaks; nothing is fed."""
        return self._silent_ns >= REST_NS

    def hear(self, message: Voice) -> None:
        """A frame."""
        self._stream.push(message.header.t_ns, message.opus, message.earlier)

    def listen(self, now_ns: int) -> F32 | None:
        """The sound of the next 20 ms at SAMPLE_RATE; None while there is nothing to listen to."""
        block = self._stream.read(float(now_ns), FRAME, float(BEHIND_NS))
        was_resting = self.resting
        self._silent_ns = self._silent_ns + FRAME_NS if block is None else 0
        if self.resting:
            return None
        if was_resting:
            self._begin_ns, self._fed = now_ns - BEHIND_NS, 0
        out = self._resampler.feed(self._quiet if block is None else block)
        self._fed += len(out)
        return out

    @property
    def fresh(self) -> bool:
        """Whether the sound just given is the first after a rest: who counts time begins anew."""
        return self._fed <= FRAME

    def said_ns(self, since_begin_s: float) -> int:
        """Conference time of a moment, given since listening began [s]."""
        return self._begin_ns + round(since_begin_s * 1e9)


