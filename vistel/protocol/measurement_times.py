"""Measurement times of a device that measures one station after the other, without the jitter of the host."""

from bisect import insort
from collections.abc import Sequence

from vistel.protocol.polhemus import CREEP, LATE_CYCLES


class MeasurementTimes:
    """One station is measured per cycle; a busy host reads records late, never early.

    So an arrival is an upper bound of its measurement's time, and so are its neighbours' arrivals, a known number of cycles
    away. The least of these bounds is the time. The bound from the past is relaxed by 0.2 % per cycle, which outweighs any
    difference between the two clocks and corrects a miscount (lost records) in a few seconds; after a gap the count starts
    anew.
    """

    def __init__(self, cycle_ns: float) -> None:
        self._cycle_ns = cycle_ns
        self._stations: list[int] = []
        self._station = 0
        self._t_ns: float | None = None

    def times(self, arrivals: Sequence[tuple[int, int]]) -> list[int]:
        """Times [ns] of the records of one read, given as (station, arrival [ns]) in order."""
        steps = [self._steps(station) for station, _ in arrivals]
        bounds = [float(t_ns) for _, t_ns in arrivals]
        for i in range(len(bounds) - 2, -1, -1):
            bounds[i] = min(bounds[i], bounds[i + 1] - steps[i + 1] * self._cycle_ns)
        for i, bound in enumerate(bounds):
            if self._t_ns is not None:
                expected = self._t_ns + steps[i] * self._cycle_ns * (1.0 + CREEP)
                if bound - expected > LATE_CYCLES * self._cycle_ns:
                    self._stations = sorted({station for station, _ in arrivals[i:]})
                else:
                    bounds[i] = min(bound, expected)
            self._t_ns = bounds[i]
        return [int(t) for t in bounds]

    def _steps(self, station: int) -> int:
        """Cycles from the last station measured to this one."""
        if station not in self._stations:
            insort(self._stations, station)
        before = self._stations.index(self._station) if self._station in self._stations else -1
        self._station = station
        return (self._stations.index(station) - before - 1) % len(self._stations) + 1
