"""From the compact motion on the wire to postures."""

from __future__ import annotations

import numpy as np

from vistel.figure.posture import Posture, Stance
from vistel.v1 import motion_pb2


class MotionReader:
    """Decodes one participant's stream; frames whose key frame was lost are left out."""

    def __init__(self) -> None:

        self._decoder = MotionDecoder()

    def read(self, message: motion_pb2.Motion) -> Posture | None:
        decoded = self._decoder.decode(message)
        if decoded is None:
            return None
        return Posture(
            np.array(decoded.body, np.float64), np.array(decoded.hands, np.float64).reshape(2, 20),
            Stance(np.array(decoded.stance[:3], np.float64), float(decoded.stance[3])), np.array(decoded.gaze, np.float64),
        )
