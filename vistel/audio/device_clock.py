"""The sample clock of a sound card, in conference time."""

from __future__ import annotations

import numpy as np

_BUCKET_NS = 500_000_000
_BUCKETS = 40
_LEAST_BUCKETS = 8
_EARLY_S = 0.010
_LATE_S = 0.060
"""An observation later than this makes the clock uncertain [s]."""
_LOST_NS = 200_000_000
"""Samples are missing when all observations of this time are that late."""
_LOST_OBSERVATIONS = 4
"""Fewest late observations that show missing samples."""
_STEP_S = 0.005
"""If the earliest observation of a half second is later than the line by more than this, a few samples are missing [s]."""
_STEP_BUCKETS = 3
"""Half seconds in a row that must be so late."""
MOST_PPM = 1000.0
"""No sound card drifts more; a steeper line is due to late observations."""


class DeviceClock:
    """Capture (or playing) times of samples, from observations of how many had arrived (or left) by when.

    Observations are late, some very late, none early. So the earliest of each half second counts; a straight line through
    those of the last twenty seconds gives the drift.

    After a very late observation either only the observation was late, or samples are missing and all following times
    shift. The next observations decide; until then the clock is `uncertain`.
    """

    def __init__(self, rate_hz: float) -> None:
        self.rate_hz = rate_hz
        self._origin_ns: int | None = None
        self._origin_count = 0
        self._bucket_ns = 0
        self._best: tuple[float, float] | None = None
        self._points: list[tuple[float, float]] = []
        self._line = (0.0, 0.0)
        self._late: tuple[int, int] | None = None
        self._above: list[tuple[float, float]] = []

    @property
    def uncertain(self) -> bool:
        """Whether times may be wrong after a very late observation; for a fifth of a second at most."""
        return self._late is not None

    @property
    def drift_ppm(self) -> float:
        """How much faster than its nominal rate the device runs [ppm]; 0 until known."""
        return -self._line[0] * 1e6

    def observe(self, count: int, t_ns: int) -> None:
        """`count` samples had arrived by `t_ns`."""
        if self._origin_ns is None:
            self._origin_ns, self._origin_count, self._bucket_ns = t_ns, count, t_ns
        played_s = (count - self._origin_count) / self.rate_hz
        late_s = (t_ns - self._origin_ns) * 1e-9 - played_s
        if self._best is None or late_s < self._best[1]:
            self._best = (played_s, late_s)
        if late_s < self._expected(played_s) - _EARLY_S:
            # No observation is early: the earlier ones were late.
            self._begin(played_s, late_s)
        elif self._missing(late_s - self._expected(played_s), t_ns):
            self._begin(played_s, late_s)
        if t_ns - self._bucket_ns >= _BUCKET_NS:
            best, self._best, self._bucket_ns = self._best, None, t_ns
            over_s = best[1] - self._expected(best[0])
            self._above = [*self._above, best] if _STEP_S < over_s <= _LATE_S else []
            if len(self._above) == _STEP_BUCKETS:
                earliest_s = min(late for _, late in self._above)
                self._begin(best[0], earliest_s)
            elif over_s <= _STEP_S:
                self._points.append(best)
                del self._points[:-_BUCKETS]
                self._fit()

    def _missing(self, over_s: float, t_ns: int) -> bool:
        """Whether the device has dropped samples."""
        if over_s <= _LATE_S:
            self._late = None
            return False
        since_ns, count = self._late or (t_ns, 0)
        self._late = since_ns, count + 1
        return t_ns - since_ns >= _LOST_NS and count + 1 >= _LOST_OBSERVATIONS

    def time_ns(self, count: float) -> float:
        """When sample number `count` was captured [ns]. Raises ValueError before the first observation."""
        if self._origin_ns is None:
            raise ValueError("device clock: nothing has been observed yet")
        played_s = (count - self._origin_count) / self.rate_hz
        slope, offset = self._line
        return self._origin_ns + (played_s + offset + slope * played_s) * 1e9

    def count_at(self, t_ns: float) -> float:
        """Number of the sample captured at `t_ns`; the inverse of `time_ns`."""
        if self._origin_ns is None:
            raise ValueError("device clock: nothing has been observed yet")
        slope, offset = self._line
        played_s = ((t_ns - self._origin_ns) * 1e-9 - offset) / (1.0 + slope)
        return self._origin_count + played_s * self.rate_hz

    def _expected(self, played_s: float) -> float:
        return self._line[1] + self._line[0] * played_s

    def _begin(self, played_s: float, late_s: float) -> None:
        self._points.clear()
        self._above = []
        self._line, self._late, self._best = (0.0, late_s), None, (played_s, late_s)

    def _fit(self) -> None:
        points = np.array(self._points)
        if len(points) < _LEAST_BUCKETS:
            self._line = (0.0, float(points[:, 1].min()))
            return
        x, y = points[:, 0], points[:, 1]
        slope, offset = np.polyfit(x, y, 1)
        # Twice more through the points below the line: observations are late, so the lower edge is right.
        for _ in range(2):
            low = y <= slope * x + offset
            if np.count_nonzero(low) < 4:
                break
            slope, offset = np.polyfit(x[low], y[low], 1)
        slope = float(np.clip(slope, -MOST_PPM * 1e-6, MOST_PPM * 1e-6))
        self._line = (slope, float(np.median(y - slope * x)) if abs(slope) == MOST_PPM * 1e-6 else float(offset))
