"""Filters of receivers and gloves: what is still does not tremble, what is quick neither lags nor jumps."""

from __future__ import annotations

import math

import numpy as np

from vistel.capture.one_euro import AngleFilter, PoseFilter
from vistel.capture.peaks import PeakHold
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix, rotvec_from_matrix
from vistel.geometry.smoothstep import ease

STATION_S = 1.0 / 30.0
GLOVE_S = 1.0 / 60.0
STILL = np.array([0.0, 0.0, 0.0, 1.0])


def turned(angle: float) -> np.ndarray:
    return quaternion_from_matrix(matrix_from_rotvec(np.array([0.0, angle, 0.0])))


def apart(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(rotvec_from_matrix(matrix_from_quaternion(a) @ matrix_from_quaternion(b).T)))


def test_a_still_hand_trembles_by_two_thirds_of_a_receivers_noise_at_most() -> None:
    rng, f = np.random.default_rng(1), PoseFilter()
    seen = []
    for k in range(300):
        f.update(k * STATION_S, 0.0008 * rng.standard_normal(3), turned(0.0026 * float(rng.standard_normal())))
        seen.append(f.at((k + 0.5) * STATION_S))
    assert np.std([p for p, _ in seen[60:]]) < 0.0008 * 2.0 / 3.0
    assert np.sqrt(np.mean([apart(q, STILL) ** 2 for _, q in seen[60:]])) < 0.0026 * 2.0 / 3.0


def test_a_hand_that_flips_and_stops_is_where_it_is_a_tenth_of_a_second_later() -> None:
    f = PoseFilter()
    for k in range(60):
        t = k * STATION_S
        # A third of a turn within 67 ms, twice as fast as hands turn for long.
        f.update(t, np.zeros(3), turned(2.1 * min(1.0, max(0.0, (t - 1.0) / 0.067))))
        if t > 1.0 + 0.067 + 0.1:
            assert apart(f.at(t + 0.02)[1], turned(2.1)) < math.radians(5.0)


def test_a_hand_that_stops_at_once_does_not_jump_back() -> None:
    """3 m/s, then a stop between two samples: 100 mm too far, put right over several sixtieths of a second."""
    f = PoseFilter()
    shown, given = [], []
    for k in range(120):
        t = k / 120.0
        x = 3.0 * min(t, 0.5)
        if k % 4 == 0:
            f.update(t, np.array([x, 0.0, 0.0]), STILL)
        if k % 2 == 0:
            shown.append(f.at(t)[0][0])
            given.append(x)
    steps, true = np.diff(shown), np.diff(given)
    assert (true - steps).max() < 0.06
    assert abs(shown[-1] - 1.5) < 0.002


def test_a_hand_that_begins_to_move_is_followed_at_once() -> None:
    """150 mm within 140 ms, 2 m/s at most, however it falls between the samples: half-way is shown within a sixtieth and a bit."""
    for phase in np.arange(8) / 8.0 * STATION_S:
        rng, f = np.random.default_rng(3), PoseFilter()
        late, beyond = math.inf, 0.0
        for k in range(240):
            t = k / 120.0
            if k % 4 == 0:
                u = ease(min(1.0, max(0.0, (t - 1.0 - phase) / 0.14)))
                f.update(t, np.array([0.15 * u, 0.0, 0.0]) + 0.0008 * rng.standard_normal(3), turned(0.6 * u))
            x = f.at(t)[0][0]
            if x >= 0.075:
                late = min(late, t - 1.07 - phase)
            beyond = max(beyond, x - 0.15)
        assert late < 0.02
        assert beyond < 0.03


def test_a_receiver_trembles_by_less_than_its_own_noise_whatever_that_is() -> None:
    def trembling(noise: float) -> float:
        rng, f = np.random.default_rng(4), PoseFilter()
        seen = []
        for k in range(900):
            f.update(k * STATION_S, noise * rng.standard_normal(3), STILL)
            seen.append(f.at((k + 0.5) * STATION_S)[0])
        return float(np.std(seen[300:])) / noise

    assert trembling(0.0002) < 0.55
    assert trembling(0.0008) < 0.55
    assert trembling(0.0024) < 0.7


def test_what_noise_is_survives_a_long_movement() -> None:
    """Ten seconds to and fro, then a sudden move: what is no noise is still known as none."""
    f, late = PoseFilter(), math.inf
    for k in range(1600):
        t = k / 120.0
        x = 0.2 * math.sin(5.0 * t) if t < 4.0 * math.pi * 0.8 else 0.15 * ease(min(1.0, max(0.0, (t - 12.0) / 0.14)))
        if k % 4 == 0:
            f.update(t, np.array([x, 0.0, 0.0]), STILL)
        if t >= 12.0 and f.at(t)[0][0] >= 0.075:
            late = min(late, t - 12.07)
    assert late < 0.02


def test_steady_movement_does_not_lag() -> None:
    f = PoseFilter()
    for k in range(60):
        f.update(k * STATION_S, np.array([0.5 * k * STATION_S, 0.0, 0.0]), turned(0.8 * k * STATION_S))
    t = 59.5 * STATION_S
    p, q = f.at(t)
    assert abs(p[0] - 0.5 * t) < 0.001
    assert apart(q, turned(0.8 * t)) < math.radians(0.5)


def test_a_finger_between_two_counts_of_its_glove_is_still() -> None:
    rng, f = np.random.default_rng(2), AngleFilter()
    count = math.radians(0.6)
    raw = [count * np.rint(7.5 + 0.3 * rng.standard_normal(20)) for _ in range(400)]
    calm = np.array([f.update(k * GLOVE_S, angles) for k, angles in enumerate(raw)])
    assert np.abs(np.diff(calm[60:], axis=0)).mean() < 0.2 * np.abs(np.diff(np.array(raw[60:]), axis=0)).mean()


def test_a_finger_that_closes_is_followed_within_two_degrees() -> None:
    f = AngleFilter()
    worst = 0.0
    for k in range(120):
        true = 0.75 * (1.0 - math.cos(2.0 * math.pi * min(1.0, k * GLOVE_S)))  # open, closed, open within a second
        worst = max(worst, abs(float(f.update(k * GLOVE_S, np.array([true]))[0]) - true))
    assert worst < math.radians(2.0)


def test_a_knock_of_a_filtered_finger_reaches_the_motion_whole() -> None:
    f, hold = AngleFilter(), PeakHold(math.radians(3.0))
    said = []
    for k in range(40):
        for half in range(2):
            t, angle = (k + 0.5 * half) * GLOVE_S, np.array([0.3 if (k, half) == (20, 0) else 0.0])
            hold.add(angle, f.update(t, angle))
        said.append(float(hold.take()[0]))
    assert max(said) == 0.3
    assert said[-1] < 0.01


def test_a_sample_that_is_not_newer_changes_nothing() -> None:
    f = AngleFilter()
    f.update(1.0, np.zeros(20))
    first = f.update(1.0 + GLOVE_S, np.full(20, 0.1))
    assert np.array_equal(f.update(1.0, np.full(20, 9.0)), first)
