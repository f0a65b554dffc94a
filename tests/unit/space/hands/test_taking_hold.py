"""What closing hands take, in every way that hands do; what hands that only come near do not; scores that are kept."""

from __future__ import annotations

import pytest

from benchmarks.grasping import sets
from benchmarks.grasping.errors import GLOVE, Errors
from benchmarks.grasping.grips import KINDS
from benchmarks.grasping.simulated import false_trials, true_trials
from benchmarks.grasping.trials import play

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
