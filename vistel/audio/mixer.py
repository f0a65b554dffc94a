"""Voices to a stereo mix, a block at a time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from vistel.arrays import F32
from vistel.audio.opus import RATE
from vistel.audio.spatial import LONGEST_ITD_S, InterauralCues, SourceDirection, interaural_cues

_PAST = int(LONGEST_ITD_S * RATE) + 12
"""Samples kept of each voice, for the delay of the farther ear and its low-pass."""
_DULL = 9
"""Length of the moving average that removes treble: little is left above 4 kHz."""
_CEILING = 0.97
_RELEASE = 0.05


class Limiter:
    """Keeps a mix below full scale: fast attack, faded over a block, slow release."""

    def __init__(self) -> None:
        self._gain = 1.0

    def apply(self, block: F32) -> F32:
        """(n, 2) in, (n, 2) out, every sample within full scale."""
        peak = float(np.max(np.abs(block), initial=0.0))
        wanted = min(1.0, _CEILING / peak) if peak > 0.0 else 1.0
        before = self._gain
        self._gain = wanted if wanted < before else before + _RELEASE * (wanted - before)
        if before == 1.0 and self._gain == 1.0:
            return block
        ramp = np.linspace(before, self._gain, len(block), dtype=np.float32)[:, None]
        return np.clip(block * ramp, -1.0, 1.0)


class Mixer(Protocol):
    """Mixes voices from their directions to stereo."""

    def mix(self, voices: Mapping[str, F32], directions: Mapping[str, SourceDirection | None]) -> F32 | None:
        """Voices, each (FRAME,), by talker to (FRAME, 2), left and right; None: silence."""
        ...


class PanningMixer:
    """Mixes by gain, delay and low-pass, for loudspeakers. Keeps the end and the direction of each voice, so that nothing
    clicks when people move."""

    def __init__(self) -> None:
        self._past: dict[str, F32] = {}
        self._cues: dict[str, InterauralCues] = {}
        self._limiter = Limiter()

    def mix(self, voices: Mapping[str, F32], directions: Mapping[str, SourceDirection | None]) -> F32 | None:
        """As Mixer.mix."""
        for gone in [name for name in self._past if name not in voices]:
            del self._past[gone]
        if not voices:
            return None
        names = list(voices)
        count = len(voices[names[0]])
        blocks = np.zeros((len(names), _PAST + count), np.float32)
        for row, name in zip(blocks, names, strict=True):
            past = self._past.get(name)
            if past is not None:
                row[:_PAST] = past
            row[_PAST:] = voices[name]
        total = np.cumsum(blocks, 1, dtype=np.float32)
        dull = np.zeros_like(blocks)
        dull[:, _DULL:] = (total[:, _DULL:] - total[:, :-_DULL]) / _DULL
        out = np.zeros((count, 2), np.float32)
        ramp = (np.arange(count, dtype=np.float32) + 1.0) / count
        for i, name in enumerate(names):
            new = interaural_cues(directions.get(name))
            old = self._cues.get(name, new)
            for ear in (0, 1):
                sound = _at_ear(blocks[i], dull[i], new, ear, count)
                if old != new:
                    before = _at_ear(blocks[i], dull[i], old, ear, count)
                    sound = before + ramp * (sound - before)
                out[:, ear] += sound
            self._cues[name] = new
            self._past[name] = blocks[i, -_PAST:].copy()
        return self._limiter.apply(out)


def _at_ear(clear: F32, dull: F32, cues: InterauralCues, ear: int, count: int) -> F32:
    """(count,) samples at one ear."""
    delay = cues.delay_s[ear] * RATE
    whole = int(delay)
    part = np.float32(delay - whole)
    gain, shadow = cues.gain[ear], cues.shadow[ear]
    end = len(clear) - whole
    sound = np.float32(gain * (1.0 - shadow)) * clear[end - count - 1 : end]
    if shadow > 0.0:
        # The average lags by half its length, which is within the delays of a head.
        sound = sound + np.float32(gain * shadow) * dull[end - count - 1 : end]
    return sound[1:] + part * (sound[:-1] - sound[1:]) if part > 0.0 else sound[1:]
