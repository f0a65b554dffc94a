"""Many voices into what two ears hear, all of a block at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from vistel.arrays import F32
from vistel.audio.opus import RATE
from vistel.audio.spatial import CENTRE, MOST_LATE_S, Ears, Place, panned

_PAST = int(MOST_LATE_S * RATE) + 12
"""Samples of each voice that are kept for the farther ear and its dull part."""
_DULL = 9
"""Samples over which treble is averaged away: little is left above 4 kHz."""
_CEILING = 0.97
_RECOVER = 0.05


class Limiter:
    """Keeps a sum of voices below full scale: turned down at once, faded to it over a block, turned up slowly."""

    def __init__(self) -> None:
        self._gain = 1.0

    def apply(self, block: F32) -> F32:
        """(n, 2) in, (n, 2) out, every sample within full scale."""
        peak = float(np.max(np.abs(block), initial=0.0))
        wanted = min(1.0, _CEILING / peak) if peak > 0.0 else 1.0
        before = self._gain
        self._gain = wanted if wanted < before else before + _RECOVER * (wanted - before)
        if before == 1.0 and self._gain == 1.0:
            return block
        ramp = np.linspace(before, self._gain, len(block), dtype=np.float32)[:, None]
        return np.clip(block * ramp, -1.0, 1.0)


class Mixing(Protocol):
    """Voices from their places, into two ears."""

    def mix(self, voices: Mapping[str, F32], places: Mapping[str, Place | None]) -> F32 | None:
        """Voices (FRAME,) each by talker to (FRAME, 2), left and right; None: silence. places: who comes from where."""
        ...


class Panning:
    """By loudness, delay and dullness: for loudspeakers, and for headphones without a feeling of space."""

    def __init__(self) -> None:
        self._mixer = Mixer()

    def mix(self, voices: Mapping[str, F32], places: Mapping[str, Place | None]) -> F32 | None:
        """As of Mixing."""
        return self._mixer.mix(voices, {name: panned(places.get(name)) for name in voices})


class Mixer:
    """Remembers the end of each voice and where it came from, so that nothing clicks when people move."""

    def __init__(self) -> None:
        self._past: dict[str, F32] = {}
        self._ears: dict[str, Ears] = {}
        self._limiter = Limiter()

    def mix(self, voices: Mapping[str, F32], ears: Mapping[str, Ears]) -> F32 | None:
        """Voices (n,) each by talker to (n, 2), left and right; None: silence. `ears`: who comes from where."""
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
            new = ears.get(name, CENTRE)
            old = self._ears.get(name, new)
            for ear in (0, 1):
                sound = _at_ear(blocks[i], dull[i], new, ear, count)
                if old != new:
                    before = _at_ear(blocks[i], dull[i], old, ear, count)
                    sound = before + ramp * (sound - before)
                out[:, ear] += sound
            self._ears[name] = new
            self._past[name] = blocks[i, -_PAST:].copy()
        return self._limiter.apply(out)


def _at_ear(clear: F32, dull: F32, ears: Ears, ear: int, count: int) -> F32:
    """(count,) of what arrives at one ear."""
    late = ears.late_s[ear] * RATE
    whole = int(late)
    part = np.float32(late - whole)
    gain, shade = ears.gain[ear], ears.shade[ear]
    end = len(clear) - whole
    sound = np.float32(gain * (1.0 - shade)) * clear[end - count - 1 : end]
    if shade > 0.0:
        # The average lags by half its length; the clear part does not, which is within what a head does.
        sound = sound + np.float32(gain * shade) * dull[end - count - 1 : end]
    return sound[1:] + part * (sound[:-1] - sound[1:]) if part > 0.0 else sound[1:]
