"""Where the feet stand: fixed while a person sways, leans and sits; following when they walk off or turn round."""

import math

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import Stance
from vistel.figure.posture.trunk import hips_below
from vistel.figure.skeleton import JOINT_INDEX, SPINE_SEGMENTS, Skeleton
from vistel.geometry.rotation import rotation_y

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


class StanceFollower:
    """Keeps the feet fixed with a dead band; smooth when they move."""

    def __init__(self, skeleton: Skeleton, heading: float | None) -> None:
        self._skeleton = skeleton
        rest = skeleton.rest
        self._spine_base = np.ascontiguousarray(skeleton.offsets[JOINT_INDEX["spine_1"]])
        self._segment = skeleton.spine / SPINE_SEGMENTS
        self._ankle = rest[JOINT_INDEX["left_foot"]]
        self._hip = rest[JOINT_INDEX["left_upper_leg"]]
        self._hint = heading
        self._position: F64 | None = None
        self._heading = heading or 0.0
        self._walking, self._turning = 0.0, 0.0
        self._wanted, self._pace = np.zeros(3), np.zeros(3)
        self.hips: F64 = rest[0].copy()
        """(3,) where the hips were at the last call, room frame."""

    @property
    def stance(self) -> Stance | None:
        """None before the first `follow`."""
        return None if self._position is None else Stance(self._position, self._heading)

    def follow(self, dt: float, chest: F64, top: F64) -> Stance:
        """The stance `dt` seconds later, for a chest (3, 3) whose spine ends at `top` (3,), room frame."""
        yaw = math.atan2(chest[0, 2], chest[2, 2])
        first = self._position is None
        if first:
            near = self._hint is not None and abs(_wrap(yaw - self._hint)) < math.radians(60.0)
            self._heading = self._hint if near and self._hint is not None else yaw
        facing = rotation_y(self._heading)
        hips = hips_below(np.ascontiguousarray(facing.T @ chest), facing.T @ top, self._spine_base, self._segment)
        self.hips = facing @ hips
        wanted = self.hips + facing @ np.array([0.0, 0.0, self._ankles_ahead(hips[1])])
        wanted[1] = 0.0
        if first or self._position is None:
            self._position = self._wanted = wanted
            return Stance(wanted, self._heading)
        sitting = min(1.0, max(0.0, (self._full() - hips[1]) / self._skeleton.upper_leg))
        slack = STANDING_SLACK + sitting * (SITTING_SLACK - STANDING_SLACK)
        error = wanted - self._position
        if dt > 0.0:
            share = 1.0 - math.exp(-dt / PACE_S)
            self._pace = self._pace + share * ((wanted - self._wanted) / dt - self._pace)
        self._wanted = wanted
        self._walking = _engage(self._walking, float(np.linalg.norm(error)) / slack, dt)
        step = self._pace * dt + error * (1.0 - math.exp(-dt / FOLLOW_S))
        self._position = self._position + self._walking * step
        turn = _wrap(yaw - self._heading)
        self._turning = _engage(max(self._turning, 0.3 * self._walking), abs(turn) / TURN_SLACK, dt)
        self._heading = _wrap(self._heading + turn * self._turning * (1.0 - math.exp(-dt / FOLLOW_S)))
        return Stance(self._position, self._heading)

    def _full(self) -> float:
        """Height of the hips of who stands upright [m]."""
        return float(self._skeleton.rest[0, 1])

    def _ankles_ahead(self, hips_height: float) -> float:
        """How far the ankles' stance is ahead of the hips: nothing for who stands, a thigh for who sits [m]."""
        thigh = self._skeleton.upper_leg
        u = min(1.0, max(0.0, (self._full() - hips_height) / thigh))
        return thigh * u * u * (3.0 - 2.0 * u) - float(self._ankle[2]) + float(self._hip[2])


def _engage(level: float, error: float, dt: float) -> float:
    """How much following is going on (0 to 1): rises when `error` passes 1, falls when it is below SETTLED."""
    if error > 1.0:
        return min(1.0, level + dt / 0.15)
    if error < SETTLED:
        return max(0.0, level - dt / 0.3)
    return level


def _wrap(angle: float) -> float:
    return (angle + math.pi) % (2.0 * math.pi) - math.pi
