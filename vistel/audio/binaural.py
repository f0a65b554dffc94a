"""Voices to a binaural mix, each filtered by the head-related transfer functions of its direction.

Filtered by overlap-save in blocks of 20 ms. Voices are added as spectra, so that one more costs one transform.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vistel.arrays import C64, F32
from vistel.audio import hrtf
from vistel.audio.mixer import Limiter
from vistel.audio.opus import FRAME
from vistel.audio.spatial import SourceDirection

_RAMP = ((np.arange(FRAME, dtype=np.float32) + 1.0) / FRAME)[:, None]


class BinauralMixer:
    """Mixes for headphones. Keeps the end and the filters of each voice, so that nothing clicks when people move."""

    def __init__(self) -> None:
        self._past: dict[str, F32] = {}
        self._used: dict[str, tuple[SourceDirection | None, C64]] = {}
        self._limiter = Limiter()

    def mix(self, voices: Mapping[str, F32], directions: Mapping[str, SourceDirection | None]) -> F32 | None:
        """As `vistel.audio.mixer.Mixer.mix`."""
        for gone in [name for name in self._past if name not in voices]:
            del self._past[gone], self._used[gone]
        if not voices:
            return None
        names = list(voices)
        blocks = np.zeros((len(names), hrtf.SIZE), np.float32)
        for row, name in zip(blocks, names, strict=True):
            if name in self._past:
                row[: hrtf.TAPS] = self._past[name]
            row[hrtf.TAPS :] = voices[name]
            self._past[name] = row[FRAME:].copy()
        spectra = np.fft.rfft(blocks).astype(np.complex64)
        before = self._used
        self._used = {name: self._filters(name, directions.get(name)) for name in names}
        moved = any(before.get(name, now) is not now for name, now in self._used.items())
        sound = _filtered(spectra, [self._used[name][1] for name in names])
        if moved:
            old = _filtered(spectra, [before.get(name, self._used[name])[1] for name in names])
            sound = np.asarray(old + _RAMP * (sound - old), np.float32)
        return self._limiter.apply(sound)

    def _filters(self, name: str, direction: SourceDirection | None) -> tuple[SourceDirection | None, C64]:
        """The same ones as before while the direction is the same."""
        before = self._used.get(name)
        return before if before is not None and before[0] == direction else (direction, hrtf.filters(direction))


def _filtered(spectra: C64, filters: list[C64]) -> F32:
    """(FRAME, 2)."""
    both = np.einsum("vf,vef->ef", spectra, np.stack(filters))
    return np.fft.irfft(both, hrtf.SIZE)[:, hrtf.TAPS :].T.astype(np.float32)
