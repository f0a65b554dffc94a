"""Of what two recognisers make of an utterance the surer reading counts, once, and neither is waited for without end."""

from __future__ import annotations

import numpy as np
import pytest

from vistel.speech.combined import CombinedRecogniser, Trust
from vistel.speech.recognition import SAMPLE_RATE, Hypotheses, Hypothesis, Samples


class Finds:
    """An utterance at each of the times given: (when it is found, start, end, word, confidence)."""

    def __init__(self, *utterances: tuple[float, float, float, str, float]) -> None:
        self._utterances = utterances
        self.reset()

    def reset(self) -> None:
        self._fed = 0

    def feed(self, samples: Samples) -> list[Hypotheses]:
        before, self._fed = self._fed / SAMPLE_RATE, self._fed + len(samples)
        return [self._found(u) for u in self._utterances if before < u[0] <= self._fed / SAMPLE_RATE]

    def flush(self) -> list[Hypotheses]:
        return [self._found(u) for u in self._utterances if u[1] < self._fed / SAMPLE_RATE < u[0]]

    @staticmethod
    def _found(utterance: tuple[float, float, float, str, float]) -> Hypotheses:
        _, start_s, end_s, word, confidence = utterance
        return (Hypothesis((word,), confidence, start_s, end_s),)


def heard(one: Finds, other: Finds, seconds: float = 4.0, chunk: int = 160) -> list[tuple[str, float]]:
    """Words, and when they were told to a tenth of a second."""
    both = CombinedRecogniser((one, other), (Trust("net"), Trust("words")))
    sound = np.zeros(round(seconds * SAMPLE_RATE), np.float32)
    found = []
    for at in range(0, len(sound), chunk):
        piece = sound[at : at + chunk]
        found += [(each[0].words[0], round((at + len(piece)) / SAMPLE_RATE, 1)) for each in both.feed(piece)]
    return found + [(each[0].words[0], seconds) for each in both.flush()]


@pytest.mark.parametrize(("sure", "expected"), [(0.9, "box"), (0.1, "ball")])
def test_the_surer_one_counts(sure: float, expected: str) -> None:
    assert heard(Finds((1.5, 0.5, 1.3, "box", sure)), Finds((1.6, 0.5, 1.4, "ball", 0.5))) == [(expected, 1.6)]


def test_what_comes_later_about_the_same_is_dropped_and_the_next_is_not() -> None:
    late = Finds((2.5, 0.4, 2.2, "ball", 1.0), (3.5, 2.8, 3.3, "cone", 0.8))
    assert heard(Finds((1.5, 0.5, 1.3, "box", 0.6)), late, seconds=5.0) == [("box", 2.1), ("cone", 4.1)]


def test_the_next_one_within_the_waiting_is_told_too() -> None:
    assert [word for word, _ in heard(Finds((1.5, 0.5, 1.3, "box", 0.6), (1.9, 1.4, 1.7, "undo", 0.7)), Finds())] == ["box", "undo"]


def test_nothing_is_told_of_silence_and_a_flush_ends_the_waiting() -> None:
    assert heard(Finds(), Finds()) == []
    assert heard(Finds((9.0, 3.0, 3.9, "box", 0.6)), Finds((3.9, 3.0, 3.8, "ball", 0.7))) == [("ball", 4.0)]


def test_how_the_stream_is_cut_changes_nothing_but_the_time() -> None:
    one = (1.5, 0.5, 1.3, "box", 0.6), (3.1, 2.5, 2.9, "cone", 0.6)
    other = (1.66, 0.5, 1.4, "ball", 0.7), (3.9, 2.5, 3.4, "lid", 0.9)
    for chunk in (160, 320, 4000, 64000):
        assert [word for word, _ in heard(Finds(*one), Finds(*other), chunk=chunk)] == ["ball", "cone"]


@pytest.mark.parametrize(
    ("sure", "kinds", "told_s"),
    [(0.8, ("net", "words"), 1.5), (0.5, ("net", "words"), 2.1), (0.8, ("net", "net"), 2.1)],
    ids=["surely", "hardly", "of one kind"],
)
def test_what_two_of_different_kinds_agree_on_surely_waits_for_no_third(sure: float, kinds: tuple[str, ...], told_s: float) -> None:
    heard = [Finds((1.5, 0.5, 1.3, "box", sure)) for _ in kinds]
    three = CombinedRecogniser([*heard, Finds()], [*map(Trust, kinds), Trust("third")])
    pieces = [round(at / SAMPLE_RATE, 1) for at in range(320, 4 * SAMPLE_RATE, 320) if three.feed(np.zeros(320, np.float32))]
    assert pieces == [told_s]
