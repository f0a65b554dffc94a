"""Measurement times from jittery arrivals."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from vistel.protocol.measurement_times import MeasurementTimes

CYCLE = 1e9 / 120


def read_late(count: int, rng: np.random.Generator, stations: int = 4, lost: float = 0.0):
    """(station, true time) of each record, and the reads they come in: times and how many records."""
    truth = [(k % stations + 1, 10**9 + k * CYCLE) for k in range(count) if rng.random() >= lost]
    reads, i, now = [], 0, 0.0
    while i < len(truth):
        now = max(now, truth[i][1]) + rng.exponential(1.5e6) + (60e6 if rng.random() < 0.01 else 0.0)
        n = sum(1 for _, t in truth[i:] if t <= now)
        reads.append((now, truth[i : i + n]))
        i += n
    return truth, reads


def errors_ms(reads: list) -> np.ndarray:
    times, out = MeasurementTimes(CYCLE), []
    for now, some in reads:
        # Without the order of stations: bytes of one read are back to back on the line.
        arrivals = [(s, int(now - (len(some) - 1 - j) * 2.9e6)) for j, (s, _) in enumerate(some)]
        out += [got - true for got, (_, true) in zip(times.times(arrivals), some, strict=True)]
    return np.array(out) * 1e-6


def test_exact_arrivals_stay_exact() -> None:
    times = MeasurementTimes(CYCLE)
    for k in range(500):
        t_ns = 10**9 + round(k * CYCLE)
        assert times.times([(k % 4 + 1, t_ns)]) == [pytest.approx(t_ns, abs=2)]


def test_a_busy_host_blurs_the_times_by_less_than_a_millisecond() -> None:
    _, reads = read_late(5000, np.random.default_rng(1))
    errors = errors_ms(reads)[50:]
    assert np.median(np.abs(errors)) < 0.3 and np.quantile(np.abs(errors), 0.99) < 1.0


def test_lost_records_are_counted_by_whose_turn_it_is() -> None:
    _, reads = read_late(5000, np.random.default_rng(2), lost=0.1)
    errors = errors_ms(reads)[50:]
    assert np.median(np.abs(errors)) < 0.3 and np.quantile(np.abs(errors), 0.99) < 1.5


def test_a_clock_that_runs_differently_is_followed() -> None:
    times, fast = MeasurementTimes(CYCLE), MeasurementTimes(CYCLE)
    for k in range(20_000):
        slow_ns, fast_ns = 10**9 + round(k * CYCLE * 1.0002), 10**9 + round(k * CYCLE * 0.9998)
        assert abs(times.times([(k % 2 + 1, slow_ns)])[0] - slow_ns) < 1000
        assert abs(fast.times([(k % 2 + 1, fast_ns)])[0] - fast_ns) < 1000


def test_after_a_pause_the_time_is_the_arrival() -> None:
    times = MeasurementTimes(CYCLE)
    times.times([(1, 10**9), (2, 10**9 + 8_333_333)])
    assert times.times([(2, 3 * 10**9)]) == [3 * 10**9]


def test_times_go_forward() -> None:
    _, reads = read_late(2000, np.random.default_rng(3), lost=0.05)
    times = MeasurementTimes(CYCLE)
    times = [t for now, some in reads for t in times.times([(s, int(now)) for s, _ in some])]
    assert all(a < b for a, b in itertools.pairwise(times))
