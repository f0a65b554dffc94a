"""A hand: palm with its pads, five separate fingers with joints, pads and nails. Reference person, metres."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vistel.arrays import F64
from vistel.figure.people.field import Sculpture
from vistel.figure.people.material import SKIN
from vistel.figure.people.recipe import Recipe
from vistel.figure.skeleton import FINGERS, JOINT_INDEX, Skeleton, finger_joints

# Radii at base, middle, end joint and tip.
_RADII = {
    "thumb": (0.0135, 0.0112, 0.0106, 0.0090),
    "index": (0.0092, 0.0082, 0.0075, 0.0065),
    "middle": (0.0093, 0.0083, 0.0076, 0.0066),
    "ring": (0.0090, 0.0080, 0.0072, 0.0062),
    "little": (0.0082, 0.0071, 0.0064, 0.0056),
}


def add_hand(s: Sculpture, r: Recipe, skeleton: Skeleton, side: str) -> None:
    """The hand of `side` at the joints of `skeleton` (reference height), palm down."""
    sign = 1.0 if side == "left" else -1.0
    slim = 1.0 - 0.07 * r.female
    wrist = skeleton.rest[JOINT_INDEX[f"{side}_hand"]]

    def at(x: float, y: float, z: float) -> F64:
        return wrist + np.array((sign * x, y, z))

    # Back of the hand: a slab under the four metacarpals; pads of thumb and little finger; web of the thumb.
    for z0, z1, x1, radius in (
        (0.012, 0.025, 0.088, 0.0125),
        (0.004, 0.006, 0.090, 0.0128),
        (-0.004, -0.013, 0.086, 0.0122),
        (-0.011, -0.031, 0.077, 0.0112),
    ):
        s.cone(at(0.002, -0.001, z0), at(x1, 0.000, z1), 0.0175, radius * slim, width=0.020, material=SKIN, weight=0.8)
    s.ellipsoid(at(0.040, -0.011, 0.018), (0.034, 0.0135, 0.020), width=0.015, material=SKIN)
    s.ellipsoid(at(0.045, -0.010, -0.020), (0.038, 0.0125, 0.014), width=0.015, material=SKIN)
    s.cone(at(0.030, -0.008, 0.020), at(0.066, -0.009, 0.034), 0.0120, 0.0075, width=0.014, material=SKIN)
    # Webs: the fingers part some way beyond the knuckles.
    knuckles = [skeleton.rest[JOINT_INDEX[f"{side}_{finger}_proximal"]] for finger in FINGERS[1:]]
    for one, two in pairwise(knuckles):
        s.ellipsoid(0.5 * (one + two) + (sign * 0.003, -0.001, 0.0), (0.0130, 0.0078, 0.0060), width=0.006, material=SKIN)
    first_group = 4 if side == "left" else 9
    for i, finger in enumerate(FINGERS):
        joints = finger_joints(side)[3 * i : 3 * i + 3]
        points = [skeleton.rest[JOINT_INDEX[j]] for j in joints]
        tip = skeleton.tip[JOINT_INDEX[joints[2]]]
        along = tip / np.linalg.norm(tip)
        radii = [q * slim for q in _RADII[finger]]
        points.append(points[2] + tip - 0.85 * radii[3] * along)
        _finger(s, points, radii, first_group + i, thumb=finger == "thumb")


def _finger(s: Sculpture, points: list[F64], radii: list[float], group: int, *, thumb: bool) -> None:
    width = 0.007
    for k in range(3):
        w = 0.016 if thumb and k == 0 else width
        s.cone(points[k], points[k + 1], radii[k], radii[k + 1], width=w, material=SKIN, group=group)
    along = (points[3] - points[2]) / np.linalg.norm(points[3] - points[2])
    across = np.cross(along, (0.0, 1.0, 0.0))
    up = np.cross(across, along)
    for k in (1, 2):  # the joints are a little thicker on top than the bones between them
        s.ellipsoid(
            points[k] + 0.0010 * up, (radii[k], radii[k], radii[k] * 0.86), width=0.006, material=SKIN, group=group, weight=0.5
        )
    mid = 0.5 * (points[0] + points[1]) if not thumb else 0.5 * (points[1] + points[2])
    k = 0 if not thumb else 1
    s.ellipsoid(
        mid - 0.0022 * up,
        (0.5 * float(np.linalg.norm(points[k + 1] - points[k])), radii[k + 1] * 0.95, radii[k + 1] * 0.85),
        width=0.006,
        material=SKIN,
        group=group,
        weight=0.5,
    )
