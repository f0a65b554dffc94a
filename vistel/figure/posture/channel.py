"""One sensor's value over time: followed while it arrives, held and then relaxed while it is missing, eased back on return."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_rotvec, rotvec_from_matrix

HOLD_S = 0.5
"""A silent sensor's last value stands for this long."""
RELAX_S = 1.2
"""Time constant of the relaxation that follows; it starts gently over the first RELAX_S."""
RETURN_S = 0.6
"""A sensor that comes back is eased to over this long."""


class MatrixPose(NamedTuple):
    """position (3,) [m] and rotation (3, 3)."""

    position: F64
    rotation: F64


def minimum_jerk(u: float) -> float:
    """0 at u <= 0, 1 at u >= 1, velocity and acceleration 0 at both ends."""
    u = min(1.0, max(0.0, u))
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))


def blend(a: MatrixPose, b: MatrixPose, share: float) -> MatrixPose:
    """From `a` (0) to `b` (1), rotation on the shorter arc."""
    if share <= 0.0:
        return a
    if share >= 1.0:
        return b
    turn = rotvec_from_matrix(np.ascontiguousarray(a.rotation.T @ b.rotation))
    return MatrixPose(a.position + share * (b.position - a.position), a.rotation @ matrix_from_rotvec(share * turn))


def relaxation(silent_s: float, dt: float) -> float:
    """Share of the way to rest to go in this step of `dt`, `silent_s` after the last value."""
    rate = minimum_jerk((silent_s - HOLD_S) / RELAX_S) / RELAX_S
    return 1.0 - math.exp(-dt * rate)


class Channel:
    """The pose of one receiver's joint in the frame the caller chose."""

    def __init__(self) -> None:
        self._value: MatrixPose | None = None
        self._t = 0.0
        self._heard = 0.0
        self._back = -math.inf
        self._from: MatrixPose | None = None

    def follow(self, t: float, measured: MatrixPose | tuple[F64, F64] | None, rest: Callable[[], MatrixPose]) -> MatrixPose:
        """The value at time `t`: `measured`, or without it what was last known on its way to `rest`, asked for only then."""
        dt, self._t = t - self._t, t
        if measured is None:
            if self._value is None:
                self._value, self._heard = rest(), t
            else:
                self._value = blend(self._value, rest(), relaxation(t - self._heard, dt))
            self._from = self._value
            return self._value
        now = MatrixPose(*measured)
        if self._from is not None:
            # Back after a silence: the difference is remembered and fades.
            self._back = t
            self._offset_p = self._from.position - now.position
            self._offset_r = rotvec_from_matrix(np.ascontiguousarray(now.rotation.T @ self._from.rotation))
            self._from = None
        self._heard = t
        left = 1.0 - minimum_jerk((t - self._back) / RETURN_S)
        if left > 0.0:
            now = MatrixPose(now.position + left * self._offset_p, now.rotation @ matrix_from_rotvec(left * self._offset_r))
        self._value = now
        return now


class HandChannel:
    """A glove's angles; relaxes to a resting hand."""

    def __init__(self, rest: F64) -> None:
        self._rest = rest
        self._value = rest.copy()
        self._t = 0.0
        self._heard = 0.0
        self._silent = False
        self._back = -math.inf
        self._offset = np.zeros_like(rest)

    def follow(self, t: float, measured: F64 | None) -> F64:
        """(20,) angles at time `t`."""
        dt, self._t = t - self._t, t
        if measured is None:
            self._silent = True
            self._value = self._value + relaxation(t - self._heard, dt) * (self._rest - self._value)
            return self._value
        if self._silent:
            self._silent, self._back, self._offset = False, t, self._value - measured
        self._heard = t
        self._value = measured + (1.0 - minimum_jerk((t - self._back) / RETURN_S)) * self._offset
        return self._value
