"""Blinks of those whose lids nobody sees."""

from dataclasses import replace

import numpy as np

from vistel.figure.face.blink import blinking, lids_at
from vistel.figure.posture.posture import Posture

STEP_NS = 10_000_000


def openings(name: str, seconds: int) -> np.ndarray:
    return np.array([lids_at(name, 1_700_000_000_000_000_000 + n * STEP_NS)[0] for n in range(seconds * 100)])


def test_everybody_blinks_some_fifteen_times_a_minute_shortly_and_at_moments_of_their_own() -> None:
    aiko, ben = openings("aiko", 120), openings("ben", 120)
    for lids in (aiko, ben):
        shut = lids < 0.2
        assert 26 <= int((shut[1:] & ~shut[:-1]).sum()) <= 40
        assert (lids == 1.0).mean() > 0.9
        assert lids.min() >= 0.0
        assert np.abs(np.diff(lids)).max() < 0.15
    assert ((aiko < 0.5) & (ben < 0.5)).mean() < 0.02


def test_lids_that_are_seen_are_left_alone() -> None:
    wide = replace(Posture(), lids=np.array((1.3, 0.4)))
    assert blinking(wide, "aiko", 5) is wide
    assert blinking(Posture(), "aiko", 5).lids is not None
