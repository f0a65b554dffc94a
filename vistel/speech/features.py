"""Features for the acoustic model: every 10 ms the logarithm of the energy in 40 mel bands, less the mean of voice and room. Sound
fed in pieces gives the same frames as sound fed at once."""

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32
from vistel.audio.resample import reach, sinc_resample
from vistel.jit.kernel_jit import compiled
from vistel.speech.recognition import SAMPLE_RATE, Samples

BANDS = 40
HOP = 160
"""Samples between frames: 10 ms."""
WINDOW = 400
FRAME_S = HOP / SAMPLE_RATE
_FFT = 512
_FLOOR = 1e-7
"""Energy that is added to each band's: 70 dB under a full scale sine; less is silence and all silence is alike."""
_LOWEST_HZ = 60.0
"""Where the lowest band begins."""
_HIGHEST_HZ = 7600.0
"""Where the highest band ends, a little below half the sample rate."""


def _mel_weights() -> F32:
    """(_FFT // 2 + 1, BANDS) triangles, evenly spaced on the mel scale; a full scale sine gives about 1."""

    def mel(hz: NDArray[np.float64]) -> NDArray[np.float64]:
        return 1127.0 * np.log1p(hz / 700.0)

    ends = mel(np.array([_LOWEST_HZ, _HIGHEST_HZ]))
    edges = np.linspace(float(ends[0]), float(ends[1]), BANDS + 2)
    bins = mel(np.arange(_FFT // 2 + 1) * SAMPLE_RATE / _FFT)[:, None]
    up = (bins - edges[:-2]) / (edges[1:-1] - edges[:-2])
    down = (edges[2:] - bins) / (edges[2:] - edges[1:-1])
    return np.asarray(np.maximum(0.0, np.minimum(up, down)), np.float32)


_HANN = np.hanning(WINDOW + 1)[:-1].astype(np.float32)
_MEL = _mel_weights() * np.float32((2.0 / _HANN.sum()) ** 2)


def as_float(samples: Samples) -> F32:
    """Samples as float32 with full scale 1. NaN becomes silence, values beyond full scale are clipped."""
    if samples.dtype == np.int16:
        return samples.astype(np.float32) * np.float32(1.0 / 32768.0)
    return np.clip(np.nan_to_num(samples.astype(np.float32), nan=0.0), -1.0, 1.0)


class LogMel:
    """Frames of a stream of samples at SAMPLE_RATE."""

    def __init__(self) -> None:
        self._kept = np.zeros(0, np.float32)

    def feed(self, samples: F32) -> F32:
        """(frames, BANDS) natural logarithms of energies; frame k of the stream covers samples k HOP to k HOP + WINDOW."""
        sound = np.concatenate([self._kept, samples])
        count = max(0, (len(sound) - WINDOW) // HOP + 1)
        self._kept = sound[count * HOP :].copy()
        if count == 0:
            return np.zeros((0, BANDS), np.float32)
        frames = np.lib.stride_tricks.sliding_window_view(sound, WINDOW)[: count * HOP : HOP]
        spectrum = np.fft.rfft(frames * _HANN, _FFT)
        power = (spectrum.real**2 + spectrum.imag**2).astype(np.float32)
        return np.log(power @ _MEL + np.float32(_FLOOR))


@compiled
def _normalise(frames: F32, mean: F32, state: F32, out: F32, weight: float, longest: float) -> None:
    """state: frames learnt from, level of the quiet (NaN before the first frame)."""
    bands = frames.shape[1]
    for t in range(frames.shape[0]):
        level = np.float32(0.0)
        for b in range(bands):
            level += frames[t, b]
        level /= bands
        if np.isnan(state[1]) or level < state[1]:
            state[1] = level
        else:
            state[1] = min(level, state[1] + np.float32(0.004))
        if level > state[1] + np.float32(1.0):
            state[0] = min(state[0] + np.float32(1.0), np.float32(longest))
            rate = np.float32(1.0 / (weight + state[0]))
            for b in range(bands):
                mean[b] += rate * (frames[t, b] - mean[b])
        for b in range(bands):
            out[t, b] = frames[t, b] - mean[b]


class Normaliser:
    """Subtracts the running mean of frames above the quiet: level, microphone, room and long-term voice.

    The mean starts at `start` (BANDS,), which weighs `_WEIGHT` frames, and looks back about `_LONGEST` frames of
    speech. Only frames above the quiet change the mean, so an hour of silence leaves it as it was.
    """

    _WEIGHT, _LONGEST = 30.0, 600.0

    def __init__(self, start: F32, learnt: float = 0.0) -> None:
        """learnt: frames of speech that `start` is already the mean of, beside its own weight."""
        self.mean = start.astype(np.float32).copy()
        self._state = np.array([min(learnt, self._LONGEST), np.nan], np.float32)

    def feed(self, frames: F32) -> F32:
        """(n, BANDS) frames less the mean as it stood at each."""
        out = np.empty_like(frames)
        _normalise(frames, self.mean, self._state, out, self._WEIGHT, self._LONGEST)
        return out


class Resampler:
    """Resamples a stream at 8 to 96 kHz to SAMPLE_RATE, or to another rate."""

    def __init__(self, rate_hz: float, to_hz: float = SAMPLE_RATE) -> None:
        if not 8000.0 <= rate_hz <= 96000.0:
            raise ValueError(f"speech: a sample rate of {rate_hz:g} Hz; expected 8000 to 96000")
        self._step = rate_hz / to_hz
        self._reach = reach(self._step)
        self._kept = np.zeros(self._reach if self._step != 1.0 else 0, np.float32)
        self._at = float(self._reach)

    def feed(self, samples: Samples) -> F32:
        """The stream's next samples at the other rate; they lag by the filter's reach, under 2 ms."""
        sound = np.concatenate([self._kept, as_float(samples)])
        if self._step == 1.0:
            self._kept = np.zeros(0, np.float32)
            return sound
        count = int(np.floor((len(sound) - 1 - self._reach - self._at) / self._step)) + 1
        if count <= 0:
            self._kept = sound
            return np.zeros(0, np.float32)
        out = sinc_resample(sound, self._at, self._step, count)
        end = self._at + count * self._step
        first = int(end) - self._reach
        self._kept = sound[first:].copy()
        self._at = end - first
        return out
