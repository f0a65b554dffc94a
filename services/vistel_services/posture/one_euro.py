"""The One-Euro filter (Casiez, Roussel and Vogel, CHI 2012) for a receiver's pose, about where its speed takes it.

A first-order low-pass whose cut-off rises with speed: still hands do not tremble, quick hands do not lag. What is
filtered is only what the speed so far had not foretold, so that steady motion does not lag at all; the speed's own
cut-off rises in the same way. The pose can be asked for a little later than its last sample: stations of one tracker
are measured one after the other, and a posture needs all four at one instant. The constants are those of least error on
recorded people at 30 Hz per station with FASTRAK's noise.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vistel.figure.rotation import (
    matrix_from_quaternion,
    matrix_from_rotvec,
    quaternion_from_matrix,
    rotvec_from_matrix,
)

F64 = NDArray[np.float64]

POSITION_CUTOFF_HZ, POSITION_SPEED_GAIN = 3.0, 80.0
"""Cut-off at rest [Hz], and Hz more for each m/s."""
ROTATION_CUTOFF_HZ, ROTATION_SPEED_GAIN = 3.0, 15.0
"""Cut-off at rest [Hz], and Hz more for each rad/s."""
VELOCITY_CUTOFF_HZ, VELOCITY_SPEED_GAIN = 5.0, 40.0
"""The same for the velocity."""
SPIN_CUTOFF_HZ, SPIN_SPEED_GAIN = 5.0, 2.0
"""The same for the spin."""
MOST_SPIN = 8.0
"""A pose is not carried on faster than hands turn for long [rad/s]."""
FASTEST_TURN = 25.0
"""Of a hand, beside what its spin so far foretells [rad/s]."""
FORGET_S = 0.5
"""After a gap this long the filter starts anew."""
MOST_AHEAD_S = 0.035
"""How far a pose is carried on by its speed: a tracker's cycle over four stations, no more."""


def _share(cutoff_hz: float, dt: float) -> float:
    r = 2.0 * math.pi * cutoff_hz * dt
    return r / (r + 1.0)


class PoseFilter:
    """Filters one receiver; times in seconds, positions (3,) [m], quaternions (4,) x y z w."""

    def __init__(self) -> None:
        self._t = -math.inf
        self._p, self._q = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
        self._v, self._w = np.zeros(3), np.zeros(3)

    @property
    def t(self) -> float:
        """Time of the last sample; -inf before the first."""
        return self._t

    @property
    def speeds(self) -> tuple[F64, F64]:
        """Velocity (3,) [m/s] and spin (3,) [rad/s] at the last sample, in the frame of the samples."""
        return self._v, self._w

    def update(self, t: float, p: F64, q: F64) -> None:
        """Take a sample. One that is not newer than the last is left out."""
        dt = t - self._t
        if dt <= 0.0:
            return
        if dt > FORGET_S:
            self._p, self._q, self._v, self._w = p, q, np.zeros(3), np.zeros(3)
        else:
            speed, spin = float(np.linalg.norm(self._v)), float(np.linalg.norm(self._w))
            news = p - (self._p + self._v * dt)
            taken = _share(POSITION_CUTOFF_HZ + POSITION_SPEED_GAIN * speed, dt)
            self._p = p - (1.0 - taken) * news
            self._v = self._v + taken * _share(VELOCITY_CUTOFF_HZ + VELOCITY_SPEED_GAIN * speed, dt) / dt * news
            foretold = matrix_from_rotvec(self._w * dt) @ matrix_from_quaternion(self._q)
            turn = rotvec_from_matrix(matrix_from_quaternion(q) @ foretold.T)
            # What turns faster than people do is a glitch of the tracker: it is followed no faster than they could.
            turn = turn * min(1.0, FASTEST_TURN * dt / max(float(np.linalg.norm(turn)), 1e-9))
            taken = _share(ROTATION_CUTOFF_HZ + ROTATION_SPEED_GAIN * spin, dt)
            self._q = quaternion_from_matrix(matrix_from_rotvec(taken * turn) @ foretold)
            self._w = self._w + taken * _share(SPIN_CUTOFF_HZ + SPIN_SPEED_GAIN * spin, dt) / dt * turn
        self._t = t

    def at(self, t: float) -> tuple[F64, F64]:
        """The pose at `t`, carried on from the last sample by its speed."""
        ahead = min(MOST_AHEAD_S, max(0.0, t - self._t))
        spin = float(np.linalg.norm(self._w))
        turn = matrix_from_rotvec(self._w * (ahead * min(1.0, MOST_SPIN / max(spin, 1e-9))))
        return self._p + self._v * ahead, quaternion_from_matrix(turn @ matrix_from_quaternion(self._q))
