"""Many voices into what two ears hear, each through the transfer functions of its direction.

Filtered as spectra, 20 ms at a time with the end of the frame before (overlap-save): the voices are added up before they
become sound again, so that one more of them costs one transform.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vistel.arrays import C64, F32
from vistel.audio import hrtf
from vistel.audio.mixer import Limiter
from vistel.audio.opus import FRAME
from vistel.audio.spatial import Place

_RAMP = ((np.arange(FRAME, dtype=np.float32) + 1.0) / FRAME)[:, None]


class Binaural:
    """Remembers the end of each voice and its filters, so that nothing clicks when people move."""

    def __init__(self) -> None:
        self._past: dict[str, F32] = {}
        self._heard: dict[str, tuple[Place | None, C64]] = {}
        self._limiter = Limiter()

    def mix(self, voices: Mapping[str, F32], places: Mapping[str, Place | None]) -> F32 | None:
        """As of `vistel.audio.mixer.Mixing`."""
        for gone in [name for name in self._past if name not in voices]:
            del self._past[gone], self._heard[gone]
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
        before = self._heard
        self._heard = {name: self._filters(name, places.get(name)) for name in names}
        moved = any(before.get(name, now) is not now for name, now in self._heard.items())
        sound = _filtered(spectra, [self._heard[name][1] for name in names])
        if moved:
            old = _filtered(spectra, [before.get(name, self._heard[name])[1] for name in names])
            sound = np.asarray(old + _RAMP * (sound - old), np.float32)
        return self._limiter.apply(sound)

    def _filters(self, name: str, place: Place | None) -> tuple[Place | None, C64]:
        """Those of before while the place is the same."""
        before = self._heard.get(name)
        return before if before is not None and before[0] == place else (place, hrtf.filters(place))


def _filtered(spectra: C64, filters: list[C64]) -> F32:
    """(FRAME, 2)."""
    both = np.einsum("vf,vef->ef", spectra, np.stack(filters))
    return np.fft.irfft(both, hrtf.SIZE)[:, hrtf.TAPS :].T.astype(np.float32)
