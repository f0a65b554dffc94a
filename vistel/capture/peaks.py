"""Keeps peaks between two motions, such as a blink."""

import numpy as np

from vistel.arrays import F64
from vistel.jit.kernel_jit import compiled


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
        out = _with_peaks(given, self._newest, self._least, self._most, self._filtered, self._least_peak)
        self._given, self._least, self._most = out, self._newest, self._newest
        return out


@compiled
def _with_peaks(given: F64, newest: F64, least: F64, most: F64, filtered: F64, least_peak: float) -> F64:
    up = most - np.maximum(given, newest)
    down = np.minimum(given, newest) - least
    return np.where(np.maximum(up, down) > least_peak, np.where(up >= down, most, least), filtered)
