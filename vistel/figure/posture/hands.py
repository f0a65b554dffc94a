"""Hand postures by definition: orientations and named finger postures.

Finger angles follow `Posture.hands`: thumb roll, abduction, two flexions; then base flexion, abduction, middle and
end flexion for index, middle, ring and little finger [rad].
"""

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import HAND_DOF_COUNT


def hand_rotation(side: float, fingers: F64, palm: F64) -> F64:
    """(3, 3) of a hand whose flat fingers point along `fingers` and whose palm faces `palm`; side +1 left, -1 right.

    `palm` is made perpendicular to `fingers`.
    """
    f = fingers / np.linalg.norm(fingers)
    p = palm - (palm @ f) * f
    p /= np.linalg.norm(p)
    x = side * f
    return np.column_stack((x, -p, np.cross(x, -p)))


def finger_posture(
    thumb: tuple[float, float, float, float], bend: tuple[float, float, float], spread: float = 0.0, fan: float = 0.0
) -> F64:
    """(20,) angles in degrees turned to radians: the thumb's four, the same three flexions for all fingers.

    spread: abduction of index (and, the other way, of ring and little); fan: extra flexion from index to little.
    """
    out = np.empty(HAND_DOF_COUNT)
    out[:4] = thumb
    for f in range(4):
        more = fan * f
        out[4 + 4 * f : 8 + 4 * f] = (bend[0] + more, spread * (1.0, 0.2, -0.6, -1.3)[f], bend[1] + more, bend[2])
    return np.radians(out)


RELAXED = finger_posture((15, 5, 12, 15), (16, 22, 12), 2.0, 4.0)
FLAT = finger_posture((5, 10, 5, 5), (2, 3, 2), 1.0)
PRESSED = finger_posture((-12, 25, 0, 0), (0, 2, 1), 2.0)
"""Flat, the thumb out of the palm's way."""
OPEN = finger_posture((-12, 25, 0, 0), (12, 16, 8), 5.0, 2.0)
"""Ready to take something."""
FIST = finger_posture((78, 60, 75, 0), (84, 98, 55))
"""The thumb over the fingers, which lie side by side."""
FIST[5::4] = np.radians((4.0, -4.0, 4.0, 4.0))
POINT = finger_posture((40, 20, 35, 30), (55, 65, 40), 0.0)
POINT[4:8] = np.radians((6.0, 2.0, 6.0, 4.0))
