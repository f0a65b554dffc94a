"""From pictures of a helmet's face camera to the marks of the face: key, spots, assignment, less the slip of the helmet."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, U8
from vistel.figure.face.marks import MARK_COUNT, REST
from vistel.vision.colour_key import FULL, background_moments, mean_colour
from vistel.vision.face_calibration import FaceCalibration, marks_mask
from vistel.vision.mark_shape import standard_shape
from vistel.vision.mark_tracker import MarkTracker
from vistel.vision.spots import Spots, find_spots, split_spot

_LIGHT_S = 0.5
"""Time constant with which the key adapts to the light [s]."""
_ADAPT_S = 0.05
"""Time between two adaptations of the key [s]."""
_SLIP_S = 1.0
"""Time constant with which a slip of the helmet is accepted [s]."""
_SMALLEST = 0.35
"""A spot with less of a mark's calibrated mass is part of a hidden mark, or of another colour."""
_LARGEST = 3.2
"""A spot with more of a mark's calibrated mass is no mark."""
_TWO = 1.45
"""A spot with more masses of a mark is two merged marks."""
_ONE = 1.3
"""A spot with more masses of a mark may be two merged marks; its centre is no mark's position."""


@dataclass(frozen=True)
class FaceReading:
    """marks: (13, 2) metres, head frame, scaled to the standard face; None if no face is found. pixels: (13, 2) positions in
    the picture. seen: (13,) False where a mark's position is predicted. trouble: what is wrong, for a person; or ""."""

    marks: F64 | None
    pixels: F64
    seen: NDArray[np.bool_]
    trouble: str


class FaceReader:
    """Reads the pictures of one camera, in order."""

    def __init__(self, calibration: FaceCalibration) -> None:
        self._calibration = calibration
        self._to_head, self._origin = calibration.to_head()
        self._rest = calibration.neutral @ self._to_head.T + self._origin
        self._shape = replace(standard_shape(), rest=self._rest.ravel())
        self._tracker = MarkTracker(self._shape)
        self._key = calibration.key
        self._slip = np.zeros(4)
        self._since_adapted_s = 0.0

    def read(self, frame: U8, dt_s: float) -> FaceReading:
        """frame: (h, w, 3) BGR, of the calibrated size. dt_s: since the last frame."""
        key = self._key.apply(frame)
        mass = self._calibration.mass
        spots = find_spots(key, FULL, smallest=_SMALLEST * mass, largest=_LARGEST * mass)
        centres, single = self._split_spots(key, spots, dt_s)
        tracked = self._tracker.step(centres @ self._to_head.T + self._origin, dt_s, single)
        nothing = np.zeros(MARK_COUNT, bool)
        if not tracked.found:
            # The light may have changed meanwhile: begin with the calibrated colour.
            self._key = self._calibration.key
            why = f"no face: {len(centres)} spots of the marks' colour, {MARK_COUNT} expected"
            return FaceReading(None, np.full((MARK_COUNT, 2), np.nan), nothing, why)
        self._adapt_key(frame, key, spots, tracked.spot[tracked.seen], dt_s)
        slip = self._shape.slip_of(tracked.position, tracked.seen)
        self._slip += (slip - self._slip) * -math.expm1(-dt_s / _SLIP_S)
        moved = tracked.position - self._rest - (self._shape.slip @ self._slip).reshape(-1, 2)
        pixels = (tracked.position - self._origin) @ np.linalg.inv(self._to_head).T
        hidden = MARK_COUNT - int(tracked.seen.sum())
        return FaceReading(REST + moved, pixels, tracked.seen, f"{hidden} marks hidden" if hidden else "")

    def _split_spots(self, key: U8, spots: Spots, dt_s: float) -> tuple[F64, NDArray[np.bool_]]:
        """(n, 2) centres [px] of `spots`, with merged marks split (further parts at the end); and (n,) False where a centre may
        be that of several marks."""
        centres, single = spots.centre.copy(), spots.mass < _ONE * self._calibration.mass
        big = np.flatnonzero(spots.mass > _TWO * self._calibration.mass)
        if not len(big):
            return centres, single
        expected = (self._tracker.expected(dt_s) - self._origin) @ np.linalg.inv(self._to_head).T
        more: list[F64] = []
        for k in big:
            x, y, w, h = (int(v) for v in spots.box[k])
            inside = ((expected >= (x - 2, y - 2)) & (expected <= (x + w + 1, y + h + 1))).all(1)
            if inside.sum() < 2:
                continue
            parts, masses = split_spot(key, (x, y, w, h), FULL, expected[inside])
            if (masses > _SMALLEST * self._calibration.mass).all():
                centres[k], single[k] = parts[0], True
                more.append(parts[1:])
        centres = np.vstack((centres, *more))
        return centres, np.concatenate((single, np.ones(len(centres) - len(single), bool)))

    def _adapt_key(self, frame: U8, key: U8, spots: Spots, own: NDArray[np.int64], dt_s: float) -> None:
        """Adapt the key to the colours of this frame."""
        self._since_adapted_s += dt_s
        own = own[own < len(spots)]
        if self._since_adapted_s < _ADAPT_S or len(own) < MARK_COUNT // 2:
            return
        mask = marks_mask(key, spots, own)
        colour = mean_colour(frame, mask)
        if np.isfinite(colour).all():
            share = -math.expm1(-self._since_adapted_s / _LIGHT_S)
            self._key = self._key.adapted(colour, background_moments(frame, mask), share)
            self._since_adapted_s = 0.0
