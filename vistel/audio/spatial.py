"""Interaural cues of a voice: for each ear gain, delay, and the loss of treble in the head's shadow.

A spherical head: the path round it (Woodworth), a shadow that grows towards the far side, gain by distance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64

HEAD_RADIUS = 0.0875
SOUND_SPEED = 343.0
_REFERENCE_M = 1.2
"""At this distance, across a table, the gain is 1."""
_NEAREST_M = 0.3
"""A nearer voice is no louder."""
_FARTHEST_M = 12.0
"""A farther voice is no quieter."""
_SHADOW = 0.75
_FAR_LOSS = 0.45
LONGEST_ITD_S = HEAD_RADIUS / SOUND_SPEED * (1.0 + math.pi / 2.0)
"""The interaural time difference of a voice at one side: 0.66 ms."""


@dataclass(frozen=True)
class InterauralCues:
    """For left and right ear: gain, delay [s] relative to the nearer one, share of treble lost (0 to 1)."""

    gain: tuple[float, float] = (1.0, 1.0)
    delay_s: tuple[float, float] = (0.0, 0.0)
    shadow: tuple[float, float] = (0.0, 0.0)


CENTRE = InterauralCues()
"""Of a voice without a direction."""


@dataclass(frozen=True, eq=False)
class Head:
    """Pose of a head in the room: position (3,) [m], rotation (3, 3) head to room; +Z is ahead, +X to the left, +Y up."""

    position: F64
    rotation: F64


@dataclass(frozen=True)
class SourceDirection:
    """A talker relative to a listener's head. azimuth: to the left of straight ahead [rad]; elevation: above the ears [rad];
    gain: by distance; facing_away: 0 to 1."""

    azimuth: float
    elevation: float
    gain: float = 1.0
    facing_away: float = 0.0


def source_direction(listener: Head, talker: Head) -> SourceDirection | None:
    """Where a listener hears a talker from; None if both are at one point. Who faces away is quieter."""
    to = talker.position - listener.position
    distance = float(np.linalg.norm(to))
    if distance < 1e-6:
        return None
    left, up, ahead = (listener.rotation.T @ to / distance).tolist()
    gain = _REFERENCE_M / min(_FARTHEST_M, max(_NEAREST_M, distance))
    away = 0.5 * (1.0 - float(talker.rotation[:, 2] @ -to) / distance)
    return SourceDirection(math.atan2(left, ahead), math.asin(max(-1.0, min(1.0, up))), gain * (1.0 - 0.4 * away), away)


def interaural_cues(direction: SourceDirection | None) -> InterauralCues:
    """For panning, without transfer functions. Who faces away sounds duller."""
    if direction is None:
        return CENTRE
    left, gain, away = math.cos(direction.elevation) * math.sin(direction.azimuth), direction.gain, direction.facing_away
    side = math.asin(min(1.0, abs(left)))
    late = HEAD_RADIUS / SOUND_SPEED * (side + abs(left))
    far = abs(left)
    near_ear = (gain * (1.0 + 0.15 * far), 0.0, 0.35 * away)
    far_ear = (gain * (1.0 - _FAR_LOSS * far), late, min(0.95, _SHADOW * far + 0.35 * away))
    at_left, at_right = (near_ear, far_ear) if left >= 0.0 else (far_ear, near_ear)
    return InterauralCues((at_left[0], at_right[0]), (at_left[1], at_right[1]), (at_left[2], at_right[2]))
