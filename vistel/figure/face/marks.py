"""The 13 marks of a face (Singh §6.3), where they rest, and how ARKit's expressions move them.

Frame: that of the head joint: +X the person's left, +Y up, metres, for a head of a person 1.75 m tall. A mark is where
a muscle of expression acts, so that marks alone can drive the face.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from vistel.arrays import F64

MARKS = (
    "left_inner_brow", "right_inner_brow", "left_outer_brow", "right_outer_brow",
    "left_cheek", "right_cheek", "left_nose_wing", "right_nose_wing",
    "left_mouth_corner", "right_mouth_corner", "upper_lip", "lower_lip", "chin",
)  # fmt: skip
MARK_COUNT = len(MARKS)
MARK_INDEX = {name: i for i, name in enumerate(MARKS)}

_REST_MM = (
    (14, 92), (-14, 92), (44, 90), (-44, 90), (38, 42), (-38, 42), (17, 46), (-17, 46),
    (25, 17), (-25, 17), (0, 23), (0, 11), (0, -14),
)  # fmt: skip
REST: F64 = np.array(_REST_MM, np.float64) * 1e-3
"""(13, 2) metres."""

# Millimetres (x, y) by which an expression at its full moves a mark of the left half; the right half is its mirror.
_LEFT_MM: dict[str, dict[str, tuple[float, float]]] = {
    "browDownLeft": {"left_inner_brow": (-3, -6), "left_outer_brow": (-1, -3)},
    "browOuterUpLeft": {"left_outer_brow": (0, 9), "left_inner_brow": (0, 2)},
    "cheekSquintLeft": {"left_cheek": (1, 5)},
    "eyeSquintLeft": {"left_cheek": (0, 2)},
    "noseSneerLeft": {"left_nose_wing": (2, 5), "upper_lip": (0, 1.5)},
    "mouthSmileLeft": {"left_mouth_corner": (9, 8), "left_cheek": (2, 4), "left_nose_wing": (2, 1)},
    "mouthFrownLeft": {"left_mouth_corner": (2, -7), "chin": (0, 1)},
    "mouthDimpleLeft": {"left_mouth_corner": (6, 1)},
    "mouthStretchLeft": {"left_mouth_corner": (8, -4)},
    "mouthPressLeft": {"left_mouth_corner": (1, 2), "upper_lip": (0, -1), "lower_lip": (0, 1)},
    "mouthLowerDownLeft": {"lower_lip": (1, -4)},
    "mouthUpperUpLeft": {"upper_lip": (0.5, 3.5), "left_nose_wing": (1, 2)},
}
_WHOLE_MM: dict[str, dict[str, tuple[float, float]]] = {
    "browInnerUp": {"left_inner_brow": (0, 9), "right_inner_brow": (0, 9)},
    "cheekPuff": {"left_cheek": (6, 0), "right_cheek": (-6, 0)},
    "jawOpen": {"lower_lip": (0, -28), "chin": (0, -34), "left_mouth_corner": (-3, -11), "right_mouth_corner": (3, -11)},
    "jawLeft": {"lower_lip": (9, 0), "chin": (11, 0)},
    "jawRight": {"lower_lip": (-9, 0), "chin": (-11, 0)},
    "mouthClose": {"lower_lip": (0, 20), "upper_lip": (0, -3)},
    "mouthFunnel": {"left_mouth_corner": (-7, 0), "right_mouth_corner": (7, 0), "upper_lip": (0, 4), "lower_lip": (0, -4)},
    "mouthPucker": {"left_mouth_corner": (-12, 0), "right_mouth_corner": (12, 0)},
    "mouthLeft": dict.fromkeys(("left_mouth_corner", "right_mouth_corner", "upper_lip", "lower_lip"), (9, 0)),
    "mouthRight": dict.fromkeys(("left_mouth_corner", "right_mouth_corner", "upper_lip", "lower_lip"), (-9, 0)),
    "mouthRollUpper": {"upper_lip": (0, -3)},
    "mouthRollLower": {"lower_lip": (0, 3)},
    "mouthShrugUpper": {"upper_lip": (0, 4)},
    "mouthShrugLower": {"lower_lip": (0, 5), "chin": (0, 4)},
}
_YAW = math.radians(35.0)
_PITCH = math.radians(28.0)


def _other(name: str) -> str:
    if name.startswith(("left_", "right_")):
        side, rest = name.split("_", 1)
        return ("right_" if side == "left" else "left_") + rest
    return name


def _moves() -> dict[str, F64]:
    table = dict(_WHOLE_MM)
    for name, moved in _LEFT_MM.items():
        table[name] = moved
        table[name.removesuffix("Left") + "Right"] = {_other(m): (-x, y) for m, (x, y) in moved.items()}
    out: dict[str, F64] = {}
    for name, moved in table.items():
        move = np.zeros((MARK_COUNT, 2))
        for mark, by in moved.items():
            move[MARK_INDEX[mark]] = by
        out[name] = move * 1e-3
    return out


MOVES = _moves()
"""Of each ARKit expression: (13, 2) metres at 1."""


class Expressions:
    """Turns the values of named channels, in a fixed order, into marks and gaze."""

    def __init__(self, channels: Sequence[str]) -> None:
        """channels: ARKit's names in the order in which values will come; those that move no mark may be among them."""
        self._index: Mapping[str, int] = {name: i for i, name in enumerate(channels)}
        self._moves = np.zeros((len(channels), MARK_COUNT, 2))
        for name, move in MOVES.items():
            self._moves[self._index[name]] = move

    def marks(self, values: Sequence[float]) -> F64:
        """(13, 2) metres, for expressions 0..1; what lies outside counts as its end."""
        return REST + np.tensordot(np.clip(np.array(values), 0.0, 1.0), self._moves, 1)

    def gaze(self, values: Sequence[float]) -> F64:
        """(2,) yaw (left positive) and pitch (up positive) of both eyes, relative to the head [rad]."""

        def at(name: str) -> float:
            return min(1.0, max(0.0, values[self._index[name]]))

        yaw = at("eyeLookOutLeft") - at("eyeLookInLeft") + at("eyeLookInRight") - at("eyeLookOutRight")
        up = at("eyeLookUpLeft") + at("eyeLookUpRight") - at("eyeLookDownLeft") - at("eyeLookDownRight")
        return np.array((0.5 * yaw * _YAW, 0.5 * up * _PITCH))
