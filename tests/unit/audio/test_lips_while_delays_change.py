"""Voices stay with the lips while a picture's delay follows the network: simulated arrivals, reports as services send them."""

from __future__ import annotations

import numpy as np
import pytest

from vistel.audio.delay_policy import MARGIN_S, Policy, TargetDelay, Way
from vistel.audio.transit import TransitEstimate
from vistel.conference.model import PREDICTED_S
from vistel.render.stage.arrivals import AdaptiveDelay
from vistel.render.stage.playout import Playout

MS, S = 1_000_000, 1_000_000_000
FRAME, VOICE_FRAME = S // 60, 20 * MS
DRAWING_S = 0.04
EARLY_S, LATE_S = 0.015, 0.045
"""How much before and after the lips a voice may be heard (ATSC IS-191) [s]."""


def skews(jitter_ms: tuple[float, float, float], picture_ns: int, seed: int, predict_ns: int = 0) -> list[tuple[float, float]]:
    """Time and how much later than its picture a voice is heard, of somebody who speaks for a minute; the jitter is that of the
    first, second and third 20 s."""
    rng = np.random.default_rng(seed)
    playout: Playout[float] = Playout(
        lambda a, b, u: a + u * (b - a), AdaptiveDelay(predict_ns=predict_ns), lambda a, b, span, ahead: b + (b - a) / span * ahead
    )
    transit, target = TransitEstimate(), TargetDelay(Policy())

    def arrival(t: int) -> int:
        return t + round((5.0 + rng.uniform(0.0, jitter_ms[min(2, t // (20 * S))])) * MS)

    frames = sorted((arrival(k * FRAME), k * FRAME) for k in range(60 * 60))
    voices = sorted((arrival(k * VOICE_FRAME + VOICE_FRAME), k * VOICE_FRAME) for k in range(60 * 50))
    out, reported, status, towards, picture = list[tuple[float, float]](), 0, 0, 0, 0
    for now in range(0, 60 * S, 5 * MS):
        while frames and frames[0][0] <= now:
            received, t = frames.pop(0)
            playout.push(t, t / S, received)
        while voices and voices[0][0] <= now:
            received, t = voices.pop(0)
            transit.observe(received - t, received)
        needed_s = transit.transit_ns / S + MARGIN_S if transit.known else 0.0
        if now - status >= 250 * MS:
            playout.wait_for(round(needed_s * S))
            status = now
        if now - picture >= picture_ns and playout.sample(now) is not None:
            picture, shown = now, playout.timing
            assert shown is not None
            turned = abs(shown.towards_ns - towards) > 4 * MS
            if now - reported >= (100 if turned else 500) * MS:
                reported, towards = now, shown.towards_ns
                target.receive_image_delay(now, DRAWING_S, Way(shown.playout_ns / S, shown.towards_ns / S, shown.rate))
        if playout.timing is not None and target.image_s(now) is not None and now % VOICE_FRAME == 0:
            heard = target.wanted_s(now, needed_s, speaking=True)
            out.append((now / S, heard - playout.timing.playout_ns / S - DRAWING_S))
    return out


@pytest.mark.parametrize("predict_s", [0.0, PREDICTED_S, 0.05])
@pytest.mark.parametrize("picture_ms", [16, 75, 200])
@pytest.mark.parametrize("jitter", [(2.0, 2.0, 2.0), (2.0, 60.0, 2.0), (2.0, 200.0, 2.0)])
def test_a_voice_is_with_the_lips_at_every_moment_of_a_change(
    jitter: tuple[float, float, float], picture_ms: int, predict_s: float
) -> None:
    found = [(t, s) for t, s in skews(jitter, picture_ms * MS, 1, round(predict_s * S)) if t > 3.0]
    assert max(s for _, s in found) <= LATE_S
    assert min(s for _, s in found) >= -EARLY_S
