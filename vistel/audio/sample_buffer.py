"""The newest seconds of a stream of numbered samples."""

from __future__ import annotations

import numpy as np

from vistel.arrays import F32


class SampleBuffer:
    """Samples number `start` to `end`. The oldest are dropped when room is needed."""

    def __init__(self, capacity: int = 96_000, kept: int = 24_000) -> None:
        self._data = np.zeros(capacity, np.float32)
        self._kept = kept
        self._used = 0
        self.end = 0

    @property
    def start(self) -> int:
        """Number of the oldest sample."""
        return self.end - self._used

    def begin(self, at: int, silence: int) -> None:
        """Start anew: `silence` zeros before sample number `at`, which is appended next."""
        self._data[:silence] = 0.0
        self._used, self.end = silence, at

    def append(self, pcm: F32) -> None:
        """Append (n,) samples."""
        if self._used + len(pcm) > len(self._data):
            self._data[: self._kept] = self._data[self._used - self._kept : self._used]
            self._used = self._kept
        self._data[self._used : self._used + len(pcm)] = pcm
        self._used += len(pcm)
        self.end += len(pcm)

    def between(self, a: int, b: int) -> F32:
        """(b - a,) samples, a view; raises IndexError for samples that it does not have."""
        if not self.start <= a <= b <= self.end:
            raise IndexError(f"sample buffer: samples {a} to {b} of {self.start} to {self.end}")
        offset = self._used - self.end
        return self._data[a + offset : b + offset]
