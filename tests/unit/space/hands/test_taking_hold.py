"""What closing hands take, in every way that hands do; what hands that only come near do not; scores that are kept."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.grasping import report, sets
from benchmarks.grasping.errors import GLOVE, Errors
from benchmarks.grasping.grips import KINDS
from benchmarks.grasping.simulated import false_trials, true_trials
from benchmarks.grasping.trials import play, wilson

EXACT = Errors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_a_hand_of_known_size_takes_carries_and_lets_go_in_every_way(kind: str) -> None:
    trial = next(true_trials(sets.tune().things, EXACT, 1, 11, [kind]))
    ran = play(trial)
    assert (ran.found, ran.released) == (True, True)


def test_hands_that_stay_open_or_pass_or_push_take_nothing() -> None:
    wanted = {"beside", "over", "hover", "push", "sweep", "fist"}
    trials = {t.kind: t for t in false_trials(sets.tune().things, GLOVE, 1, 11) if t.kind in wanted}
    assert trials.keys() == wanted
    assert [kind for kind, t in trials.items() if play(t).took is not None] == []


def test_the_same_hand_takes_in_the_same_frame_again() -> None:
    once, again = (play(next(true_trials(sets.tune().things, GLOVE, 1, 11, ["pinch"]))) for _ in range(2))
    assert (once.took, once.left) == (again.took, again.left)


def test_a_commit_is_scored_once_and_only_as_it_is() -> None:
    assert report.refusal("1234abcd", []) is None
    assert "commit first" in str(report.refusal("1234abcd+", []))
    assert "scored already" in str(report.refusal("1234abcd", [{"commit": "1234abcd"}]))


def test_intervals_of_shares_are_wilsons() -> None:
    assert wilson(0, 10) == pytest.approx((0.0, 27.8), abs=0.1)
    assert wilson(95, 100) == pytest.approx((88.8, 97.8), abs=0.1)
    assert np.diff(wilson(950, 1000))[0] < np.diff(wilson(95, 100))[0]
