"""Keeps a peak between two motions, such as a blink, so that it is not lost."""

from __future__ import annotations

import numpy as np

from vistel.arrays import F64


class PeakHold:
    """Takes values as they come; gives, once per motion, the newest ones, or where a number was farther up or down in
    between than both what was given last and what is now, that peak. The newest follow with the next motion. Where values
    come filtered too, peaks are looked for in what was not filtered.
    """

    def __init__(self, least: float) -> None:
        """least: what sticks out by less is noise, no peak; in the values' unit."""
        self._least_peak = least
        self._given: F64 | None = None
        self._newest = self._calm = self._least = self._most = np.zeros(0)

    def add(self, values: F64, calm: F64 | None = None) -> None:
        """(n,) or any other shape, always the same. calm: the same filtered, to be given where there is no peak."""
        if self._newest.shape != values.shape:
            self._given, self._least, self._most = None, values, values
        self._newest, self._calm = values, values if calm is None else calm
        self._least, self._most = np.minimum(self._least, values), np.maximum(self._most, values)

    def take(self) -> F64:
        """What to say now; only after `add`."""
        given = self._newest if self._given is None else self._given
        up = self._most - np.maximum(given, self._newest)
        down = np.minimum(given, self._newest) - self._least
        peak = np.maximum(up, down) > self._least_peak
        out = np.where(peak, np.where(up >= down, self._most, self._least), self._calm)
        self._given, self._least, self._most = out, self._newest, self._newest
        return out
