"""Time stretching by waveform similarity (WSOLA, Verhelst and Roelands 1993): sound is cut where it resembles itself a moment
later, and cross-faded there. The pitch stays."""

from __future__ import annotations

import numpy as np

from vistel.arrays import F32

OVERLAP = 240
"""Samples of a cross-fade: 5 ms."""
LEAST_SHIFT = 96
MOST_SHIFT = 720
"""15 ms: a period of a deep voice fits in. LEAST_SHIFT: 2 ms."""
_COARSE = 4

RISE = (0.5 - 0.5 * np.cos(np.pi * (np.arange(OVERLAP) + 0.5) / OVERLAP)).astype(np.float32)
"""(OVERLAP,) cross-fade, 0 to 1."""


def fade(old: F32, new: F32) -> F32:
    """(OVERLAP,) cross-fade by amplitude, for sounds that resemble each other."""
    return np.asarray(old + RISE * (new - old), np.float32)


def best_shift(reference: F32, candidates: F32) -> tuple[int, float]:
    """Where `candidates` (n,) resemble `reference` (OVERLAP,) most: offset, and similarity (1: the same but for loudness; 0:
    nothing in common, or silence)."""
    coarse = _correlate(reference[::_COARSE], candidates[::_COARSE])
    middle = int(np.argmax(coarse)) * _COARSE
    low = max(0, middle - _COARSE + 1)
    high = min(len(candidates) - OVERLAP, middle + _COARSE - 1)
    fine = _correlate(reference, candidates[low : high + OVERLAP])
    at = int(np.argmax(fine))
    return low + at, float(fine[at])


def _correlate(reference: F32, candidates: F32) -> F32:
    """Normalised cross-correlation at every offset."""
    n = len(reference)
    products = np.correlate(candidates, reference, "valid")
    power = np.cumsum(np.concatenate(([0.0], candidates.astype(np.float64) ** 2)))
    energy = (power[n:] - power[:-n]) * float(np.dot(reference, reference))
    return np.asarray(products / np.sqrt(np.maximum(energy, 1e-12)), np.float32)
