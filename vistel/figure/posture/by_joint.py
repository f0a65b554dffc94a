"""Postures from angles of single joints, in degrees, as a person writes them."""

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vistel.figure.posture.posture import ELBOW, NECK, SHOULDER, WRIST, Posture
from vistel.figure.skeleton import FINGERS, JOINTS

Degrees = float | Sequence[float]
"""One angle of a hinge, or the angles of a joint with several."""

_LONG_FINGERS = FINGERS[1:]


def _places() -> tuple[dict[str, slice], dict[str, tuple[int, slice]]]:
    """Where a joint's angles are in `Posture.dofs`, and in which row and columns of `Posture.hands`."""
    dofs = {"head": NECK}
    hands: dict[str, tuple[int, slice]] = {}
    for row, side in enumerate(("left", "right")):
        dofs[f"{side}_upper_arm"] = SHOULDER[side]
        dofs[f"{side}_lower_arm"] = slice(ELBOW[side], ELBOW[side] + 1)
        dofs[f"{side}_hand"] = WRIST[side]
        hands[f"{side}_thumb_metacarpal"] = row, slice(0, 2)
        hands[f"{side}_thumb_proximal"] = row, slice(2, 3)
        hands[f"{side}_thumb_distal"] = row, slice(3, 4)
        for k, finger in enumerate(_LONG_FINGERS, 1):
            hands[f"{side}_{finger}_proximal"] = row, slice(4 * k, 4 * k + 2)
            hands[f"{side}_{finger}_intermediate"] = row, slice(4 * k + 2, 4 * k + 3)
            hands[f"{side}_{finger}_distal"] = row, slice(4 * k + 3, 4 * k + 4)
    return dofs, hands


_PLACES = _places()
_KNEES = ("left_lower_leg", "right_lower_leg")


def with_joints(posture: Posture, degrees: Mapping[str, Degrees]) -> Posture:
    """`posture` with these joints at these angles [degrees].

    An elbow, a knee and the outer joints of fingers take one angle, their flexion. The base of a finger takes flexion and
    abduction, that of the thumb roll and abduction. All others take a rotation vector (3,) in the axes of the T-pose: the head
    and the upper arms relative to the chest, a hand relative to the forearm, the rest relative to their parent joint.
    Raises ValueError, in one line, for a name that is no joint and for another number of angles.
    """
    dofs, hands, joints = posture.dofs.copy(), posture.hands.copy(), dict(posture.joints)
    in_dofs, in_hands = _PLACES
    for name, given in degrees.items():
        if name not in JOINTS:
            raise ValueError(_unknown(name))
        angles = np.radians(np.atleast_1d(np.asarray(given, np.float64)))
        if name in in_dofs:
            target = dofs[in_dofs[name]]
        elif name in in_hands:
            row, columns = in_hands[name]
            target = hands[row, columns]
        else:
            target = np.zeros(1 if name in _KNEES else 3)
            joints[name] = np.zeros(3)
        if angles.shape != target.shape:
            raise ValueError(f"{name}: expected {_count(len(target))} in degrees, got {given!r}")
        if not all(math.isfinite(a) for a in angles):
            raise ValueError(f"{name}: expected finite angles, got {given!r}")
        target[:] = angles
        if name in joints:
            joints[name] = np.array((angles[0], 0.0, 0.0)) if name in _KNEES else angles
    return replace(posture, dofs=dofs, hands=hands, joints=joints)


def _count(n: int) -> str:
    return "one angle" if n == 1 else f"{n} angles"


def _unknown(name: str) -> str:
    near = difflib.get_close_matches(name, JOINTS, 1, 0.5)
    return f"no joint {name!r}" + (f"; did you mean {near[0]!r}?" if near else f"; joints are {', '.join(JOINTS[:6])}, ...")
