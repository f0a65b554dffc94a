"""Where the feet stand: fixed while a person sways, leans and sits; following when they walk off or turn round."""

import math

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import Stance
from vistel.figure.posture.trunk import hips_below
from vistel.figure.skeleton import JOINT_INDEX, SPINE_SEGMENTS, Skeleton
from vistel.geometry.rotation import multiply, rotation_y, turn
from vistel.jit.kernel_jit import compiled, inner

STANDING_SLACK = 0.12
"""How far the hips of somebody who stands may be off their natural place over the feet before the feet follow [m]."""
SITTING_SLACK = 0.30
"""The same, of somebody who sits [m]."""
TURN_SLACK = math.radians(40.0)
"""How far the chest may be turned from where the toes point before they follow."""
SETTLED = 0.15
"""The feet stop following when the error is below this share of the slack."""
FOLLOW_S = 0.25
"""Time constant of following."""
PACE_S = 0.15
"""Time constant at which the speed of walking is estimated, so that the feet do not trail behind."""
# Where numbers of a stance that follows lie in their row, all in the room.
_POSITION = slice(0, 3)
"""Where it is [m]."""
_WANTED = slice(3, 6)
"""Where it should be [m]."""
_PACE = slice(6, 9)
"""How fast that moves [m/s]."""
_HIPS = slice(9, 12)
"""The hips [m]."""
_HEADING = 12
"""Where the toes point [rad]."""
_WALKING = 13
"""How much of walking is going on, 0 to 1."""
_TURNING = 14
"""The same of turning."""


class StanceFollower:
    """Keeps the feet fixed with a dead band; smooth when they move."""

    def __init__(self, skeleton: Skeleton, heading: float | None) -> None:
        rest = skeleton.rest
        ahead = float(rest[JOINT_INDEX["left_upper_leg"], 2] - rest[JOINT_INDEX["left_foot"], 2])
        spine_base = np.ascontiguousarray(skeleton.offsets[JOINT_INDEX["spine_1"]])
        self._legs = spine_base, skeleton.spine / SPINE_SEGMENTS, float(rest[0, 1]), skeleton.upper_leg, ahead
        self._hint = heading
        self._now = np.zeros(15)
        self._now[_HIPS] = rest[0]
        self._begun = False

    @property
    def hips(self) -> F64:
        """(3,) where the hips were at the last call, room frame."""
        return self._now[_HIPS].copy()

    @property
    def stance(self) -> Stance | None:
        """None before the first `follow`."""
        return Stance(self._now[_POSITION].copy(), float(self._now[_HEADING])) if self._begun else None

    def follow(self, dt: float, chest: F64, top: F64) -> Stance:
        """The stance `dt` seconds later, for a chest (3, 3) whose spine ends at `top` (3,), room frame."""
        if not self._begun:
            yaw = math.atan2(chest[0, 2], chest[2, 2])
            near = self._hint is not None and abs(_wrap(yaw - self._hint)) < math.radians(60.0)
            self._now[_HEADING] = self._hint if near else yaw
        _follow(self._now, self._begun, dt, chest, top, *self._legs)
        self._begun = True
        return Stance(self._now[_POSITION].copy(), float(self._now[_HEADING]))


@compiled
def _follow(
    now: F64, begun: bool, dt: float, chest: F64, top: F64, spine_base: F64, segment: float, full: float, thigh: float, ahead: float
) -> None:
    """Writes (15,) `now` anew. full: height of the hips of who stands upright, thigh: length of one, ahead: how far the ankles'
    stance is ahead of the hips of who stands; of who sits it is a thigh more [m]."""
    position, heading = now[_POSITION], now[_HEADING]
    facing = rotation_y(heading)
    back = facing.T
    hips = hips_below(multiply(back, chest), turn(back, top), spine_base, segment)
    sitting = min(1.0, max(0.0, (full - hips[1]) / thigh))
    now[_HIPS] = turn(facing, hips)
    wanted = now[_HIPS] + (thigh * sitting * sitting * (3.0 - 2.0 * sitting) + ahead) * facing[:, 2]
    wanted[1] = 0.0
    if not begun:
        now[_POSITION], now[_WANTED] = wanted, wanted
        return
    slack = STANDING_SLACK + sitting * (SITTING_SLACK - STANDING_SLACK)
    error = wanted - position
    if dt > 0.0:
        share = 1.0 - math.exp(-dt / PACE_S)
        now[_PACE] += share * ((wanted - now[_WANTED]) / dt - now[_PACE])
    now[_WANTED] = wanted
    now[_WALKING] = _engage(now[_WALKING], math.sqrt((error * error).sum()) / slack, dt)
    followed = 1.0 - math.exp(-dt / FOLLOW_S)
    now[_POSITION] += now[_WALKING] * (now[_PACE] * dt + error * followed)
    off = _wrap(math.atan2(chest[0, 2], chest[2, 2]) - heading)
    now[_TURNING] = _engage(max(now[_TURNING], 0.3 * now[_WALKING]), abs(off) / TURN_SLACK, dt)
    now[_HEADING] = _wrap(heading + off * now[_TURNING] * followed)


@inner
def _engage(level: float, error: float, dt: float) -> float:
    """How much following is going on (0 to 1): rises when `error` passes 1, falls when it is below SETTLED."""
    if error > 1.0:
        return min(1.0, level + dt / 0.15)
    if error < SETTLED:
        return max(0.0, level - dt / 0.3)
    return level


@compiled
def _wrap(angle: float) -> float:
    return (angle + math.pi) % (2.0 * math.pi) - math.pi
