"""From pictures of an eye to pupil, gaze and opening of the lids."""

from dataclasses import dataclass

import cv2
import numpy as np

from vistel.arrays import F64, U8
from vistel.vision.gaze_calibration import GazeCalibration
from vistel.vision.pupil import LEAST_CONFIDENCE, Pupil, find_pupil

_KEPT = 0.05
"""Share by which the grey level of an open eye follows each picture."""
_BAND = 0.7
"""Half width of the strip in which the lids are searched, over the pupil's radius."""
_OPEN_LEAST = 0.15
_GAZE_LEAST = 0.55
"""Opening below which the lid covers part of the pupil, so that its centre does not give the gaze."""


@dataclass(frozen=True)
class EyeReading:
    """pupil: None if not seen. opening_px: height between the lids at the pupil. opening: 0 closed .. 1 as at rest. gaze: (2,)
    yaw and pitch [rad]; None if the pupil is not seen or half covered, or without a calibration."""

    pupil: Pupil | None
    opening_px: float
    opening: float
    gaze: F64 | None


class EyeReader:
    """Reads the pictures of one camera, in order. Without a calibration there is no gaze, and the opening at rest is learnt."""

    def __init__(self, calibration: GazeCalibration | None = None) -> None:
        self._calibration = calibration
        self._open_px = calibration.open_px if calibration is not None else 0.0
        self._before: Pupil | None = None
        self._seen: Pupil | None = None
        self._key = 0.0

    @property
    def found(self) -> bool:
        """Whether a pupil has ever been seen."""
        return self._seen is not None

    def read(self, picture: U8) -> EyeReading:
        """picture: (h, w) grey."""
        pupil = find_pupil(picture, self._before)
        if pupil is not None and pupil.confidence <= LEAST_CONFIDENCE:
            pupil = None
        self._before = pupil
        if pupil is not None:
            key = level_key(picture, pupil)
            self._key = key if self._seen is None else self._key + _KEPT * (key - self._key)
            self._seen = pupil
        if self._seen is None:
            return EyeReading(None, 0.0, 0.0, None)
        height = opening_px(picture, pupil or self._seen, self._key)
        if self._calibration is None:
            # Lids are at rest most of the time, and wider only for moments.
            self._open_px += (0.2 if height > self._open_px else 0.002) * (height - self._open_px)
        opening = float(np.clip(height / max(self._open_px, 1.0), 0.0, 1.0))
        if pupil is None and opening < _OPEN_LEAST:
            opening = 0.0
        gaze = None
        if pupil is not None and self._calibration is not None and opening >= _GAZE_LEAST:
            gaze = self._calibration.gaze(pupil.centre)
        return EyeReading(pupil, height, opening, gaze)


def level_key(picture: U8, pupil: Pupil) -> float:
    """The grey level between eye and lids: halfway from the iris beside the pupil to the skin."""
    x, y = (round(float(v)) for v in pupil.centre)
    r = pupil.radius
    row = slice(max(0, y - round(0.3 * r)), y + round(0.3 * r) + 1)
    beside = np.concatenate(
        (
            picture[row, max(0, round(x - 1.6 * r)) : max(0, round(x - 1.2 * r))].ravel(),
            picture[row, round(x + 1.2 * r) : round(x + 1.6 * r)].ravel(),
        )
    )
    iris = float(np.median(beside)) if len(beside) else pupil.level + 0.5 * pupil.contrast
    skin = float(np.percentile(picture[::8, ::8], 75))
    return 0.5 * (iris + max(skin, iris + 10.0))


def opening_px(picture: U8, pupil: Pupil, key: float) -> float:
    """Height [px] of what is darker than `key` round the pupil, in a strip nearly as wide as the pupil."""
    x, y = (float(v) for v in pupil.centre)
    half = max(2.0, _BAND * pupil.radius)
    strip = picture[:, max(0, round(x - half)) : round(x + half) + 1]
    if not strip.size:
        return 0.0
    # The median across the strip ignores single lashes and reflections of the lamps.
    dark = np.median(cv2.GaussianBlur(strip, (0, 0), 1.5), 1) < key
    rows = np.flatnonzero(~dark)
    at = int(np.clip(round(y), 0, len(dark) - 1))
    near = np.flatnonzero(dark[max(0, at - round(pupil.radius)) : at + round(pupil.radius) + 1])
    if not len(near):
        return 0.0
    at = max(0, at - round(pupil.radius)) + int(near[len(near) // 2])
    above, below = rows[rows < at], rows[rows > at]
    top = int(above[-1]) if len(above) else -1
    bottom = int(below[0]) if len(below) else len(dark)
    return float(bottom - top - 1)
