"""From the compact motion on the wire to postures."""

from __future__ import annotations

import numpy as np

from vistel.figure.posture import Posture, Stance
from vistel.v1 import motion_pb2
from vistel.wire.motion import MotionDecoder


class MotionReader:
    """Decodes one participant's stream."""

    def __init__(self) -> None:
        self._decoder = MotionDecoder()

    def read(self, message: motion_pb2.Motion) -> Posture | None:
        """The posture, or None when the key frame it refers to was lost or the message is broken."""
        sample = self._decoder.decode(message)
        if sample is None:
            return None
        gaze = np.zeros(2) if sample.gaze is None else sample.gaze
        return Posture(sample.body, sample.hands, Stance(sample.stance[:3], float(sample.stance[3])), gaze)
