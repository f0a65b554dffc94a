"""The One-Euro filter (Casiez, Roussel and Vogel, CHI 2012) for a receiver's pose, applied to the error of a prediction.

The filter is a first-order low-pass whose cut-off rises with speed: still hands do not tremble, quick hands do not lag. Here it
filters the difference between a sample and the pose predicted from the speed, so that steady motion does not lag at all. The
speed is filtered in the same way. A pose can be predicted a little beyond its last sample: the stations of one tracker are measured
one after the other, and a posture needs all four at one instant.

A hand that begins to move has no filtered speed yet. So what a sample differs from its prediction by, beyond what noise explains,
counts as speed at once. How much noise explains is learnt while the receiver is still, as the usual difference then: a receiver far
from its transmitter, or one of a better tracker, gets its own. The constants were tuned on recorded people and made-up reaches, and
chosen on others; `vistel bench posture` reports on a third set.

The angles of a glove go through the filter as it was published, without a prediction.
"""

import math

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import (
    matrix_from_quaternion,
    matrix_from_rotvec,
    multiply,
    quaternion_from_matrix,
    rotvec_from_matrix,
)
from vistel.jit.kernel_jit import compiled

POSITION_CUTOFF_HZ = 1.1
"""Cut-off of the position at rest [Hz]."""
POSITION_SPEED_GAIN = 75.0
"""By how much that cut-off rises with speed [Hz per m/s]."""
ROTATION_CUTOFF_HZ = 0.8
"""Cut-off of the rotation at rest [Hz]."""
ROTATION_SPEED_GAIN = 60.0
"""By how much that cut-off rises with spin [Hz per rad/s]."""
VELOCITY_CUTOFF_HZ = 0.85
"""Cut-off of the velocity at rest [Hz]."""
VELOCITY_SPEED_GAIN = 160.0
"""By how much that cut-off rises with speed [Hz per m/s]."""
SPIN_CUTOFF_HZ = 0.8
"""Cut-off of the spin at rest [Hz]."""
SPIN_SPEED_GAIN = 20.0
"""By how much that cut-off rises with spin [Hz per rad/s]."""
MOST_SPIN = 12.0
"""A faster spin is followed, but predictions use no more than this [rad/s]."""
MOST_ACCELERATION = 30.0
"""Predictions use no greater acceleration [m/s2]: noise and glitches make one, too."""
SURPRISE_GAIN = 4.0
"""A difference beyond noise, divided by the time since the last sample, counts as so many times that speed."""
BEYOND_NOISE = 2.4
"""A difference of more than so many times the usual one is none of noise."""
NOISE_M = 0.0018
"""The usual difference of a still receiver, until its own is learnt [m]: of a FASTRAK's 0.8 mm for each axis."""
NOISE_RAD = 0.0045
"""The same of its rotation [rad]: of 0.15 degrees for each axis."""
LEAST_NOISE = 0.25
"""No receiver is taken to be quieter than this share of that."""
MOST_NOISE = 6.0
"""No receiver is taken to be noisier than so many times that."""
NOISE_SHARE = 0.05
"""Share of each sample of a still receiver in what is usual."""
AT_ONCE_M = 0.025
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


_NUMBERS = 8, 4
"""Rows and columns of what a `PoseFilter` knows; the rows are the following."""
_POSITION = 0
_QUATERNION = 1
_VELOCITY = 2
_SPIN = 3
_ACCELERATION = 4
_LEFT_P = 5
"""What is left of a correction, position [m]."""
_LEFT_Q = 6
"""What is left of a correction, rotation vector [rad]."""
_USUAL = 7
"""The usual difference of a still receiver, position [m] and rotation [rad]."""


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
            self._t = t
            self._angles, self._speed = _follow_angles(self._angles, self._speed, angles, dt, self._cutoff_hz, self._gain)
        return self._angles


class PoseFilter:
    """Filters one receiver; times in seconds, positions (3,) [m], quaternions (4,) x y z w."""

    def __init__(self) -> None:
        self._t = -math.inf
        self._known: F64 = np.zeros(_NUMBERS)
        _start(self._known, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))

    @property
    def t(self) -> float:
        """Time of the last sample; -inf before the first."""
        return self._t

    @property
    def speeds(self) -> tuple[F64, F64]:
        """Velocity (3,) [m/s] and spin (3,) [rad/s] at the last sample, in the frame of the samples."""
        return self._known[_VELOCITY, :3].copy(), self._known[_SPIN, :3].copy()

    def update(self, t: float, p: F64, q: F64) -> None:
        """Take a sample; ignored if it is not newer than the last."""
        dt = t - self._t
        if dt <= 0.0:
            return
        if dt > RESTART_S:
            _start(self._known, p, q)
        else:
            _take(self._known, dt, p, q)
        self._t = t

    def at(self, t: float) -> tuple[F64, F64]:
        """The pose at `t`, predicted from the last sample by velocity and acceleration."""
        return _predicted(self._known, max(0.0, t - self._t))


@compiled
def _follow_angles(angles: F64, speed: F64, sample: F64, dt: float, cutoff_hz: float, gain: float) -> tuple[F64, F64]:
    """Filtered angles and their speed, `dt` after the last ones."""
    innovation = sample - angles
    speed = speed + _share(ANGLE_VELOCITY_CUTOFF_HZ, dt) * (innovation / dt - speed)
    r = 2.0 * math.pi * dt * (cutoff_hz + gain * np.abs(speed))
    return angles + r / (r + 1.0) * innovation, speed


@compiled
def _start(known: F64, p: F64, q: F64) -> None:
    known[:_USUAL] = 0.0
    known[_POSITION, :3], known[_QUATERNION] = p, q


@compiled
def _predicted(known: F64, passed: float) -> tuple[F64, F64]:
    """The pose `passed` seconds after the last sample."""
    ahead = min(LONGEST_PREDICTION_S, passed)
    remaining = max(0.0, 1.0 - passed / CORRECTION_S)
    p = known[_POSITION, :3] + known[_VELOCITY, :3] * ahead + known[_ACCELERATION, :3] * (0.5 * ahead * ahead)
    left, spun = matrix_from_rotvec(known[_LEFT_Q, :3] * remaining), matrix_from_rotvec(known[_SPIN, :3] * ahead)
    q = multiply(multiply(left, spun), matrix_from_quaternion(known[_QUATERNION]))
    return p + known[_LEFT_P, :3] * remaining, quaternion_from_matrix(q)


@compiled
def _take(known: F64, dt: float, p: F64, q: F64) -> None:
    """Filter a sample `dt` after the last one. What was shown moves to it at once by no more than AT_ONCE_M and AT_ONCE_RAD."""
    shown_p, shown_q = _predicted(known, dt)
    _follow_position(known, dt, p)
    _follow_rotation(known, dt, q)
    known[_LEFT_P, :3] = _beyond(shown_p - known[_POSITION, :3], AT_ONCE_M)
    back = matrix_from_quaternion(_conjugate(known[_QUATERNION]))
    known[_LEFT_Q, :3] = _beyond(rotvec_from_matrix(multiply(matrix_from_quaternion(shown_q), back)), AT_ONCE_RAD)


@compiled
def _follow_position(known: F64, dt: float, p: F64) -> None:
    v = known[_VELOCITY, :3]
    innovation = p - (known[_POSITION, :3] + v * dt)
    speed = _length(v) + _surprise(known[_USUAL], 0, _length(innovation), _length(v), dt, NOISE_M)
    taken = _share(POSITION_CUTOFF_HZ + POSITION_SPEED_GAIN * speed, dt)
    known[_POSITION, :3] = p - (1.0 - taken) * innovation
    faster = taken * _share(VELOCITY_CUTOFF_HZ + VELOCITY_SPEED_GAIN * speed, dt) / dt * innovation
    known[_VELOCITY, :3] = v + faster
    known[_ACCELERATION, :3] = _at_most(faster / dt, MOST_ACCELERATION)


@compiled
def _follow_rotation(known: F64, dt: float, q: F64) -> None:
    w = known[_SPIN, :3]
    predicted = multiply(matrix_from_rotvec(w * dt), matrix_from_quaternion(known[_QUATERNION]))
    turn = rotvec_from_matrix(multiply(matrix_from_quaternion(q), predicted.T))
    spin = _length(w) + _surprise(known[_USUAL], 1, _length(turn), _length(w), dt, NOISE_RAD)
    taken = _share(ROTATION_CUTOFF_HZ + ROTATION_SPEED_GAIN * spin, dt)
    known[_QUATERNION] = quaternion_from_matrix(multiply(matrix_from_rotvec(taken * turn), predicted))
    w = w + taken * _share(SPIN_CUTOFF_HZ + SPIN_SPEED_GAIN * spin, dt) / dt * turn
    known[_SPIN, :3] = _at_most(w, MOST_SPIN)


@compiled
def _surprise(usual: F64, which: int, difference: float, speed: float, dt: float, noise: float) -> float:
    """The speed that `difference` from the prediction counts as. usual: of a still receiver, learnt here where `speed` stays
    within it; noise: what it is before."""
    learnt = usual[which] if usual[which] > 0.0 else noise
    if speed * dt < learnt:
        square = learnt * learnt
        learnt = math.sqrt(square + NOISE_SHARE * (min(difference * difference, 4.0 * square) - square))
    usual[which] = min(max(learnt, LEAST_NOISE * noise), MOST_NOISE * noise)
    return SURPRISE_GAIN * max(0.0, difference - BEYOND_NOISE * usual[which]) / dt


@compiled
def _share(cutoff_hz: float, dt: float) -> float:
    r = 2.0 * math.pi * cutoff_hz * dt
    return r / (r + 1.0)


@compiled
def _conjugate(q: F64) -> F64:
    return np.array([-q[0], -q[1], -q[2], q[3]])


@compiled
def _length(v: F64) -> float:
    return math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


@compiled
def _at_most(vector: F64, length: float) -> F64:
    """The vector, no longer than `length`."""
    return vector * min(1.0, length / max(_length(vector), 1e-9))


@compiled
def _beyond(vector: F64, length: float) -> F64:
    """The vector, shortened by `length`."""
    return vector * max(0.0, 1.0 - length / max(_length(vector), 1e-9))
