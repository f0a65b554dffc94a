"""A chroma key for the marks' colour: how much of each pixel is mark, in any light."""

from dataclasses import dataclass

import cv2
import numpy as np

from vistel.arrays import F64, I32, U8
from vistel.jit.kernel_jit import compiled

FULL = 200.0
"""The key of a pixel that is all mark; the range above is for brighter light."""
_FLOOR = 12.0
"""Added to the background's second moments [grey levels²]: the noise of a camera."""
_STEP = 8
"""The background is sampled at every so many pixels."""
_SHIFT = 14
"""Fractional bits of the weights of a pixel's colours."""
_MOST = (1 << 30) // (3 * 255)
"""The largest weight, so that no sum overflows."""


@dataclass(frozen=True)
class ColourKey:
    """mark: (3,) mean colour of the marks, BGR 0..255. background: (3, 3) second moments E[c cᵀ] of everything else.

    The key is the linear map of colours that is 1 at `mark` and smallest over the background (constrained energy
    minimisation). Being linear, it is half for a pixel half covered by a mark; without a constant, it only scales
    with the light, so that weighted centroids do not move.
    """

    mark: F64
    background: F64

    @property
    def weights(self) -> F64:
        """(3,) of blue, green, red."""
        w = np.linalg.solve(self.background + _FLOOR * np.eye(3), self.mark)
        return np.asarray(w / float(w @ self.mark), np.float64)

    def apply(self, frame: U8) -> U8:
        """frame: (h, w, 3) BGR. Returns (h, w): `FULL` where there is only mark, 0 where there is none."""
        out = np.empty(frame.shape[:2], np.uint8)
        weights = np.clip(np.rint(FULL * self.weights * (1 << _SHIFT)), -_MOST, _MOST).astype(np.int32)
        _mix(np.ascontiguousarray(frame).reshape(-1), weights, out.reshape(-1))
        return out

    def contrast(self) -> float:
        """Contrast of marks to background: ratio of the mean squares of the key."""
        w = self.weights
        return float(1.0 / max(w @ self.background @ w, 1e-9))

    def adapted(self, mark: F64, background: F64, share: float) -> "ColourKey":
        """Moved by `share` towards the present colours."""
        return ColourKey(self.mark + share * (mark - self.mark), self.background + share * (background - self.background))


@compiled
def _mix(colours: U8, weights: I32, out: U8) -> None:
    """out (n,): sums of colours (3 n,), interleaved, by weights (3,) of `_SHIFT` bits, rounded and kept within 0..255."""
    blue, green, red, half = weights[0], weights[1], weights[2], np.int32(1 << (_SHIFT - 1))
    for k in range(out.size):
        mixed = blue * np.int32(colours[3 * k]) + green * np.int32(colours[3 * k + 1]) + red * np.int32(colours[3 * k + 2])
        out[k] = np.uint8(min(max((mixed + half) >> np.int32(_SHIFT), np.int32(0)), np.int32(255)))


def generic_green(frame: U8) -> U8:
    """(h, w) 255 where a pixel is a strong green of any brightness; for frames without a key yet."""
    hsv = cv2.cvtColor(frame, cv2.COLOR_BGR2HSV)
    return np.asarray(cv2.inRange(hsv, np.array((38, 80, 40)), np.array((92, 255, 255))), np.uint8)


def background_moments(frame: U8, marks: U8) -> F64:
    """(3, 3) second moments of the pixels where `marks` (h, w), grown a little, is 0; of every 8th pixel each way."""
    grown = cv2.dilate(marks, np.ones((5, 5), np.uint8))[_STEP // 2 :: _STEP, _STEP // 2 :: _STEP]
    colours = frame[_STEP // 2 :: _STEP, _STEP // 2 :: _STEP][grown == 0].astype(np.float64)
    if not len(colours):
        return np.zeros((3, 3))
    return colours.T @ colours / len(colours)


def mean_colour(frame: U8, mask: U8) -> F64:
    """(3,) mean colour of the inner pixels of `mask` (h, w), BGR; NaN where it has none."""
    inner = cv2.erode(mask, np.ones((3, 3), np.uint8))
    count = int(cv2.countNonZero(inner))
    return np.array(cv2.mean(frame, inner)[:3]) if count else np.full(3, np.nan)
