"""Removes steady noise from a stream: a Wiener filter whose noise is estimated where nobody speaks.

The gain follows Ephraim and Malah's decision-directed estimate (1984); the noise is the running minimum of the smoothed
spectrum, raised to its mean (Martin 2001, much shortened).
"""

import numpy as np

from vistel.arrays import F32
from vistel.speech.recognition import SAMPLE_RATE

FRAME = 512
"""Samples of a spectrum."""
STEP = 256
"""Samples from one spectrum to the next: half a frame, so that the windows add up to 1."""
_BINS = FRAME // 2 + 1
_WINDOW = np.sqrt(0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(FRAME) / FRAME)).astype(np.float32)
_SMOOTH = 0.8
_FLOOR = 0.2
"""Least gain in much noise: what is left keeps the recogniser's features in the range it was trained in."""
_NOISY_DB = 15.0
"""Speech over noise up to which the least gain is `_FLOOR`; above, it rises."""
_QUIET_DB = 30.0
"""Speech over noise above which nothing is removed."""
_FORGET = 0.995
_BLOCK = round(0.4 * SAMPLE_RATE / STEP)
_BLOCKS = 4
_RAISE = 1.6
_DECISION = 0.96


class Denoiser:
    """`feed` returns as many samples as it takes, delayed by `STEP`."""

    def __init__(self) -> None:
        self._in = np.zeros(FRAME - STEP, np.float32)
        self._out = np.zeros(STEP, np.float32)
        self._ready = np.zeros(STEP, np.float32)
        self._smooth: F32 | None = None
        self._lowest = np.full((_BLOCKS, _BINS), np.inf, np.float32)
        self._frames = 0
        self._clean = np.zeros(_BINS, np.float32)
        self._loud = 1e-6

    def feed(self, sound: F32) -> F32:
        """(n,) samples -> (n,)."""
        self._in = np.concatenate([self._in, sound])
        parts = [self._ready]
        while len(self._in) >= FRAME:
            parts.append(self._frame(self._in[:FRAME]))
            self._in = self._in[STEP:]
        made = np.concatenate(parts)
        self._ready = made[len(sound) :]
        return made[: len(sound)]

    def _frame(self, samples: F32) -> F32:
        spectrum = np.fft.rfft(samples * _WINDOW)
        power = np.asarray(spectrum.real**2 + spectrum.imag**2, np.float32)
        noise = self._noise(power)
        posterior = power / noise
        prior = _DECISION * self._clean / noise + (1.0 - _DECISION) * np.maximum(posterior - 1.0, 0.0)
        self._loud = max(_FORGET * self._loud, float(power.sum()))
        over_db = 10.0 * float(np.log10(self._loud / noise.sum()))
        floor = float(np.interp(over_db, (_NOISY_DB, _QUIET_DB), (_FLOOR, 1.0)))
        gain = np.maximum(prior / (1.0 + prior), np.float32(floor))
        self._clean = gain * gain * power
        out = np.fft.irfft(spectrum * gain).astype(np.float32) * _WINDOW
        out[:STEP] += self._out
        self._out = out[STEP:]
        return out[:STEP]

    def _noise(self, power: F32) -> F32:
        before = power if self._smooth is None else self._smooth
        smooth = self._smooth = np.asarray(_SMOOTH * before + (1.0 - _SMOOTH) * power, np.float32)
        block = self._frames // _BLOCK % _BLOCKS
        if self._frames % _BLOCK == 0:
            self._lowest[block] = smooth
        self._lowest[block] = np.minimum(self._lowest[block], smooth)
        self._frames += 1
        return _RAISE * self._lowest.min(axis=0) + np.float32(1e-8)
