"""Disturbances of a camera's picture: drifting light, noise."""

import math

import cv2
import numpy as np

from vistel.arrays import U8

_BANK = 1 << 20


class Noise:
    """Gaussian noise of `deviation` grey levels, the same for the same seed and frame number."""

    def __init__(self, deviation: float, seed: int) -> None:
        rng = np.random.default_rng(seed)
        # One bank for all frames, read at varying offsets: drawing 921,600 numbers a frame takes too long.
        self._bank = np.rint(deviation * rng.standard_normal(2 * _BANK)).astype(np.int16)
        self._silent = deviation == 0.0

    def add(self, frame: U8, number: int) -> U8:
        """`frame` with the noise of frame `number`."""
        if self._silent:
            return frame
        at = (number * 7_368_787) % (2 * _BANK - frame.size)
        noise = self._bank[at : at + frame.size].reshape(frame.shape)
        return np.asarray(cv2.add(frame, noise, dtype=cv2.CV_8U), np.uint8)


def light_at(t_s: float, drifting_s: float = 0.0) -> tuple[float, float, float]:
    """Gains of blue, green and red: the light of a room varies by some per cent; in a drift it fades and reddens."""
    level = 1.0 + 0.06 * math.sin(0.31 * t_s) + 0.03 * math.sin(1.3 * t_s)
    fading = 1.0 / (1.0 + 0.12 * drifting_s)
    warm = 0.04 * math.sin(0.17 * t_s) + 0.25 * (1.0 - fading)
    return level * fading * (1.0 - warm), level * fading, level * fading * (1.0 + 0.5 * warm)
