"""Sounds for the tests."""

from __future__ import annotations

import numpy as np

from vistel.arrays import F32
from vistel.audio.opus import FRAME, FRAME_NS, RATE, Encoder

START_NS = 1_000_000_000_000


def vowel(seconds: float, pitch_hz: float = 130.0) -> F32:
    """A held vowel that rises and falls a little."""
    t = np.arange(round(seconds * RATE)) / RATE
    phase = 2 * np.pi * pitch_hz * t + 0.8 * np.sin(2 * np.pi * 0.8 * t)
    out = sum(np.sin(k * phase) / k for k in range(1, 12))
    return np.asarray(0.12 * out, np.float32)


def packets(pcm: F32) -> list[tuple[int, bytes]]:
    """(time of the first decoded sample, packet) of each frame; the sound begins at START_NS."""
    encoder = Encoder()
    return [
        (START_NS + k * FRAME_NS - encoder.lookahead_ns, encoder.encode(pcm[k * FRAME : (k + 1) * FRAME]))
        for k in range(len(pcm) // FRAME)
    ]


def longest_quiet_ms(pcm: F32, below: float) -> float:
    """How long (n,) stays below `below` (root mean square over 5 ms)."""
    power = np.convolve(pcm.astype(np.float64) ** 2, np.ones(240) / 240, "same")
    edges = np.flatnonzero(np.concatenate(([True], power >= below**2, [True])))
    return float(np.max(np.diff(edges)) - 1) / RATE * 1e3
