"""The number of pixels drawn follows what the machine can do, on simulated machines."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest

from vistel.render.resolution import FEWEST_LINES, STEPS, Resolution

RATE = 25.0
PERIOD_S = 1.0 / RATE
Cost = Callable[[float, float], float]
"""Seconds that a picture takes at a time [s] and scale."""


def draw(cost: Cost, seconds: float, lines: int = 720) -> list[tuple[float, float, float]]:
    """(time, scale, seconds taken) of every picture."""
    resolution = Resolution(RATE, lines)
    out: list[tuple[float, float, float]] = []
    t, scale = 0.0, 1.0
    while t < seconds:
        took = cost(t, scale)
        t += max(PERIOD_S, took)
        out.append((t, scale, took))
        scale = resolution.drew(round(t * 1e9), round(took * 1e9))
    return out


def changes(pictures: list[tuple[float, float, float]]) -> int:
    return sum(a[1] != b[1] for a, b in pairwise(pictures))


def test_a_machine_with_time_to_spare_draws_every_pixel():
    assert {scale for _, scale, _ in draw(lambda t, s: 0.005 + 0.02 * s * s, 60.0)} == {1.0}


@pytest.mark.parametrize("per_picture", [0.045, 0.06, 0.08, 0.11])
def test_a_weak_machine_draws_fewer_pixels_until_it_holds_the_rate(per_picture: float):
    pictures = draw(lambda t, s: 0.008 + per_picture * s * s, 60.0)
    late = [p for p in pictures if p[0] > 10.0]
    assert sum(took for _, _, took in late) / len(late) <= PERIOD_S
    # Not fewer than needed: the next step up would have been too slow, or nearly.
    scale = min(s for _, s, _ in late)
    above = STEPS[STEPS.index(scale) - 1]
    assert 0.008 + per_picture * above * above > 0.75 * PERIOD_S


def test_pixels_come_back_when_the_machine_has_time_again():
    pictures = draw(lambda t, s: 0.005 + (0.1 if t < 20.0 else 0.02) * s * s, 60.0)
    assert min(s for t, s, _ in pictures if 10.0 < t < 20.0) <= 0.59
    assert {s for t, s, _ in pictures if t > 50.0} == {1.0}


def test_where_pixels_cost_nothing_they_are_kept():
    """The machine is slow at something else: a small picture would only be an ugly one."""
    pictures = draw(lambda t, s: 0.08 + 0.001 * s * s, 300.0)
    whole = sum(s == 1.0 for _, s, _ in pictures)
    assert whole / len(pictures) > 0.9


def test_it_does_not_swing_to_and_fro():
    """Just too slow at one step and just fast enough at the next, for ten minutes."""
    assert changes(draw(lambda t, s: 0.004 + 0.036 * s * s, 600.0)) <= 12
    assert changes(draw(lambda t, s: 0.02 + 0.03 * s * s, 600.0)) <= 12


def test_a_small_display_is_never_drawn_smaller_than_is_worth_looking_at():
    smallest = min(s for _, s, _ in draw(lambda t, s: 0.2 * s * s, 30.0, lines=360))
    assert smallest * 360 >= FEWEST_LINES
    assert {s for _, s, _ in draw(lambda t, s: 0.2, 30.0, lines=240)} == {1.0}
