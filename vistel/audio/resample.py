"""Resampling at any ratio and at fractional positions."""

from __future__ import annotations

from functools import cache

import numpy as np

from vistel.arrays import F32

TAPS = 32
"""Of the interpolation filter, in samples of the lower rate."""
_PHASES = 512
_ROLL_OFF = 0.94
"""End of the pass band, as a share of half the lower rate."""


@cache
def _table(stretch: float) -> F32:
    """(_PHASES + 1, taps) windowed sinc; `stretch` times wider when the rate goes down, against aliasing."""
    half = int(TAPS * stretch) // 2
    offsets = np.arange(-half + 1, half + 1)[None, :] - np.linspace(0.0, 1.0, _PHASES + 1)[:, None]
    cut = _ROLL_OFF / stretch
    table = cut * np.sinc(cut * offsets) * np.i0(8.0 * np.sqrt(np.maximum(0.0, 1.0 - (offsets / half) ** 2))) / np.i0(8.0)
    return np.asarray(table / table.sum(1, keepdims=True), np.float32)


def reach(step: float) -> int:
    """Samples that `sinc_resample` needs on either side of a position, for positions `step` apart."""
    return int(TAPS * _stretch(step)) // 2


def _stretch(step: float) -> float:
    return max(1.0, round(step, 2)) if step > 1.02 else 1.0


def sinc_resample(source: F32, first: float, step: float, count: int) -> F32:
    """(count,) samples of `source` (n,) at first, first + step, ... [samples].

    Needs `reach(step)` samples before the first and after the last position; raises ValueError where they are missing.
    """
    half = reach(step)
    last = first + step * (count - 1)
    if first < half - 1 or last >= len(source) - half:
        raise ValueError(f"resample: positions {first:.1f} to {last:.1f} need {half} more samples than there are")
    at = first + step * np.arange(count)
    whole = np.floor(at).astype(np.int64)
    phase = np.rint((at - whole) * _PHASES).astype(np.int64)
    table = _table(_stretch(step))
    windows = np.lib.stride_tricks.sliding_window_view(source, table.shape[1])
    return np.einsum("ij,ij->i", windows[whole - half + 1], table[phase]).astype(np.float32)


def cubic_resample(source: F32, first: float, step: float, count: int) -> F32:
    """The same for steps near 1, by four points (Catmull-Rom): enough for speech resampled by parts in a thousand.

    Needs one sample before the first and two after the last position.
    """
    at = first + step * np.arange(count)
    i = np.floor(at).astype(np.int64)
    u = (at - i).astype(np.float32)
    a, b, c, d = source[i - 1], source[i], source[i + 1], source[i + 2]
    out = b + 0.5 * u * (c - a + u * (2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)))
    return np.asarray(out, np.float32)
