"""What `vistel bench latency` rests on: when a hand's moves are seen, and when two hands meet."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.conferences.hand_watch import moves_seen
from benchmarks.conferences.moved_hand import EVERY_NS, MOVE_NS, moved
from benchmarks.conferences.touching_hands import touch_after_ns
from vistel.conference.model import Conference

LATE_NS = 70_000_000
PICTURE_NS = 33_333_333


def test_a_move_is_seen_as_late_as_pictures_are() -> None:
    times = range(0, 12 * EVERY_NS, PICTURE_NS)
    noise = np.random.default_rng(1).uniform(-5.0, 5.0, (len(times), 10, 10))
    pictures = [(t, 100.0 + 80.0 * moved(t - LATE_NS) + n) for t, n in zip(times, noise, strict=True)]
    late = [seen_ns - move_ns for move_ns, seen_ns in moves_seen(pictures, 24.0, 40)]
    assert len(late) >= 10
    assert all(LATE_NS - 2_000_000 <= ns <= LATE_NS + PICTURE_NS + 2_000_000 for ns in late)


def test_pictures_in_which_nothing_moves_are_told() -> None:
    pictures = [(t, np.full((10, 10), 100.0)) for t in range(0, 4 * EVERY_NS, PICTURE_NS)]
    with pytest.raises(RuntimeError, match="not seen"):
        list(moves_seen(pictures, 24.0, 40))


def test_a_hand_that_comes_down_meets_the_other_before_its_move_ends() -> None:
    sites = [{"name": f"s{n}", "participants": [{"name": f"person-{n}"}]} for n in range(2)]
    assert MOVE_NS // 2 < touch_after_ns(Conference.model_validate({"name": "c", "sites": sites})) < MOVE_NS
