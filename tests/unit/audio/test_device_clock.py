"""A sound card's clock: found through late sightings, followed when it drifts, begun anew when samples are missing."""

from __future__ import annotations

import numpy as np
import pytest

from vistel.audio.device_clock import DeviceClock


def follow(clock: DeviceClock, seconds: float, ppm: float, rng: np.random.Generator, offset: int = 0, begin_s: float = 0.0) -> None:
    """Blocks of 20 ms, each seen up to 30 ms after its end."""
    for k in range(1, round(seconds / 0.02)):
        t_s = begin_s + 0.02 * k
        count = round(t_s * clock.rate_hz * (1.0 + 1e-6 * ppm)) - offset
        clock.observe(count, round((t_s + 0.03 * rng.random() ** 2) * 1e9))


@pytest.mark.parametrize("rate", [8_000.0, 44_100.0, 48_000.0, 96_000.0])
@pytest.mark.parametrize("ppm", [-200.0, 0.0, 150.0])
def test_rate_and_times_are_found_although_every_sighting_is_late(rate: float, ppm: float) -> None:
    clock = DeviceClock(rate)
    follow(clock, 30.0, ppm, np.random.default_rng(3))
    assert clock.drift_ppm == pytest.approx(ppm, abs=60.0)
    count = 29.0 * rate * (1.0 + 1e-6 * ppm)
    assert clock.time_ns(count) == pytest.approx(29.0e9, abs=3e6)
    assert clock.count_at(clock.time_ns(count)) == pytest.approx(count, abs=1e-3 * rate)


def test_while_it_is_not_clear_whether_samples_are_missing_the_clock_is_doubtful_and_then_right() -> None:
    clock, rng = DeviceClock(48_000.0), np.random.default_rng(4)
    follow(clock, 10.0, 0.0, rng)
    assert not clock.uncertain
    uncertain_s = 0.0
    for k in range(1, 40):
        t_s = 10.0 + 0.02 * k
        clock.observe(round(t_s * 48_000.0) - 24_000, round(t_s * 1e9))
        uncertain_s += 0.02 * clock.uncertain
        if not clock.uncertain:
            assert clock.time_ns(t_s * 48_000.0 - 24_000) == pytest.approx(t_s * 1e9, abs=5e6)
    assert 0.15 < uncertain_s < 0.25


def test_a_few_missing_samples_are_no_drift() -> None:
    clock, rng = DeviceClock(48_000.0), np.random.default_rng(4)
    follow(clock, 5.0, 0.0, rng)
    follow(clock, 2.5, 0.0, rng, offset=960, begin_s=5.0)
    for begin_s in (7.5, 12.5, 17.5):
        assert abs(clock.drift_ppm) < 100.0
        assert clock.time_ns(begin_s * 48_000 - 960) == pytest.approx(begin_s * 1e9, abs=3e6)
        follow(clock, 5.0, 0.0, rng, offset=960, begin_s=begin_s)


def test_samples_that_come_late_all_together_are_not_taken_for_missing() -> None:
    clock, rng = DeviceClock(48_000.0), np.random.default_rng(4)
    follow(clock, 10.0, 0.0, rng)
    clock.observe(round(10.02 * 48_000), 10_500_000_000)
    assert clock.uncertain
    clock.observe(round(10.5 * 48_000), 10_502_000_000)
    assert not clock.uncertain
    assert clock.time_ns(10.5 * 48_000) == pytest.approx(10.5e9, abs=5e6)


def test_a_sighting_earlier_than_anything_expected_is_believed_at_once() -> None:
    clock = DeviceClock(48_000.0)
    clock.observe(960, 500_000_000)
    clock.observe(1920, 240_000_000)
    assert clock.time_ns(1920) == pytest.approx(240e6, abs=1e6)


def test_times_before_the_first_observation_are_refused() -> None:
    with pytest.raises(ValueError, match="nothing has been observed"):
        DeviceClock(48_000.0).time_ns(0)
