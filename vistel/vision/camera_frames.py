"""From the pictures of cameras on a helmet to messages."""

from typing import Protocol

import cv2
import numpy as np

from vistel.arrays import U8
from vistel.v1.device_pb2 import FaceFrame
from vistel.vision.eye_reader import EyeReader
from vistel.vision.face_calibration import FaceCalibration, FaceCalibrationError, calibrate_face
from vistel.vision.face_reader import FaceReader
from vistel.vision.gaze_calibration import GazeCalibration

_LONGEST_STEP_S = 0.25
_SAME = 8
"""So many equal pictures in a row are one that froze: a camera's noise is never the same twice."""
_DARK = 8.0
"""Mean grey level below which nothing is shown."""
_FIRST = 30
"""Pictures of which a face is learnt when no calibration is given."""


class PictureReader(Protocol):
    """What is seen in pictures that come one after the other."""

    trouble: str
    """Why nothing was seen in the last one; empty when something was."""

    def read(self, picture: U8, dt_s: float, frame: FaceFrame) -> bool:
        """Fill in what is seen, `dt_s` after the picture before; whether anything was."""
        ...


class MarksReader:
    """Marks. Without a calibration the first second of a face that is seen counts as neutral."""

    def __init__(self, calibration: FaceCalibration | None, *, mirrored: bool = False) -> None:
        self.trouble = ""
        self._mirrored = mirrored
        self._reader = FaceReader(calibration) if calibration is not None else None
        self._size = (calibration.height, calibration.width) if calibration is not None else None
        self._first: list[U8] = []

    def read(self, picture: U8, dt_s: float, frame: FaceFrame) -> bool:
        """As of `PictureReader.read`."""
        if picture.ndim == 2:
            picture = np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), np.uint8)
        if self._reader is None:
            return self._learn(picture)
        if self._size is not None and picture.shape[:2] != self._size:
            height, width = self._size
            self.trouble = f"pictures of {picture.shape[1]}x{picture.shape[0]} px, calibrated with {width}x{height}"
            return False
        reading = self._reader.read(picture, dt_s)
        self.trouble = reading.trouble if reading.marks is None else ""
        if reading.marks is None:
            return False
        frame.marks.extend(reading.marks.ravel().tolist())
        frame.guessed = sum(1 << k for k, seen in enumerate(reading.seen) if not seen)
        return True

    def _learn(self, picture: U8) -> bool:
        if self._first and self._first[0].shape != picture.shape:
            self._first = []
        self._first.append(picture)
        if len(self._first) < _FIRST:
            self.trouble = "learning the neutral face"
            return False
        try:
            self._reader = FaceReader(calibrate_face(self._first, mirrored=self._mirrored))
        except FaceCalibrationError as e:
            self.trouble = str(e)
        self._first = []
        return False


class GazeReader:
    """Gaze and lids of one eye; the other is taken to do the same. Without a calibration, lids only."""

    def __init__(self, calibration: GazeCalibration | None) -> None:
        self.trouble = ""
        self._calibration = calibration
        self._reader = EyeReader(calibration)

    def read(self, picture: U8, dt_s: float, frame: FaceFrame) -> bool:
        """As of `PictureReader.read`."""
        if picture.ndim == 3:
            picture = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)
        c = self._calibration
        if c is not None and picture.shape != (c.height, c.width):
            self.trouble = f"pictures of {picture.shape[1]}x{picture.shape[0]} px, calibrated with {c.width}x{c.height}"
            return False
        reading = self._reader.read(picture)
        # Before the first pupil it is unknown whether the eye is closed or outside the picture.
        self.trouble = "" if self._reader.found else "no eye has been seen yet"
        if not self._reader.found:
            return False
        frame.lids.extend((reading.opening, reading.opening))
        if reading.gaze is not None:
            frame.gaze.extend(reading.gaze.tolist())
        return True


class CameraDecoder:
    """A FaceFrame for each picture in which something is seen.

    `look` may be called on a thread of its own with each picture; `feed` then gives what was seen. Without it, as in a
    replay, `feed` looks at the JPEG it gets.
    """

    def __init__(self, device: str, reader: PictureReader) -> None:
        self.device = device
        self.bytes_skipped = 0
        self.pictures = 0
        """How many have come."""
        self._reader = reader
        self._seen: dict[int, FaceFrame | None] = {}
        self._last_ns = 0
        self._before: U8 | None = None
        self._same = 0
        self._dark = False

    @property
    def trouble(self) -> str:
        """Why nothing is seen; empty when something is."""
        if self._dark:
            return "the picture is black"
        return "the picture does not change" if self._same >= _SAME else self._reader.trouble

    def look(self, picture: U8, t_ns: int) -> None:
        """Look at a picture taken at `t_ns`."""
        self.pictures += 1
        dt_s = min(_LONGEST_STEP_S, max(0.0, (t_ns - self._last_ns) * 1e-9))
        self._last_ns = t_ns
        sample = picture[::8, ::8]
        same = self._before is not None and np.array_equal(sample, self._before)
        self._same, self._before = self._same + 1 if same else 0, sample.copy()
        self._dark = float(sample.mean()) < _DARK
        frame = FaceFrame(device=self.device)
        frame.header.t_ns = max(0, t_ns)
        seen = not self._dark and self._same < _SAME and self._reader.read(picture, dt_s, frame)
        self._seen[t_ns] = frame if seen else None

    def feed(self, data: bytes, t_ns: int) -> list[FaceFrame]:
        """The message of the picture of `t_ns`."""
        if t_ns not in self._seen:
            picture = _picture(data)
            if picture is None:
                self.bytes_skipped += len(data)
                return []
            self.look(picture, t_ns)
        frame = self._seen.pop(t_ns)
        return [] if frame is None else [frame]


def _picture(data: bytes) -> U8 | None:
    """(h, w) grey or (h, w, 3) BGR; None for what is no such picture."""
    try:
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:  # no bytes at all, or a size that no camera has
        return None
    if picture is None or picture.dtype != np.uint8 or (picture.ndim == 3 and picture.shape[2] != 3):  # pyright: ignore[reportUnnecessaryComparison]
        return None
    return np.asarray(picture, np.uint8)
