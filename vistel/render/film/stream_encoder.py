"""Pictures for a stream, encoded in a thread of its own: H.264 without delay, or JPEG for pages that decode no H.264."""

from __future__ import annotations

import logging
import queue
import struct
import threading
from collections.abc import Callable, Collection
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, cast

import av
import cv2
from av.error import FFmpegError
from av.video.codeccontext import VideoCodecContext
from av.video.frame import PictureType
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc

from vistel.arrays import U8
from vistel.render.film.planes import Planes

log = logging.getLogger("vistel.renderer")


# The first byte of a binary message: what it holds.
PICTURE = 0
KEY_PICTURE = 1
SOUND = 2
_HEAD = struct.Struct("<B7xQ")
"""Kind; conference time [us]: when a picture was drawn, when the first sample of a sound is heard."""
_QUEUE = 2
_KEY_EVERY_NS = 10_000_000_000
_KEYS_APART_NS = 1_000_000_000
"""At least: a reader that falls behind again and again costs the others little."""
_JPEG_QUALITY = 80


@dataclass(frozen=True)
class StreamPicture:
    """data: as it is sent; key: it can be shown without the one before."""

    data: bytes
    key: bool


Deliver = Callable[[str, StreamPicture], None]


def message(kind: int, t_ns: int, data: bytes) -> bytes:
    """A binary message of the stream."""
    return _HEAD.pack(kind, t_ns // 1000) + data


class StreamEncoder:
    """`put` never waits: when encoding falls behind, pictures are left out."""

    def __init__(self, width: int, height: int, rate: float, deliver: Deliver) -> None:
        """deliver: takes each picture and its form, in the encoder's thread."""
        self.size = width - width % 2, height - height % 2
        self._rate, self._deliver = rate, deliver
        self._planes = Planes(*self.size)
        self._queue: queue.Queue[tuple[int, U8, frozenset[str]] | None] = queue.Queue(_QUEUE)
        self._codec: VideoCodecContext | None = None
        self._wants_key = False
        self._key_ns: int | None = None
        self._frames = 0
        self._failed = False
        self.left_out = 0
        self._thread = threading.Thread(target=self._work, name="stream", daemon=True)
        self._thread.start()

    def put(self, t_ns: int, rgba: U8, forms: Collection[str], wants_key: bool) -> None:
        """A picture (h, w, 4) RGBA, first row at the bottom, drawn at `t_ns`, in the `forms` that are read. It is not changed."""
        self._wants_key |= wants_key
        try:
            self._queue.put_nowait((t_ns, rgba, frozenset(forms)))
        except queue.Full:
            self.left_out += 1

    def close(self) -> None:
        """End the thread; what waits is not encoded."""
        while True:
            try:
                self._queue.get_nowait()
            except queue.Empty:
                break
        self._queue.put(None)
        self._thread.join(timeout=5.0)

    def _work(self) -> None:
        while (item := self._queue.get()) is not None:
            t_ns, rgba, forms = item
            try:
                if "jpeg" in forms:
                    self._deliver("jpeg", StreamPicture(message(KEY_PICTURE, t_ns, _jpeg(rgba)), True))
                if "h264" in forms and not self._failed:
                    self._encode(t_ns, rgba)
            except (FFmpegError, OSError, ValueError, cv2.error) as e:
                self._failed = True
                log.error("event=stream_failed reason=%r", str(e))

    def _encode(self, t_ns: int, rgba: U8) -> None:
        self._codec = self._codec or self._open()
        codec = cast("Any", self._codec)  # PyAV leaves the types of packets open
        frame = self._planes.frame(rgba)
        frame.pts, frame.time_base = self._frames, codec.time_base
        self._frames += 1
        since_ns = _KEY_EVERY_NS if self._key_ns is None else t_ns - self._key_ns
        if since_ns >= _KEY_EVERY_NS or (self._wants_key and since_ns >= _KEYS_APART_NS):
            frame.pict_type = PictureType.I
            self._key_ns, self._wants_key = t_ns, False
        for packet in codec.encode(frame):
            kind = KEY_PICTURE if packet.is_keyframe else PICTURE
            self._deliver("h264", StreamPicture(message(kind, t_ns, bytes(packet)), packet.is_keyframe))

    def _open(self) -> VideoCodecContext:
        codec = av.CodecContext.create("libx264", "w")
        assert isinstance(codec, VideoCodecContext)
        codec.width, codec.height, codec.pix_fmt = *self.size, "yuv420p"
        codec.time_base = Fraction(1, max(1, round(self._rate)))
        codec.framerate = Fraction(max(1, round(self._rate)), 1)
        codec.thread_count = 1
        codec.gop_size = 100_000  # key frames where they are wanted, no others
        codec.color_range, codec.colorspace = ColorRange.MPEG, Colorspace.ITU601  # what cv2 makes
        # Browsers that are told a part of it only take all of it to be BT.709.
        codec.color_primaries, codec.color_trc = ColorPrimaries.BT709, ColorTrc.BT709
        # x264's forced-idr: a key picture on demand must be one that decoding can begin at.
        codec.options = {"preset": "ultrafast", "tune": "zerolatency", "crf": "23", "profile": "baseline", "forced-idr": "1"}
        return codec


def _jpeg(rgba: U8) -> bytes:
    bgr = cv2.cvtColor(cv2.flip(rgba, 0), cv2.COLOR_RGBA2BGR)
    return cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[1].tobytes()
