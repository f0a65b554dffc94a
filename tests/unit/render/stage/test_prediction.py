"""Motion that is predicted: it goes on, slows down, keeps to what bodies can do, and makes pictures younger."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.conference.model import PlayoutConfig
from vistel.figure.posture.limits import within_limits
from vistel.figure.posture.posture import DOF_COUNT, Posture, Stance
from vistel.render.config import live_delay
from vistel.render.stage.arrivals import AdaptiveDelay
from vistel.render.stage.playout import Playout
from vistel.render.stage.prediction import BODY_FADES_S, FASTEST, FASTEST_TURN, predicted

MS, S = 1_000_000, 1_000_000_000
FRAME = S // 60


def test_what_rests_is_predicted_to_rest_and_what_moves_to_go_on_but_never_further_than_its_velocity_lasts() -> None:
    rest = Posture()
    np.testing.assert_array_equal(predicted(rest, rest, 0.033, 0.1).dofs, rest.dofs)
    moving = replace(rest, stance=Stance(np.array([0.0, 0.0, 0.033])))
    ways = [predicted(rest, moving, 0.033, ahead).stance.position[2] - 0.033 for ahead in (0.03, 0.06, 0.1, 10.0)]
    assert ways[0] == pytest.approx(0.026, abs=1e-3)
    assert ways == sorted(ways)
    assert ways[-1] == pytest.approx(BODY_FADES_S)


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.floats(0.001, 0.1), st.floats(0.0, 0.1))
def test_a_prediction_never_runs_away(seed: int, span_s: float, ahead_s: float) -> None:
    rng = np.random.default_rng(seed)
    a, b = (
        within_limits(Posture(2.0 * rng.normal(size=DOF_COUNT), rng.normal(size=(2, 20)), Stance(3.0 * rng.normal(size=3))))
        for _ in "ab"
    )
    p = predicted(a, b, span_s, ahead_s)
    assert np.isfinite(p.dofs).all() and np.isfinite(p.hands).all()
    assert float(np.linalg.norm(p.stance.position - b.stance.position)) <= FASTEST * ahead_s + 1e-9
    assert float(np.abs(p.hands - b.hands).max()) <= FASTEST_TURN * ahead_s + 1e-6
    if np.allclose(within_limits(b).dofs, b.dofs, atol=1e-6):
        np.testing.assert_allclose(within_limits(p).dofs, p.dofs, atol=1e-4)


def played(predict_ms: int) -> tuple[list[float], list[float]]:
    """Moments shown [s] and how late [s], of a steady motion at sixty frames with a way of 20 ms and 30 ms of jitter."""
    rng = np.random.default_rng(1)
    playout: Playout[float] = Playout(
        lambda a, b, u: a + u * (b - a),
        AdaptiveDelay(predict_ns=predict_ms * MS),
        lambda a, b, span, ahead: b + (b - a) / span * ahead,
    )
    last, waiting = 0, list[tuple[int, int]]()
    for k in range(1200):
        last = max(last, k * FRAME + 20 * MS + int(rng.integers(0, 30 * MS)))
        waiting.append((last, k * FRAME))
    shown, late = list[float](), list[float]()
    for now in range(0, 20 * S, FRAME):
        while waiting and waiting[0][0] <= now:
            received, captured = waiting.pop(0)
            playout.push(captured, captured / S, received)
        value, timing = playout.sample(now), playout.timing
        if value is not None and timing is not None and now > 10 * S:
            shown.append(value)
            late.append(now / S - value)
    return shown, late


def test_pictures_are_younger_by_what_is_predicted_and_time_never_goes_back() -> None:
    (_, plain), (shown, predicted_late) = played(0), played(40)
    assert np.median(plain) - np.median(predicted_late) == pytest.approx(0.04, abs=0.005)
    assert np.diff(shown).min() >= -1e-9
    assert min(predicted_late) > -1e-9


@pytest.mark.parametrize("rate", [24.0, 30.0, 60.0])
def test_unless_it_is_said_otherwise_a_picture_is_as_late_as_its_frames_and_their_jitter(rate: float) -> None:
    """A way of 10 ms and 3 ms of jitter, as on one machine: no frame of 16.7 ms is waited for on top, and few postures are held."""
    rng = np.random.default_rng(3)
    jitter = rng.exponential(3.0, 1500) * MS
    live = live_delay(PlayoutConfig())
    assert isinstance(live, AdaptiveDelay)
    playout: Playout[float] = Playout(lambda a, b, u: a + u * (b - a), live, lambda a, b, span, ahead: b + (b - a) / span * ahead)
    waiting, now, last = [(k * FRAME, k * FRAME + 10 * MS + int(jitter[k])) for k in range(1500)], 0.0, -1.0
    late, held = list[float](), list[bool]()
    while now < 24 * S:
        now += S / rate * (1.0 + 0.02 * rng.standard_normal())
        while waiting and waiting[0][1] <= now:
            captured, received = waiting.pop(0)
            playout.push(captured, captured / S, received)
        value, timing = playout.sample(int(now)), playout.timing
        assert value is not None and timing is not None and value >= last
        last = value
        if now > 12 * S:
            late.append(timing.playout_ns / MS)
            held.append(timing.holding)
    assert np.median(late) < 10.0 + float(np.percentile(jitter, 99)) / MS + 2.0
    assert np.mean(held) < 0.03
