"""Playout with simulated time: steady, monotone, without pops, whatever the network does."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.render.stage.playout import BLEND_NS, Playout

MS = 1_000_000
DELAY = 100 * MS
FRAME = 1_000_000_000 // 60
DRAW = 1_000_000_000 // 30


def lerp(a: float, b: float, u: float) -> float:
    return a + u * (b - a)


def wave(t_ns: int) -> float:
    """A motion of at most 3 units per second."""
    return math.sin(3.0 * t_ns * 1e-9)


def play(arrivals: list[tuple[int, int]], until_ns: int, value=wave) -> list[tuple[int, float | None]]:
    """What is shown at every drawing time; arrivals: (captured, received) in order of receipt."""
    playout: Playout[float] = Playout(lerp, DELAY)
    shown: list[tuple[int, float | None]] = []
    waiting = sorted(arrivals, key=lambda a: a[1])
    now = 0
    while now <= until_ns:
        while waiting and waiting[0][1] <= now:
            captured, received = waiting.pop(0)
            playout.push(captured, value(captured), received)
        shown.append((now, playout.sample(now)))
        now += DRAW
    return shown


def steady(seconds: float, transit_ns: int = 5 * MS) -> list[tuple[int, int]]:
    return [(k * FRAME, k * FRAME + transit_ns) for k in range(int(seconds * 60))]


def test_nothing_is_shown_before_the_first_frame() -> None:
    playout: Playout[float] = Playout(lerp, DELAY)
    assert playout.sample(5) is None
    assert playout.timing is None


def test_steady_stream_is_shown_exactly_the_delay_behind() -> None:
    for now, value in play(steady(2.0), 1_900 * MS):
        if now > DELAY:
            assert value == pytest.approx(wave(now - DELAY), abs=2e-3)


def test_timing_reports_delay_and_age_of_a_steady_stream() -> None:
    playout: Playout[float] = Playout(lerp, DELAY)
    for captured, received in steady(1.0, 8 * MS):
        playout.push(captured, 0.0, received)
    now = 59 * FRAME + 10 * MS
    playout.sample(now)
    timing = playout.timing
    assert timing is not None
    assert timing.delay_ns == DELAY
    assert timing.age_ns == 10 * MS
    assert timing.jitter_ns == 0
    assert not timing.holding


def test_jitter_is_the_smoothed_change_of_transit() -> None:
    playout: Playout[float] = Playout(lerp, DELAY)
    for k in range(400):
        playout.push(k * FRAME, 0.0, k * FRAME + (10 * MS if k % 2 else 4 * MS))
    playout.sample(400 * FRAME)
    assert playout.timing is not None
    assert playout.timing.jitter_ns == pytest.approx(6 * MS, rel=0.02)


def test_a_gap_is_held_and_left_without_a_pop() -> None:
    before, after = 60, 110
    arrivals = [a for k, a in enumerate(steady(3.0)) if not before <= k < after]
    shown = play(arrivals, 2_900 * MS)
    held = [v for t, v in shown if before * FRAME + DELAY + 2 * DRAW < t < after * FRAME - DRAW]
    assert len(held) > 10
    assert max(held) == min(held) == wave((before - 1) * FRAME)
    back = after * FRAME + BLEND_NS + 4 * DRAW
    for (_, v0), (t1, v1) in pairwise(shown):
        if v0 is None or v1 is None:
            continue
        # At most the motion itself plus the whole gap's distance over the blend.
        assert abs(v1 - v0) <= (3.0 + 2.0 / (BLEND_NS * 1e-9)) * DRAW * 1e-9 + 1e-9
        if t1 > back:
            assert v1 == pytest.approx(wave(t1 - DELAY), abs=2e-3)


def test_holding_is_reported_and_delay_grows_while_frames_are_missing() -> None:
    playout: Playout[float] = Playout(lerp, DELAY)
    for captured, received in steady(1.0):
        playout.push(captured, wave(captured), received)
    playout.sample(1_000 * MS)
    playout.sample(2_000 * MS)
    timing = playout.timing
    assert timing is not None
    assert timing.holding
    assert timing.age_ns == timing.delay_ns == 2_000 * MS - 59 * FRAME


def test_strays_and_repeats_are_refused() -> None:
    playout: Playout[float] = Playout(lerp, DELAY)
    assert playout.push(100 * MS, 1.0, 105 * MS)
    assert not playout.push(100 * MS, 2.0, 106 * MS)
    assert not playout.push(50 * MS, 3.0, 107 * MS)
    assert playout.sample(250 * MS) == 1.0


def test_a_sender_that_begins_again_with_an_earlier_clock_is_followed() -> None:
    playout: Playout[float] = Playout(lerp, DELAY)
    for k in range(60):
        playout.push(100_000 * MS + k * FRAME, 1.0, k * FRAME)
    playout.sample(60 * FRAME)
    for k in range(60, 240):
        playout.push(k * FRAME, 2.0, k * FRAME + 5 * MS)
        value = playout.sample(k * FRAME + 6 * MS)
    assert value == 2.0


@pytest.mark.parametrize("offset_ms", [-400, -60, 300, 900])
def test_a_sender_whose_clock_is_off_is_shown_smoothly_all_the_same(offset_ms: int) -> None:
    arrivals = [(k * FRAME + offset_ms * MS, k * FRAME + 5 * MS) for k in range(240)]
    shown = [v for t, v in play(arrivals, 3_900 * MS, value=lambda t: t * 1e-9) if v is not None and t > 500 * MS]
    steps = np.diff(shown)
    assert steps.min() > 0.5 * DRAW * 1e-9
    assert steps.max() < 1.5 * DRAW * 1e-9


def test_who_begins_with_old_frames_is_not_late_for_long() -> None:
    """A replay feeds what lies before its beginning at once; a picture may be taken in the middle of that."""
    playout: Playout[float] = Playout(lerp, DELAY)
    for k in range(30):
        playout.push(k * FRAME, k * FRAME * 1e-9, 150 * FRAME)
    assert playout.sample(150 * FRAME) is not None
    for k in range(30, 180):
        playout.push(k * FRAME, k * FRAME * 1e-9, max(150, k) * FRAME + 5 * MS)
    assert playout.sample(180 * FRAME) == pytest.approx((180 * FRAME - DELAY) * 1e-9, abs=1e-3)


@settings(deadline=None, max_examples=120)
@given(
    transits=st.lists(st.integers(0, 400), min_size=30, max_size=200),
    lost=st.sets(st.integers(0, 199)),
    drawing=st.lists(st.integers(1, 120), min_size=5, max_size=120),
)
def test_time_shown_never_runs_backwards_nor_jumps(transits: list[int], lost: set[int], drawing: list[int]) -> None:
    """Values are capture times, so what is shown is the point of playout itself."""
    arrivals = sorted(((k * FRAME + t * MS, k * FRAME) for k, t in enumerate(transits) if k not in lost), key=lambda a: a[0])
    playout: Playout[float] = Playout(lerp, DELAY)
    newest, last, now, at, span = -1.0, None, 0, 0, 0.0
    for wait in drawing:
        now += wait * MS
        while at < len(arrivals) and arrivals[at][0] <= now:
            received, captured = arrivals[at]
            playout.push(captured, captured * 1e-9, received)
            newest = max(newest, captured * 1e-9)
            at += 1
        value = playout.sample(now)
        if value is None:
            continue
        assert value <= newest + 1e-9
        if last is not None:
            assert value >= last - 1e-9
            # Catching up after a hold goes home within the blend, never at once.
            span = max(span, newest - last)
            gap = span + (BLEND_NS + wait * MS) * 1e-9  # the live frames move on meanwhile
            allowed = 1.06 * wait * 1e-3 + gap * min(1.0, wait * MS / BLEND_NS)
            assert value - last <= allowed + 1e-9
        last = value
