"""Keeps peaks between two motions, such as a blink."""

import numpy as np

from vistel.arrays import F64


class PeakHold:
    """Takes values at any rate and gives one set per motion: the newest values, or, where a number went beyond both the last
    given and the newest value in between, that peak. The newest value then follows with the next motion.
    """

    def __init__(self, least: float) -> None:
        """least: a smaller peak is noise; in the values' unit."""
        self._least_peak = least
        self._given: F64 | None = None
        self._newest = self._filtered = self._least = self._most = np.zeros(0)

    def add(self, values: F64, filtered: F64 | None = None) -> None:
        """values: of any shape, always the same. filtered: given instead of `values` where there is no peak."""
        if self._newest.shape != values.shape:
            self._given, self._least, self._most = None, values, values
        self._newest, self._filtered = values, values if filtered is None else filtered
        self._least, self._most = np.minimum(self._least, values), np.maximum(self._most, values)

    def take(self) -> F64:
        """Values for the next motion; only after `add`."""
        given = self._newest if self._given is None else self._given
        up = self._most - np.maximum(given, self._newest)
        down = np.minimum(given, self._newest) - self._least
        peak = np.maximum(up, down) > self._least_peak
        out = np.where(peak, np.where(up >= down, self._most, self._least), self._filtered)
        self._given, self._least, self._most = out, self._newest, self._newest
        return out
