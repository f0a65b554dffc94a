"""Where a motion will be a moment after its newest frame: it goes on as it went, ever more slowly.

How far back the velocity is taken and how soon it fades was tuned on recordings (`vistel bench motion` reports on others).
"""

import math
from dataclasses import replace

import numpy as np

from vistel.figure.posture.limits import within_limits
from vistel.figure.posture.posture import Posture, interpolate

SPAN_NS = 33_000_000
"""The velocity is that between the newest frame and one so much older: noise is divided by it."""
LONGEST_SPAN_NS = 100_000_000
"""An older frame says nothing about the velocity now."""
BODY_FADES_S = 0.1
"""In this time a body's velocity falls to 1/e: people turn back and stop."""
FINGERS_FADE_S = 0.015
"""The same of fingers, which are lighter."""
FASTEST = 4.0
"""No hip is taken to go faster [m/s]."""
FASTEST_TURN = 20.0
"""No joint is taken to turn faster [rad/s]."""


def faded(ahead_s: float, fades_s: float) -> float:
    """How long a velocity that fades goes on as it is to come as far as it does in `ahead_s` [s]."""
    return fades_s * (1.0 - math.exp(-ahead_s / fades_s))


def predicted(before: Posture, newest: Posture, span_s: float, ahead_s: float) -> Posture:
    """The posture `ahead_s` after `newest`, which came `span_s` after `before`. What keeps to the limits of joints goes on to do
    so; faces, lids and eyes stay as they are: they jump."""
    turned = max(float(np.abs(newest.dofs - before.dofs).max()), float(np.abs(newest.hands - before.hands).max())) / span_s
    moved = float(np.linalg.norm(newest.stance.position - before.stance.position)) / span_s
    slower = min(1.0, FASTEST_TURN / max(turned, 1e-9), FASTEST / max(moved, 1e-9))
    body = interpolate(before, newest, 1.0 + slower * faded(ahead_s, BODY_FADES_S) / span_s)
    hands = newest.hands + slower * faded(ahead_s, FINGERS_FADE_S) / span_s * (newest.hands - before.hands)
    free = replace(body, hands=hands, gaze=newest.gaze, face=newest.face, lids=newest.lids)
    kept, limited = within_limits(newest), within_limits(free)
    body_keeps = np.allclose(kept.dofs, newest.dofs, atol=1e-6)
    hands_keep = np.isclose(kept.hands, newest.hands, atol=1e-6).all(axis=1, keepdims=True)
    return replace(free, dofs=limited.dofs if body_keeps else free.dofs, hands=np.where(hands_keep, limited.hands, hands))
