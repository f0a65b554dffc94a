"""What the cameras on a simulated participant's helmet see."""

import math
from collections.abc import Callable, Sequence

from vistel.arrays import F64, U8
from vistel.figure.face.marks import Expressions
from vistel.protocol.live_link_face import CHANNELS
from vistel_sim.pictures.eye import EyePicture
from vistel_sim.pictures.face import FacePicture, View
from vistel_sim.pictures.noise import light_at

Channels = Callable[[float], Sequence[float]]
"""t [s] -> 61 values, order of CHANNELS."""

_HAND_EVERY_S = 17.0
"""Time between two passes of a hand in front of the face [s]."""
_HAND_S = 0.8
"""Length of a pass [s]."""


Gaze = Callable[[float], F64]
"""t [s] -> (2,) yaw (left positive) and pitch (up positive) relative to the head [rad]."""

_BLINK = CHANNELS.index("eyeBlinkLeft")


class FaceScene:
    """A face moved by `channels`; the helmet slips a little, and now and then a hand passes."""

    def __init__(self, channels: Channels, seed: int) -> None:
        self.picture_of = FacePicture(seed)
        self._channels = channels
        self._expressions = Expressions(CHANNELS)

    def marks(self, t_s: float) -> F64:
        """(13, 2) metres: the truth."""
        return self._expressions.marks(self._channels(t_s))

    def picture(self, number: int, t_s: float, drifting_s: float) -> U8:
        """See `Scene.picture`. A mount that drifts slips by 3 mm/s, 12 mm at most."""
        slip = (0.0008 * math.sin(0.11 * t_s), 0.0008 * math.sin(0.07 * t_s) - min(0.012, 0.003 * drifting_s), 0.0)
        phase = t_s % _HAND_EVERY_S
        hand = ((-60.0 + 760.0 * phase / _HAND_S, 300.0, 55.0),) if phase < _HAND_S and t_s > _HAND_S else ()
        return self.picture_of.draw(self.marks(t_s), number, View(slip, light_at(t_s, drifting_s), hand))


class EyeScene:
    """An eye moved by `gaze`, which blinks by `channels`; the size of the pupil varies."""

    def __init__(self, gaze: Gaze, channels: Channels, seed: int, *, right: bool = False) -> None:
        self.picture_of = EyePicture(seed, right=right)
        self.gaze = gaze
        self._channels = channels

    def opening(self, t_s: float) -> float:
        """0 closed .. 1: the truth."""
        return 1.0 - min(1.0, max(0.0, self._channels(t_s)[_BLINK]))

    def picture(self, number: int, t_s: float, drifting_s: float) -> U8:
        """See `Scene.picture`. Infrared lamps age: their light fades while it drifts."""
        gain = light_at(t_s, drifting_s)[1]
        return self.picture_of.draw(self.gaze(t_s), self.opening(t_s), number, gain, 1.0 + 0.12 * math.sin(0.4 * t_s))
