"""A value that follows another smoothly."""

import numpy as np

from vistel.arrays import F64


class Spring:
    """Critically damped: exact for any step of time."""

    def __init__(self, at: F64) -> None:
        """at: (n,) where it is at rest."""
        self.at, self._speed = at.copy(), np.zeros_like(at)

    def follow(self, aim: F64, dt: float, rate: float | F64) -> F64:
        """The value `dt` [s] later, on its way to `aim` (n,); rate: how quickly [rad/s]."""
        off = self.at - aim
        change = (self._speed + rate * off) * dt
        fading = np.exp(-rate * dt)
        self.at, self._speed = aim + (off + change) * fading, (self._speed - rate * change) * fading
        return self.at
