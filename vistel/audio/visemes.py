"""Visemes: the shapes of a mouth that are told apart by eye while somebody speaks, under their usual fifteen names."""

import numpy as np

from vistel.arrays import F64

VISEMES = ("sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa", "E", "ih", "oh", "ou")
"""Rest; lips shut (p, b, m); teeth on the lip (f, v); tongue between teeth (th); t, d; k, g, h; ch, j, sh; s, z; n, l; r; and the
vowels of father, bed, bit, bought, boot."""
SPEECH_BEFORE_NS = 20_000_000
"""The visemes of a Voice message are those of the sound so long before its `t_ns`: what follows a sound tells what it was."""


def to_bytes(weights: F64) -> bytes:
    """(15,) weights, 0 to 1 -> one byte each, for `Voice.visemes`."""
    return np.rint(np.clip(np.nan_to_num(weights), 0.0, 1.0) * 255.0).astype(np.uint8).tobytes()


def from_bytes(data: bytes) -> F64 | None:
    """(15,) weights with a sum of 1; None where these are none."""
    weights = np.frombuffer(data, np.uint8).astype(np.float64)
    return weights / weights.sum() if len(weights) == len(VISEMES) and weights.any() else None
