"""Who may soon move something: their motion counts at full rate."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vistel.arrays import F64
from vistel.figure.skeleton import JOINT_INDEX
from vistel.space.people import Posed

REACH = 0.4
"""How near a wrist is to the middle of a loose thing before the hand may move it soon [m]: a quick hand needs a quarter of a second
for what lies between."""
_HANDS = [JOINT_INDEX["left_hand"], JOINT_INDEX["right_hand"]]


def reaching(posed: Mapping[str, Posed], things: F64) -> frozenset[str]:
    """The people whose hands are near something. things: (N, 3) middles of the loose ones [m]."""
    if not posed or not len(things):
        return frozenset()
    hands = np.array([p.joints.position[_HANDS] for p in posed.values()])
    near = (((hands[:, :, None] - things) ** 2).sum(axis=3) < REACH**2).any(axis=(1, 2))
    return frozenset(name for name, one in zip(posed, near.tolist(), strict=True) if one)
