"""Level of a microphone: loudness, clipping, voice activity."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32

SILENT_DB = -100.0
_CLIP = 0.999
_CLIPPED_RUN = 3
"""So many samples in a row at full scale are clipping."""
_ABOVE_FLOOR_DB = 9.0
_LEAST_DB = -55.0
_NOISE_DB = 5.0
_HOLD_FRAMES = 15
"""Voice activity goes on for so long after the last word."""
_FLOOR_UP_DB = 0.02
"""Fastest rise of the noise floor, per frame: slow, since a held vowel is no noise."""


@dataclass(frozen=True)
class Level:
    """Level of a frame. rms_db: 0 is a full-scale square wave; talking: the level is well above the noise floor; idle: it
    has not been for a while."""

    rms_db: float = SILENT_DB
    clipped: bool = False
    talking: bool = False
    idle: bool = False


class Meter:
    """Measures one microphone, frame after frame."""

    def __init__(self) -> None:
        self._floor_db = -60.0
        self._hold = 0

    def measure(self, pcm: F32) -> Level:
        """(n,) samples of a frame, -1 to 1."""
        power = float(np.dot(pcm, pcm)) / max(1, len(pcm))
        rms_db = max(SILENT_DB, 10.0 * math.log10(power)) if power > 0.0 else SILENT_DB
        self._floor_db = min(rms_db, self._floor_db + _FLOOR_UP_DB) if rms_db > SILENT_DB else self._floor_db
        self._floor_db = max(-80.0, self._floor_db)
        if rms_db > max(_LEAST_DB, self._floor_db + _ABOVE_FLOOR_DB):
            self._hold = _HOLD_FRAMES
        else:
            self._hold = max(0, self._hold - 1)
        idle = self._hold == 0 and rms_db < self._floor_db + _NOISE_DB
        return Level(rms_db, is_clipped(pcm), self._hold > 0, idle)


def is_clipped(pcm: F32) -> bool:
    """Whether (n,) samples are clipped."""
    full = np.abs(pcm) >= _CLIP
    if np.count_nonzero(full) < _CLIPPED_RUN:
        return False
    run = np.convolve(full.astype(np.int8), np.ones(_CLIPPED_RUN, np.int8), "valid")
    return bool(np.any(run == _CLIPPED_RUN))
