"""The One-Euro filter (Casiez, Roussel and Vogel, CHI 2012) for a receiver's pose, applied to the error of a prediction.

The filter is a first-order low-pass whose cut-off rises with speed: still hands do not tremble, quick hands do not lag. Here it
filters the difference between a sample and the pose predicted from the speed, so that steady motion does not lag at all. The
speed is filtered in the same way. A pose can be predicted a little beyond its last sample: the stations of one tracker are measured
one after the other, and a posture needs all four at one instant. The constants give the least error on recorded people at 30 Hz per
station with a FASTRAK's noise; at rest they give the least jitter at that error.

The angles of a glove go through the filter as it was published, without a prediction.
"""

import math

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix, rotvec_from_matrix

POSITION_CUTOFF_HZ = 1.0
"""Cut-off of the position at rest [Hz]."""
POSITION_SPEED_GAIN = 80.0
"""By how much that cut-off rises with speed [Hz per m/s]."""
ROTATION_CUTOFF_HZ = 1.0
"""Cut-off of the rotation at rest [Hz]."""
ROTATION_SPEED_GAIN = 15.0
"""By how much that cut-off rises with spin [Hz per rad/s]."""
VELOCITY_CUTOFF_HZ = 5.0
"""Cut-off of the velocity at rest [Hz]."""
VELOCITY_SPEED_GAIN = 40.0
"""By how much that cut-off rises with speed [Hz per m/s]."""
SPIN_CUTOFF_HZ = 5.0
"""Cut-off of the spin at rest [Hz]."""
SPIN_SPEED_GAIN = 2.0
"""By how much that cut-off rises with spin [Hz per rad/s]."""
MOST_SPIN = 12.0
"""A faster spin is followed, but predictions use no more than this [rad/s]."""
ACCELERATION_SHARE = 0.5
"""Share of the last acceleration that predictions use."""
AT_ONCE_M = 0.01
"""A sample corrects the predicted position at once by at most this [m]; more would make a quick hand jump."""
AT_ONCE_RAD = 0.15
"""A sample corrects the predicted rotation at once by at most this [rad]."""
CORRECTION_S = 1.0 / 30.0
"""The rest of a correction fades in over this time [s]: one sample of four stations."""
ANGLE_CUTOFF_HZ = 1.0
"""Cut-off of a glove's angles at rest [Hz]."""
ANGLE_SPEED_GAIN = 5.0
"""By how much that cut-off rises with their speed [Hz per rad/s]."""
ANGLE_VELOCITY_CUTOFF_HZ = 5.0
"""Cut-off of that speed [Hz]."""
RESTART_S = 0.5
"""After a gap this long the filter starts anew [s]."""
LONGEST_PREDICTION_S = 0.035
"""A pose is predicted for at most this time [s]: the cycle of a tracker with four stations."""


def _share(cutoff_hz: float, dt: float) -> float:
    r = 2.0 * math.pi * cutoff_hz * dt
    return r / (r + 1.0)


class AngleFilter:
    """Filters the angles of one glove, or other numbers; times in seconds, angles (n,) [rad]."""

    def __init__(
        self, cutoff_hz: float = ANGLE_CUTOFF_HZ, speed_gain: float = ANGLE_SPEED_GAIN, restart_s: float = RESTART_S
    ) -> None:
        """cutoff_hz: at rest; speed_gain: how it rises with their speed; restart_s: after a gap this long it starts anew."""
        self._cutoff_hz, self._gain, self._restart_s = cutoff_hz, speed_gain, restart_s
        self._t = -math.inf
        self._angles: F64 = np.zeros(0)
        self._speed: F64 = np.zeros(0)

    def update(self, t: float, angles: F64) -> F64:
        """The filtered angles (n,) after a sample; a sample that is not newer than the last is ignored."""
        dt = t - self._t
        if dt > self._restart_s or angles.shape != self._angles.shape:
            self._t, self._angles, self._speed = t, angles, np.zeros_like(angles)
        elif dt > 0.0:
            innovation = angles - self._angles
            self._speed = self._speed + _share(ANGLE_VELOCITY_CUTOFF_HZ, dt) * (innovation / dt - self._speed)
            r = 2.0 * math.pi * dt * (self._cutoff_hz + self._gain * np.abs(self._speed))
            self._t, self._angles = t, self._angles + r / (r + 1.0) * innovation
        return self._angles


class PoseFilter:
    """Filters one receiver; times in seconds, positions (3,) [m], quaternions (4,) x y z w."""

    def __init__(self) -> None:
        self._t = -math.inf
        self._start(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))

    @property
    def t(self) -> float:
        """Time of the last sample; -inf before the first."""
        return self._t

    @property
    def speeds(self) -> tuple[F64, F64]:
        """Velocity (3,) [m/s] and spin (3,) [rad/s] at the last sample, in the frame of the samples."""
        return self._v, self._w

    def update(self, t: float, p: F64, q: F64) -> None:
        """Take a sample; ignored if it is not newer than the last."""
        dt = t - self._t
        if dt <= 0.0:
            return
        if dt > RESTART_S:
            self._start(p, q)
        else:
            shown_p, shown_q = self.at(t)
            self._follow(dt, p, q)
            self._remaining_p = _beyond(shown_p - self._p, AT_ONCE_M)
            turn = matrix_from_quaternion(shown_q) @ matrix_from_quaternion(self._q).T
            self._remaining_q = _beyond(rotvec_from_matrix(turn), AT_ONCE_RAD)
        self._t = t

    def at(self, t: float) -> tuple[F64, F64]:
        """The pose at `t`, predicted from the last sample by velocity and acceleration."""
        ahead = min(LONGEST_PREDICTION_S, max(0.0, t - self._t))
        remaining = max(0.0, 1.0 - max(0.0, t - self._t) / CORRECTION_S)
        p = self._p + self._v * ahead + self._a * (0.5 * ACCELERATION_SHARE * ahead * ahead) + self._remaining_p * remaining
        turn = matrix_from_rotvec(self._remaining_q * remaining) @ matrix_from_rotvec(self._w * ahead)
        return p, quaternion_from_matrix(turn @ matrix_from_quaternion(self._q))

    def _start(self, p: F64, q: F64) -> None:
        self._p, self._q = p, q
        self._v, self._w, self._a = np.zeros(3), np.zeros(3), np.zeros(3)
        self._remaining_p, self._remaining_q = np.zeros(3), np.zeros(3)

    def _follow(self, dt: float, p: F64, q: F64) -> None:
        """Filter a sample `dt` after the last one."""
        speed, spin = float(np.linalg.norm(self._v)), float(np.linalg.norm(self._w))
        innovation = p - (self._p + self._v * dt)
        taken = _share(POSITION_CUTOFF_HZ + POSITION_SPEED_GAIN * speed, dt)
        self._p = p - (1.0 - taken) * innovation
        faster = taken * _share(VELOCITY_CUTOFF_HZ + VELOCITY_SPEED_GAIN * speed, dt) / dt * innovation
        self._v, self._a = self._v + faster, 0.5 * self._a + 0.5 * faster / dt
        predicted = matrix_from_rotvec(self._w * dt) @ matrix_from_quaternion(self._q)
        turn = rotvec_from_matrix(matrix_from_quaternion(q) @ predicted.T)
        taken = _share(ROTATION_CUTOFF_HZ + ROTATION_SPEED_GAIN * spin, dt)
        self._q = quaternion_from_matrix(matrix_from_rotvec(taken * turn) @ predicted)
        w = self._w + taken * _share(SPIN_CUTOFF_HZ + SPIN_SPEED_GAIN * spin, dt) / dt * turn
        self._w = w * min(1.0, MOST_SPIN / max(float(np.linalg.norm(w)), 1e-9))


def _beyond(vector: F64, length: float) -> F64:
    """The vector, shortened by `length`."""
    return vector * max(0.0, 1.0 - length / max(float(np.linalg.norm(vector)), 1e-9))
