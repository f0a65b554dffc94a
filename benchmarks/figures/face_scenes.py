"""A face that does what makes marks hard to tell apart: expressions at random, crossings, a hand before it, light, slips."""

import math
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.figure.face.marks import MARK_INDEX, Expressions
from vistel.geometry.smoothstep import ease
from vistel.protocol.live_link_face import CHANNELS
from vistel_sim.pictures.face import FacePicture, View
from vistel_sim.pictures.noise import light_at

RATE_HZ = 60.0
CROSSINGS = (
    ("lower_lip", "upper_lip"),
    ("left_mouth_corner", "left_nose_wing"),
    ("left_inner_brow", "right_inner_brow"),
    ("right_mouth_corner", "upper_lip"),
    ("chin", "lower_lip"),
    ("right_cheek", "right_nose_wing"),
)
"""Who passes over whom."""
_EVERY_S, _PASS_S = 3.0, 1.2
_KNOT_S = 0.35


@dataclass(frozen=True)
class Moment:
    """marks: (13, 2) [m]. crossing: whether one mark passes over another just now."""

    marks: F64
    view: View
    crossing: bool


class HardFace:
    """What happens at any time [s]; the same for the same seed."""

    def __init__(self, seed: int, seconds: float) -> None:
        rng = np.random.default_rng(seed)
        knots = int(seconds / _KNOT_S) + 4
        # A few expressions at a time, each up to its full.
        self._values = rng.uniform(0.0, 1.0, (knots, len(CHANNELS))) * (rng.random((knots, len(CHANNELS))) < 0.12)
        self._rng_path = rng.normal(0.0, 0.0006, (int(seconds / _EVERY_S) + 2, 2))
        self._covers = rng.uniform(0.0, 1.0, (int(seconds / _EVERY_S) + 2, 4))
        self._expressions = Expressions(CHANNELS)

    def at(self, t_s: float) -> Moment:
        """What the camera looks at."""
        k, f = divmod(t_s / _KNOT_S, 1.0)
        s = ease(f)
        values = (1.0 - s) * self._values[int(k)] + s * self._values[int(k) + 1]
        marks = self._expressions.marks(values.tolist())
        number, phase = divmod(t_s, _EVERY_S)
        crossing = self._cross(marks, int(number), phase)
        slip = (0.004 * math.sin(0.23 * t_s), 0.003 * math.sin(0.31 * t_s), 0.03 * math.sin(0.19 * t_s))
        view = View(slip, light_at(t_s, 1.5 * (1.0 + math.sin(0.5 * t_s))), self._hand(int(number), phase))
        return Moment(marks, view, crossing)

    def _cross(self, marks: F64, number: int, phase: float) -> bool:
        """One mark goes over to the other side of another one and comes back."""
        if phase > _PASS_S:
            return False
        who, over = (MARK_INDEX[name] for name in CROSSINGS[number % len(CROSSINGS)])
        way = 0.5 - 0.5 * math.cos(2.0 * math.pi * phase / _PASS_S)
        beyond = 1.3 * (marks[over] - marks[who]) + self._rng_path[number]
        marks[who] = marks[who] + way * beyond
        return True

    def _hand(self, number: int, phase: float) -> tuple[tuple[float, float, float], ...]:
        """In every third pause a hand passes."""
        if number % 3 or not 1.4 < phase < 2.6:
            return ()
        a, b, c, r = self._covers[number]
        s = (phase - 1.4) / 1.2
        return ((700.0 * s - 30.0, 80.0 + 320.0 * (a + (b - a) * s), 30.0 + 40.0 * r * (0.5 + 0.5 * c)),)


def hard_face(seed: int, frames: int) -> tuple[FacePicture, HardFace]:
    """The one who draws, and what happens."""
    return FacePicture(seed), HardFace(seed, frames / RATE_HZ)
