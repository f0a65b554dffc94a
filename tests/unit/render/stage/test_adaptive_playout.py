"""A delay that follows the network, on simulated arrival times: short, nearly always long enough, and never seen to change."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.render.stage.arrivals import MOST_HELD, AdaptiveDelay
from vistel.render.stage.playout import DECAY, GROWTH, Playout

MS, S = 1_000_000, 1_000_000_000
FRAME = S // 60
RULE = AdaptiveDelay()


@dataclass(frozen=True)
class Picture:
    """now, point: drawn at, and moment shown [s]; behind, towards: delay of playout and what it becomes [s]."""

    now: float
    point: float
    behind: float
    towards: float
    rate: float
    holding: bool


def play(
    arrivals: list[tuple[int, int]], rate: float = 60.0, rule: AdaptiveDelay = RULE, jitter: Callable[[], float] = lambda: 0.0
) -> list[Picture]:
    """What is shown of frames (captured, received), by capture: values are capture times. jitter: of the pictures [s]."""
    playout: Playout[float] = Playout(lambda a, b, u: a + u * (b - a), rule)
    waiting, shown = sorted(arrivals, key=lambda a: a[1]), list[Picture]()
    now, end = 0.0, max(r for _, r in arrivals)
    while now < end:
        now += S * (1.0 / rate + jitter())
        while waiting and waiting[0][1] <= now:
            captured, received = waiting.pop(0)
            playout.push(captured, captured / S, received)
        point, t = playout.sample(int(now)), playout.timing
        if point is not None and t is not None:
            shown.append(Picture(now / S, point, t.playout_ns / S, t.towards_ns / S, t.rate, t.holding))
    return shown


def stream(seconds: float, transit_ms: Callable[[float], float], ppm: float = 0.0, begin: float = 0.0) -> list[tuple[int, int]]:
    """Sixty frames a second that wait for the one before them; ppm: how much the sender's clock gains."""
    out, last = list[tuple[int, int]](), 0
    for k in range(int(seconds * 60)):
        t = int(begin * S) + k * FRAME
        last = max(last, t + round(transit_ms(t / S) * MS))
        out.append((round(t * (1.0 + 1e-6 * ppm)), last))
    return out


def steady(pictures: list[Picture], after: float) -> list[Picture]:
    return [p for p in pictures if p.now > after]


def never_jumps(pictures: list[Picture], from_s: float = 0.0) -> None:
    """The point of playout moves forwards only, and as fast as time does, within the rates of change."""
    for a, b in itertools.pairwise(steady(pictures, from_s)):
        passed = b.now - a.now
        moved = passed - (b.behind - a.behind)
        assert (1.0 - GROWTH) * passed - 1e-8 <= moved <= (1.0 + DECAY) * passed + 1e-8
        assert b.point >= a.point - 1e-9


@pytest.mark.parametrize("rate", [13.0, 24.0, 60.0, 90.0])
def test_on_a_quiet_network_a_picture_is_hardly_later_than_the_frames_it_lies_between(rate: float) -> None:
    pictures = steady(play(stream(12.0, lambda t: 10.0), rate), 5.0)
    assert max(p.behind for p in pictures) < 0.030
    assert not any(p.holding for p in pictures)


@pytest.mark.parametrize("rate", [3.0, 13.0, 60.0])
@pytest.mark.parametrize("in_time", [0.9, 0.99])
def test_the_stated_share_of_frames_is_in_time(rate: float, in_time: float) -> None:
    rng = np.random.default_rng(5)
    uneven = partial(rng.uniform, -0.1 / rate, 0.1 / rate)
    pictures = play(stream(60.0, lambda t: 5.0 + rng.gamma(1.0, 12.0)), rate, AdaptiveDelay(in_time), uneven)
    late = sum(p.holding for p in steady(pictures, 20.0)) / (40.0 * 60.0)
    most = min(1.0 - in_time, MOST_HELD * rate / 60.0)
    assert 0.3 * most <= late <= 1.5 * most


def test_jitter_that_jumps_from_2_to_200_ms_and_back_is_followed_smoothly_both_ways() -> None:
    rng = np.random.default_rng(1)
    pictures = play(stream(70.0, lambda t: rng.uniform(0.0, 200.0 if 20.0 < t < 40.0 else 2.0)))
    never_jumps(pictures)
    assert all(p.behind < 0.030 for p in pictures if 10.0 < p.now < 20.0)
    assert all(0.150 < p.behind < 0.230 for p in pictures if 26.0 < p.now < 40.0)
    assert all(p.behind < 0.035 for p in pictures if p.now > 56.0)
    assert np.mean([p.holding for p in pictures if 26.0 < p.now < 40.0]) < 0.03


@pytest.mark.parametrize("ppm", [-200.0, 200.0])
@pytest.mark.parametrize("begin", [0.0, 3.0])
def test_a_sender_whose_clock_drifts_is_shown_as_short_behind_its_frames_all_the_time(ppm: float, begin: float) -> None:
    pictures = play(stream(300.0, lambda t: 10.0, ppm, begin), 30.0)
    never_jumps(pictures, begin + 4.0)
    late = [p.now - p.point / (1.0 + 1e-6 * ppm) for p in steady(pictures, begin + 6.0)]
    assert max(late) < 0.034
    assert np.mean([p.holding for p in steady(pictures, begin + 6.0)]) < 0.01


def test_a_cut_or_a_silent_sender_makes_nothing_later_afterwards() -> None:
    alive = stream(40.0, lambda t: 5.0)
    silent = [a for a in alive if not 15.0 < a[0] / S < 22.0]
    cut = [(t, r if not 15.0 < t / S < 22.0 else 22 * S + k) for k, (t, r) in enumerate(alive)]
    for arrivals in (silent, cut):
        pictures = play(arrivals)
        never_jumps(pictures)
        assert all(p.behind < 0.030 for p in steady(pictures, 10.0))
        assert not any(p.holding for p in steady(pictures, 22.1))


def test_a_renderer_that_falls_to_three_pictures_a_second_shows_them_no_later() -> None:
    rng = np.random.default_rng(2)
    arrivals = stream(30.0, lambda t: rng.uniform(5.0, 15.0))
    slow = play(arrivals, 3.0, jitter=lambda: rng.uniform(-0.05, 0.05))
    never_jumps(slow)
    assert max(p.behind for p in steady(slow, 8.0)) < 0.040


def test_what_was_sent_at_once_before_a_replay_begins_makes_nothing_late() -> None:
    before = [(3 * S - (150 - k) * FRAME, 2 * S + (k - 20) * MS // 5) for k in range(150)]
    pictures = play(before + stream(10.0, lambda t: 5.0, begin=3.0), rate=5.0)
    assert max(p.behind for p in pictures) > 1.0
    assert max(p.behind for p in steady(pictures, 3.0)) < 0.25


def test_bounds_are_kept() -> None:
    rng = np.random.default_rng(3)
    quick = AdaptiveDelay(least_ns=60 * MS, most_ns=90 * MS)
    for transit, bounds in ((lambda t: 5.0, (0.060, 0.060)), (lambda t: 5.0 if rng.uniform() < 0.98 else 300.0, (0.060, 0.0961))):
        for p in steady(play(stream(20.0, transit), rule=quick), 8.0):
            assert bounds[0] - 1e-6 <= p.behind <= bounds[1]


@pytest.mark.parametrize("offset", [-900, -60, 300, 5_000])
def test_a_clock_that_is_off_costs_nobody_time(offset: int) -> None:
    arrivals = [(t + offset * MS, r) for t, r in stream(15.0, lambda t: 10.0, begin=10.0)]
    for p in steady(play(arrivals), 18.0):
        assert p.now - (p.point - offset * 1e-3) < 0.030


def test_what_is_reported_of_a_change_tells_where_it_will_be_a_second_later() -> None:
    rng = np.random.default_rng(4)
    pictures = play(stream(40.0, lambda t: rng.uniform(0.0, 80.0 if t > 20.0 else 2.0)))
    told = 0
    for a, b in zip(pictures, pictures[60:], strict=False):
        if abs(a.towards - b.towards) < 5e-4:
            told += 1
            step = min(abs(a.towards - a.behind), a.rate * (b.now - a.now))
            assert b.behind == pytest.approx(a.behind + np.copysign(step, a.towards - a.behind), abs=1e-3)
    assert told > 100


@settings(deadline=None, max_examples=60)
@given(
    transits=st.lists(st.integers(0, 600), min_size=30, max_size=200),
    lost=st.sets(st.integers(0, 199)),
    rate=st.sampled_from([3.0, 13.0, 24.0, 90.0]),
    most=st.sampled_from([50, 500, 2000]),
)
def test_whatever_arrives_the_time_shown_never_goes_back_nor_jumps(
    transits: list[int], lost: set[int], rate: float, most: int
) -> None:
    arrivals = [(k * FRAME, k * FRAME + t * MS) for k, t in enumerate(transits) if k not in lost]
    if arrivals:
        pictures = play(arrivals, rate, AdaptiveDelay(most_ns=most * MS))
        never_jumps(pictures, 2.0 + pictures[0].now if pictures else 0.0)
        assert all(b.point >= a.point - 1e-9 for a, b in itertools.pairwise(pictures))
