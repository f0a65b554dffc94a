"""Sentences of a simulated voice, one after the other, in a loop."""

import logging
from collections.abc import Sequence

import numpy as np

from vistel.arrays import F32
from vistel.audio.resample import reach, sinc_resample
from vistel.speech.synthesis import PLAIN, SynthesisError, synthesise

log = logging.getLogger("vistel.sim")

RATE = 48_000
"""Samples a second."""
FIRST_S = 4.0
"""When the first sentence begins [s]."""
EVERY_S = 6.0
"""Time from the beginning of a sentence to that of the next [s]."""
_LOUD = 0.12
"""Root mean square of a sentence (full scale: 1)."""
_PEAK = 0.9
"""Largest sample of a sentence, so that the microphone does not clip (full scale: 1)."""


def synthesised_sentence(text: str, voice: str = "") -> F32:
    """(n,) sound of a sentence at RATE. voice: as `synthesise` takes it; by default espeak-ng's: kana are Japanese, everything else
    is English. Raises SynthesisError."""
    pcm, rate = synthesise(text, voice or PLAIN["en" if text.isascii() else "ja"], words_per_minute=150)
    step = rate / RATE
    half = reach(step)
    padded = np.concatenate([np.zeros(half, np.float32), pcm, np.zeros(half + 2, np.float32)])
    out = sinc_resample(padded, float(half), step, int(len(pcm) / step))
    gain = min(_LOUD / max(1e-6, float(np.sqrt(np.mean(out**2)))), _PEAK / max(1e-6, float(np.max(np.abs(out)))))
    return np.asarray(gain * out, np.float32)


class Sentences:
    """The samples of sentences in a loop. Sentences that cannot be synthesised are logged and left out."""

    def __init__(self, sentences: Sequence[str]) -> None:
        self._sounds: list[F32] = []
        for text in sentences:
            try:
                self._sounds.append(synthesised_sentence(text))
            except SynthesisError as e:
                log.warning("event=unsaid text=%r reason=%r", text, str(e))

    def between(self, begin: int, end: int) -> F32:
        """(end - begin,) samples."""
        out = np.zeros(end - begin, np.float32)
        first, every = round(FIRST_S * RATE), round(EVERY_S * RATE)
        for n in {(begin - first) // every, (end - 1 - first) // every} if self._sounds else ():
            if n < 0:
                continue
            start = first + n * every
            sound = self._sounds[n % len(self._sounds)][:every]
            low, high = max(begin, start), min(end, start + len(sound))
            if low < high:
                out[low - begin : high - begin] = sound[low - start : high - start]
        return out
