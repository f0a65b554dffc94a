"""What a seated guest's hands and head do by themselves: gestures of some seconds. Time is an argument.

Frame: the seat's (+X to the person's left, +Y up, +Z where they face; origin on the floor), of a person of REFERENCE_HEIGHT.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.channel import minimum_jerk
from vistel.figure.posture.hands import FLAT, POINT, finger_posture, hand_rotation
from vistel.v1.device_pb2 import PointerFrame

EASE_S = 0.35
"""A gesture comes and goes over this long [s]."""
SECONDS: Mapping[int, float] = {
    PointerFrame.GESTURE_WAVE: 2.6,
    PointerFrame.GESTURE_NOD: 1.3,
    PointerFrame.GESTURE_SHAKE: 1.5,
    PointerFrame.GESTURE_POINT: 2.8,
    PointerFrame.GESTURE_THUMBS_UP: 2.4,
    PointerFrame.GESTURE_CLAP: 2.4,
}
"""How long each takes, coming and going included [s]."""
WAVE_HZ = 2.0
"""To one side and back."""
NOD_HZ = 1.7
"""Down and up."""
SHAKE_HZ = 1.5
"""To one side and back."""
CLAP_HZ = 3.2
"""Claps a second: slow applause."""
FIST = finger_posture((45, -5, 35, 35), (75, 85, 50), 0.0)
"""Fingers closed, the thumb across them."""
THUMB_UP = finger_posture((-25, 45, -5, -10), (80, 90, 55), 0.0)
"""Fingers closed, the thumb away from them."""
_RIGHT = -1.0
_LEFT = 1.0


@dataclass(frozen=True)
class HandAim:
    """Where a hand is to be: its palm (3,) [m], its rotation (3, 3) hand to seat, its fingers (20,) [rad]."""

    palm: F64
    rotation: F64
    fingers: F64


@dataclass(frozen=True)
class Gesturing:
    """A gesture at one moment. share: 0 not begun or over .. 1; head: yaw and pitch (2,) added to where the head looks [rad];
    hands: by side."""

    share: float = 0.0
    head: F64 = field(default_factory=lambda: np.zeros(2))
    hands: Mapping[str, HandAim] = field(default_factory=dict[str, HandAim])


def gesturing(gesture: int, t_s: float, look: F64) -> Gesturing:
    """A gesture `t_s` after it was begun. look: (3,) unit vector where the head looks. Nothing once it is over."""
    length = SECONDS.get(gesture, 0.0)
    if not 0.0 <= t_s < length:
        return Gesturing()
    share = min(minimum_jerk(t_s / EASE_S), minimum_jerk((length - t_s) / EASE_S))
    if gesture == PointerFrame.GESTURE_NOD:
        return Gesturing(share, np.array([0.0, -0.14 * share * (1.0 - math.cos(2.0 * math.pi * NOD_HZ * t_s))]))
    if gesture == PointerFrame.GESTURE_SHAKE:
        return Gesturing(share, np.array([0.30 * share * math.sin(2.0 * math.pi * SHAKE_HZ * t_s), 0.0]))
    return Gesturing(share, hands=_hands(gesture, t_s, look))


def _hands(gesture: int, t_s: float, look: F64) -> dict[str, HandAim]:
    if gesture == PointerFrame.GESTURE_WAVE:
        swing = math.sin(2.0 * math.pi * WAVE_HZ * t_s)
        fingers = np.array([-0.05 + 0.42 * swing, 1.0, 0.05])
        palm = np.array([-0.30 + 0.06 * swing, 1.22, 0.26])
        return {"right": HandAim(palm, hand_rotation(_RIGHT, fingers, np.array([0.1, 0.0, 1.0])), FLAT)}
    if gesture == PointerFrame.GESTURE_POINT:
        palm = np.array([-0.16, 1.02, 0.05]) + 0.52 * look
        return {"right": HandAim(palm, hand_rotation(_RIGHT, look, np.array([1.0, -0.5, 0.0])), POINT)}
    if gesture == PointerFrame.GESTURE_THUMBS_UP:
        ahead = np.array([0.15, 0.45, 1.0])
        return {"right": HandAim(np.array([-0.20, 0.92, 0.36]), hand_rotation(_RIGHT, ahead, np.array([1.0, 0.0, 0.0])), THUMB_UP)}
    apart = -0.012 + 0.10 * (0.5 + 0.5 * math.cos(2.0 * math.pi * CLAP_HZ * t_s))
    out: dict[str, HandAim] = {}
    for name, side in (("left", _LEFT), ("right", _RIGHT)):
        fingers = np.array([-0.25 * side, 0.75, 0.75])
        rotation = hand_rotation(side, fingers, np.array([-side, 0.0, 0.0]))
        out[name] = HandAim(np.array([side * apart, 1.02, 0.36]), rotation, FLAT)
    return out
