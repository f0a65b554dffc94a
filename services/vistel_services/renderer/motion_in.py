"""From the compact motion on the wire to postures."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from vistel.figure.posture import Posture, Stance, interpolate
from vistel.v1 import motion_pb2
from vistel.wire.motion import MotionDecoder, MotionFrame


class Heard:
    """A posture that is worked out when it is needed: most of what arrives lies between two pictures."""

    def __init__(self, frame: MotionFrame) -> None:
        self._frame = frame

    @cached_property
    def posture(self) -> Posture:
        """The posture."""
        sample = self._frame.sample()
        gaze = np.zeros(2) if sample.gaze is None else sample.gaze
        return Posture(sample.body, sample.hands, Stance(sample.stance[:3], float(sample.stance[3])), gaze)


class Between:
    """The posture between two others."""

    def __init__(self, a: Heard | Between, b: Heard | Between, u: float) -> None:
        self.posture = interpolate(a.posture, b.posture, u)


class MotionReader:
    """Decodes one participant's stream."""

    def __init__(self) -> None:
        self._decoder = MotionDecoder()

    def read(self, message: motion_pb2.Motion) -> Heard | None:
        """The posture, or None when the key frame it refers to was lost or the message is broken."""
        frame = self._decoder.open(message)
        return None if frame is None else Heard(frame)
