"""One participant's face: marks, gaze, lids."""

import numpy as np

from vistel.arrays import F64
from vistel.capture.peaks import PeakHold
from vistel.figure.face.marks import MARK_COUNT
from vistel.v1.device_pb2 import FaceFrame
from vistel.wire.motion import StalePart

SILENT_NS = 250_000_000
"""A face without a frame for this time keeps its expression and is stale."""
MARK_PEAK_M = 0.001
"""A mark that moves out and back by more between two motions is sent at its farthest [m]."""
LID_PEAK = 0.1
"""A lid that opens or closes and returns by more between two motions is sent at its farthest (1: from open to closed)."""


class FaceCapture:
    """From FaceFrames to the face of a Motion."""

    def __init__(self) -> None:
        self.marks: F64 | None = None
        """(26,) metres, head frame; None before the first."""
        self.gaze: F64 | None = None
        """(2,) yaw and pitch [rad]; None before the first."""
        self.lids: F64 | None = None
        """(2,) opening of the left and the right eye, 0 closed .. 1 as at rest; None before the first."""
        self.rejected = 0
        self._marks_peaks, self._lids_peaks = PeakHold(MARK_PEAK_M), PeakHold(LID_PEAK)
        self._marks_ns = self._gaze_ns = self._eye_ns = 0

    def take(self, frame: FaceFrame, *, eye_camera: bool = False) -> None:
        """Take a frame. Ignored are frames that are older than the last or not finite, and a phone's gaze and lids while an
        eye camera sends its own. In a blink, when the gaze is unknown, the last one is kept and is not stale."""
        marks, gaze, lids = (np.array(part, np.float64) for part in (frame.marks, frame.gaze, frame.lids))
        if len(marks) not in (0, 2 * MARK_COUNT) or len(gaze) not in (0, 2) or len(lids) not in (0, 2):
            self.rejected += 1
            return
        if not all(np.isfinite(part).all() for part in (marks, gaze, lids)):
            self.rejected += 1
            return
        t_ns = frame.header.t_ns
        if len(marks) and t_ns > self._marks_ns:
            self.marks, self._marks_ns = marks, t_ns
            self._marks_peaks.add(marks)
        if not (len(gaze) or len(lids)) or t_ns <= self._gaze_ns:
            return
        if eye_camera:
            self._eye_ns = t_ns
        elif self._eye_ns and t_ns - self._eye_ns < SILENT_NS:
            return
        self._gaze_ns = t_ns
        self.gaze = gaze if len(gaze) else self.gaze
        if len(lids):
            self.lids = np.clip(lids, 0.0, 2.0)
            self._lids_peaks.add(self.lids)

    def for_motion(self) -> tuple[F64 | None, F64 | None, F64 | None]:
        """Gaze, marks and lids for the next motion, with peaks since the last one, such as a blink."""
        marks = None if self.marks is None else self._marks_peaks.take()
        return self.gaze, marks, None if self.lids is None else self._lids_peaks.take()

    def stale(self, t_ns: int) -> StalePart:
        """Parts that were measured once, but not lately."""
        out = StalePart(0)
        if self.marks is not None and t_ns - self._marks_ns > SILENT_NS:
            out |= StalePart.FACE
        if (self.gaze is not None or self.lids is not None) and t_ns - self._gaze_ns > SILENT_NS:
            out |= StalePart.GAZE
        return out
