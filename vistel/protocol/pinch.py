"""Pinch gloves: contacts at five fingertips, and the hand that makes them.

A contact closes where fingertips touch each other. The fingers are not measured otherwise, so the hand is a typical one, with
the touching fingers in a pinch and the others at rest. Angles: see `vistel.protocol.glove_calibration`.
"""

import math
from collections.abc import Collection

CONTACTS = 5
"""Thumb first."""

_THUMB = {True: (55.0, 20.0, 25.0, 30.0), False: (15.0, 25.0, 10.0, 15.0)}
_FINGER = {True: (45.0, 0.0, 50.0, 30.0), False: (20.0, 0.0, 25.0, 15.0)}
"""Angles of a finger in a pinch, and at rest [degrees]."""


def angles(touching: Collection[int]) -> list[float]:
    """(20,) radians of a hand whose fingers `touching` (thumb 0) touch each other."""
    hand = [_THUMB[0 in touching], *(_FINGER[k in touching] for k in range(1, CONTACTS))]
    return [math.radians(a) for finger in hand for a in finger]
