"""What of its wrinkles a figure shows at an instant: what drives them, and what cloth remembers."""

from collections.abc import Mapping

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import JointPose
from vistel.wrinkle.shown import ShownWrinkles
from vistel.wrinkle.worn import Memory

LONGEST_STEP_S = 5.0
"""Between two pictures: who was out of sight for longer comes back as if it had been so long."""


class WrinkleState:
    """The wrinkles of one figure from picture to picture."""

    def __init__(self, whole: ShownWrinkles) -> None:
        self.whole = whole
        self._memory = Memory()
        self._kept = np.zeros(len(whole.names))
        self._at_ns: int | None = None

    def weights(self, joints: JointPose, actions: Mapping[str, float], at_ns: int | None) -> F64:
        """(S,) of each set; actions: intensities of action units. at_ns: when; None: nothing is remembered."""
        driven = self.whole.drives.weights(joints, actions)
        if at_ns is None:
            return driven
        seconds = 0.0 if self._at_ns is None else min(LONGEST_STEP_S, max(0.0, (at_ns - self._at_ns) * 1e-9))
        self._at_ns = at_ns
        self._kept, shown = self._memory.step(self._kept, driven, self.whole.memory, seconds)
        return shown
