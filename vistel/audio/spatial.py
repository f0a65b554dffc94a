"""Where a voice comes from: for each ear how loud, how late, how much of the treble the head takes away.

A spherical head: the path round it (Woodworth), a shadow that grows towards the far side, loudness with distance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64

HEAD_RADIUS = 0.0875
SOUND_SPEED = 343.0
_REFERENCE_M = 1.2
"""At this distance a voice is as loud as its microphone took it: across a table."""
_NEAREST_M = 0.3
"""A nearer voice is no louder."""
_FARTHEST_M = 12.0
"""A farther voice is no quieter."""
_SHADOW = 0.75
_FAR_LOSS = 0.45
MOST_LATE_S = HEAD_RADIUS / SOUND_SPEED * (1.0 + math.pi / 2.0)
"""The interaural delay of a voice right at one side: 0.66 ms."""


@dataclass(frozen=True)
class Ears:
    """For left and right ear: gain, delay [s] of the farther one against the nearer, share of treble lost (0 to 1)."""

    gain: tuple[float, float] = (1.0, 1.0)
    late_s: tuple[float, float] = (0.0, 0.0)
    shade: tuple[float, float] = (0.0, 0.0)


CENTRE = Ears()
"""A voice without a place."""


@dataclass(frozen=True, eq=False)
class Head:
    """Where somebody's head is: position (3,) [m], rotation (3, 3) head to room; +Z is ahead, +X to the left, +Y up."""

    position: F64
    rotation: F64


@dataclass(frozen=True)
class Place:
    """Where a talker is for a listener's head: to the left of straight ahead and above the ears' level [rad], how loud,
    how much they face away (0 to 1)."""

    azimuth: float
    elevation: float
    loud: float = 1.0
    away: float = 0.0


def place_of(listener: Head, talker: Head) -> Place | None:
    """Where a listener hears a talker from; None: both are in one place. Somebody who turns away is quieter."""
    to = talker.position - listener.position
    distance = float(np.linalg.norm(to))
    if distance < 1e-6:
        return None
    left, up, ahead = (listener.rotation.T @ to / distance).tolist()
    loud = _REFERENCE_M / min(_FARTHEST_M, max(_NEAREST_M, distance))
    away = 0.5 * (1.0 - float(talker.rotation[:, 2] @ -to) / distance)
    return Place(math.atan2(left, ahead), math.asin(max(-1.0, min(1.0, up))), loud * (1.0 - 0.4 * away), away)


def heard_from(listener: Head, talker: Head) -> Ears:
    """How a listener hears a talker, panned."""
    return panned(place_of(listener, talker))


def panned(place: Place | None) -> Ears:
    """What is done for a place without transfer functions: loudness, delay and dullness for each ear. Somebody who turns
    away sounds duller."""
    if place is None:
        return CENTRE
    left, loud, away = math.cos(place.elevation) * math.sin(place.azimuth), place.loud, place.away
    side = math.asin(min(1.0, abs(left)))
    late = HEAD_RADIUS / SOUND_SPEED * (side + abs(left))
    far = abs(left)
    near_ear = (loud * (1.0 + 0.15 * far), 0.0, 0.35 * away)
    far_ear = (loud * (1.0 - _FAR_LOSS * far), late, min(0.95, _SHADOW * far + 0.35 * away))
    at_left, at_right = (near_ear, far_ear) if left >= 0.0 else (far_ear, near_ear)
    return Ears((at_left[0], at_right[0]), (at_left[1], at_right[1]), (at_left[2], at_right[2]))
