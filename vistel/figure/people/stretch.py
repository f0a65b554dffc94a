"""Space stretched round hands and head, so that they get more of the texture."""

from __future__ import annotations

from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.geometry.smoothstep import smooth

_ARM_Y = 1.41
_HAND = 1.8
"""Stretch of a hand over that of the body: 1 + this."""
_HEAD = 2.2
"""The same, of the head."""


def _gain_along_arm(x: F64) -> F64:
    return 1.0 + _HAND * smooth((x - 0.62) / 0.12)


def _gain_up(y: F64) -> F64:
    return 1.0 + _HEAD * smooth((y - 1.48) / 0.08)


def _integral(gain: Any, start: float, end: float) -> tuple[F64, F64]:
    x = np.linspace(start, end, 2001)
    g = gain(x)
    return x, start + np.concatenate([[0.0], np.cumsum(0.5 * (g[1:] + g[:-1]) * np.diff(x))])


_ALONG = _integral(_gain_along_arm, 0.0, 1.0)
"""Distances from the middle, and where they are stretched to [m]."""
_UP = _integral(_gain_up, 0.0, 1.9)
"""Heights, and where they are stretched to [m]."""


def stretch(points: F64) -> F64:
    """(N, 3) points of the reference person with hands and head enlarged."""
    x, y, z = points[:, 0], points[:, 1], points[:, 2]
    arm = _gain_along_arm(np.abs(x))
    head: F64 = np.where(np.abs(x) < 0.4, _gain_up(y), 1.0)
    along: F64 = np.sign(x) * np.interp(np.abs(x), *_ALONG) * head
    up: F64 = np.where(head > 1.0, np.interp(y, *_UP), _ARM_Y + (y - _ARM_Y) * arm)
    return np.stack([along, up, z * arm * head], axis=1)
