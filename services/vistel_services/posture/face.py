"""One participant's face, as it was last seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vistel.figure.face_marks import MARK_COUNT
from vistel.v1.device_pb2 import FaceFrame
from vistel.wire.motion import StalePart

F64 = NDArray[np.float64]

SILENT_NS = 250_000_000
"""A face not seen for this long keeps its last expression and is flagged."""


class FaceCapture:
    """Takes FaceFrames; gives what goes into a Motion."""

    def __init__(self) -> None:
        self.marks: F64 | None = None
        """(26,) metres, head frame; None before the first."""
        self.gaze: F64 | None = None
        """(2,) yaw and pitch [rad]; None before the first."""
        self.rejected = 0
        self._marks_ns = self._gaze_ns = 0

    def take(self, frame: FaceFrame) -> None:
        """An older frame than the last, or one that is not finite, changes nothing."""
        marks, gaze = np.array(frame.marks, np.float64), np.array(frame.gaze, np.float64)
        if len(marks) not in (0, 2 * MARK_COUNT) or len(gaze) not in (0, 2):
            self.rejected += 1
            return
        if not (np.isfinite(marks).all() and np.isfinite(gaze).all()):
            self.rejected += 1
            return
        t_ns = frame.header.t_ns
        if len(marks) and t_ns > self._marks_ns:
            self.marks, self._marks_ns = marks, t_ns
        if len(gaze) and t_ns > self._gaze_ns:
            self.gaze, self._gaze_ns = gaze, t_ns

    def stale(self, t_ns: int) -> StalePart:
        """Which of them has not been seen of late; nothing of what never was."""
        out = StalePart(0)
        if self.marks is not None and t_ns - self._marks_ns > SILENT_NS:
            out |= StalePart.FACE
        if self.gaze is not None and t_ns - self._gaze_ns > SILENT_NS:
            out |= StalePart.GAZE
        return out
