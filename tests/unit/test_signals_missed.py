"""How missed signals are counted: people who truly signal, and what is told of them when nothing is measured wrong."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.figures.gestures import signals_in
from benchmarks.figures.signals_missed import HELD_S, RATE_HZ, Trial, delay_s, trials
from vistel.space.gestures import EVERY, STEPS, THUMB, UP


@pytest.mark.parametrize("kind", [UP, THUMB])
def test_who_truly_signals_is_seen_as_soon_as_it_counts_where_nothing_is_measured_wrong(kind: str) -> None:
    for trial in trials(kind, 4, seed=5):
        assert trial.ends - trial.begins >= RATE_HZ * HELD_S[0]
        delay = delay_s(trial, [(trial.skeleton, p) for p in trial.postures])
        assert delay is not None and STEPS[kind] / RATE_HZ <= delay <= STEPS[kind] / RATE_HZ + EVERY / RATE_HZ


def test_who_is_never_seen_to_signal_is_missed_and_trials_are_those_of_their_seed() -> None:
    (trial,) = trials(UP, 1, seed=5)
    assert delay_s(trial, [(trial.skeleton, trial.postures[0])] * len(trial.postures)) is None
    (again,) = trials(UP, 1, seed=5)
    (other,) = trials(UP, 1, seed=6)

    def last(of: Trial) -> np.ndarray:
        return of.postures[of.ends - 1].dofs

    assert np.array_equal(last(trial), last(again)) and not np.array_equal(last(trial), last(other))


def test_a_look_that_misses_begins_the_second_anew() -> None:
    assert signals_in([True] * 11, UP) == [10]
    assert signals_in([True] * 10 + [False] + [True] * 10, UP) == []
    assert signals_in([True] * 6 + [False] + [True] * 9, THUMB) == [5, 12]
