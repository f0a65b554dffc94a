"""Pictures of cameras, clips and network streams, read by OpenCV in a thread of their own."""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from vistel.arrays import U8
from vistel.devices.transport import OpenTransport, Received, ThreadTransport, TransportError
from vistel.wire.clock import Clock

_OPEN_MS = 3000
"""A network camera must connect within this time [ms]."""
_READ_MS = 1500
"""A network camera must send a picture within this time [ms]."""
_QUALITY = 90
"""JPEG quality of recorded pictures (0 to 100)."""
_AGAIN_S = 0.5
"""Wait after a camera could not be opened [s]."""
# FFmpeg would print a line whenever a stream ends; the device's status reports that once.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")


@dataclass(frozen=True)
class CameraSource:
    """Where pictures come from: `address` is a number (the system's camera of that number), a device, a clip or an address;
    announce: the file that holds the address instead, for a simulated camera. rate_hz, width, height: asked of a camera that
    can be asked."""

    address: str = ""
    announce: Path | None = None
    rate_hz: float = 60.0
    width: int = 640
    height: int = 480

    @property
    def clip(self) -> bool:
        """Whether it is a file with pictures of the past."""
        return self.announce is None and "://" not in self.address and Path(self.address).is_file()

    def where(self) -> str:
        """The address as it is now. Raises TransportError for one that nothing can be at."""
        if self.announce is not None:
            try:
                return self.announce.read_text()
            except OSError:
                raise TransportError(f"{self.announce.name}: no simulated camera is plugged in") from None
        if not self.address.isdecimal() and "://" not in self.address and not Path(self.address).exists():
            raise TransportError(f"{self.address}: is not there; give a camera's number, /dev/videoN, a video file or an address")
        return self.address


def open_video(source: CameraSource) -> cv2.VideoCapture:
    """May take seconds. Raises TransportError."""
    address = source.where()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)  # else each backend warns of a camera that is not there
    if address.isdecimal():
        video = cv2.VideoCapture(int(address))
    elif address.startswith("/dev/"):
        video = cv2.VideoCapture(address, cv2.CAP_V4L2)
    elif "://" in address:
        limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, _OPEN_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, _READ_MS]
        video = cv2.VideoCapture(address, cv2.CAP_FFMPEG, limits)
    else:
        video = cv2.VideoCapture(address, cv2.CAP_FFMPEG)
    if not video.isOpened():
        if address.isdecimal():
            raise TransportError(f"camera {address}: is not there, or is in use by another program; vistel devices lists cameras")
        raise TransportError(f"{address}: shows no pictures; is it a camera or a clip, and not in use elsewhere?")
    if address.isdecimal() or address.startswith("/dev/"):
        video.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))
        video.set(cv2.CAP_PROP_FRAME_WIDTH, source.width)
        video.set(cv2.CAP_PROP_FRAME_HEIGHT, source.height)
        video.set(cv2.CAP_PROP_FPS, source.rate_hz)
        video.set(cv2.CAP_PROP_BUFFERSIZE, 1)
    return video


class CameraTransport(ThreadTransport):
    """Reads on a thread; `look(picture, t_ns)` is called there, `received(jpeg, t_ns)` then on the event loop.

    keep: hand on each picture as JPEG, as it is to be recorded; `look` then sees what the JPEG holds, so that a
    replay of the record finds the same. Otherwise `received` gets no bytes.
    """

    def __init__(
        self,
        source: CameraSource,
        clock: Clock,
        look: Callable[[U8, int], None],
        keep: bool,
        received: Received,
        lost: Callable[[str], None],
    ) -> None:
        self._source, self._clock, self._look, self._keep = source, clock, look, keep
        source.where()
        super().__init__(f"camera {source.address}", received, lost)

    def _read(self) -> None:
        try:
            video = open_video(self._source)
        except TransportError as e:
            self._closed.wait(_AGAIN_S)
            self._later(self._lost, str(e))
            return
        try:
            reason = self._pictures(video)
        except Exception as e:  # a picture nothing can be made of must not end the device without a word
            reason = f"reading pictures failed: {e!r}"
        video.release()
        self._later(self._lost, reason)

    def _pictures(self, video: cv2.VideoCapture) -> str:
        closed, clip = self._closed, self._source.clip
        rate = video.get(cv2.CAP_PROP_FPS) or 30.0
        start_ns, number = self._clock.now_ns(), 0
        while not closed.is_set():
            ok, picture = video.read()
            if not ok:
                return "the clip is over; it begins again" if clip else "the camera is gone"
            if clip:
                # A clip has the times of its own pace.
                number += 1
                due_ns = start_ns + round(number / rate * 1e9)
                while (wait_s := (due_ns - self._clock.now_ns()) * 1e-9) > 0.0 and not closed.is_set():
                    time.sleep(min(wait_s, 0.1))
            t_ns = self._clock.now_ns()
            data = b""
            if self._keep:
                data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()
                picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
            self._look(np.asarray(picture, np.uint8), t_ns)
            self._later(self._received, data, t_ns)
        return "closed"


def open_camera(source: CameraSource, look: Callable[[U8, int], None], clock: Clock, *, keep: bool) -> OpenTransport:
    """How a driver opens (and opens again) its camera."""
    return lambda received, lost: CameraTransport(source, clock, look, keep, received, lost)
