"""The pictures of a topic as a film (MP4, H.264) that begins when a log does."""

from __future__ import annotations

import io
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import U8
from vistel.log.ros.bag import BagPicture
from vistel.log.sensors import SensorError

MOST_PIXELS = 16_000_000
_TIME_BASE = Fraction(1, 90_000)
_CHANNELS = {"mono8": [0, 0, 0], "rgb8": [0, 1, 2], "bgr8": [2, 1, 0], "rgba8": [0, 1, 2], "bgra8": [2, 1, 0]}
"""Of ROS's encodings: which of the bytes of a pixel are red, green and blue."""
_BYTES = {"mono8": 1, "rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}


def write_film(source: str, pictures: Iterable[tuple[float, BagPicture]], path: Path) -> tuple[int, float, float]:
    """Write pictures at their times [s, of the log]; those before 0, and those whose time goes back, are left out. The first one is
    shown from the log's beginning. source: of what, for errors. Returns how many were written, and when the first and the last were
    taken [s]. Raises SensorError; OSError where `path` cannot be written."""
    try:
        import av
    except ImportError as e:
        raise SensorError(f"{source}: a film needs PyAV: pip install 'vistel[ros]'") from e
    container: Any = None
    stream: Any = None
    count, first, last = 0, 0.0, -1.0
    try:
        for t, picture in pictures:
            pts = round(t / _TIME_BASE)
            if t < 0.0 or (count and pts <= last):
                continue
            frame: Any = av.VideoFrame.from_ndarray(_pixels(source, picture), format="rgb24")
            if stream is None:
                container = av.open(str(path), "w", format="mp4")
                stream = container.add_stream("libx264", rate=30)
                stream.width, stream.height, stream.pix_fmt = frame.width // 2 * 2, frame.height // 2 * 2, "yuv420p"
                stream.time_base = stream.codec_context.time_base = _TIME_BASE
                stream.codec_context.thread_count = 1
                stream.options = {"preset": "veryfast", "crf": "20", "bf": "0"}
                first = t
                pts = 0
            frame = frame.reformat(width=stream.width, height=stream.height, format="yuv420p")
            frame.pts, frame.time_base = pts, _TIME_BASE
            container.mux(stream.encode(frame))
            count, last = count + 1, pts
        if stream is not None:
            container.mux(stream.encode(None))
    finally:
        if container is not None:
            container.close()
    return count, first, last * float(_TIME_BASE)


def _pixels(source: str, picture: BagPicture) -> U8:
    """(h, w, 3) red, green, blue, first row at the top."""
    if not picture.encoding:
        return _of_file(source, picture.data)
    size = _BYTES.get(picture.encoding)
    if size is None:
        raise SensorError(f"{source}: pictures are {picture.encoding[:30]}; expected {', '.join(_BYTES)}, or a file such as JPEG")
    w, h, step = picture.width, picture.height, picture.step
    if min(w, h) < 2 or w * h > MOST_PIXELS or step < w * size or len(picture.data) < h * step:
        raise SensorError(f"{source}: a picture of {w} x {h}, {step} bytes a row, has {len(picture.data)} bytes")
    rows = np.frombuffer(picture.data, np.uint8, h * step).reshape(h, step)[:, : w * size].reshape(h, w, size)
    return np.ascontiguousarray(rows[:, :, _CHANNELS[picture.encoding]])


def _of_file(source: str, data: bytes) -> U8:
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data), formats=("JPEG", "PNG")) as image:
            if image.width * image.height > MOST_PIXELS or min(image.size) < 2:
                raise SensorError(f"{source}: a picture has {image.width} x {image.height} pixels, expected at most {MOST_PIXELS}")
            return np.array(image.convert("RGB"), np.uint8)
    except SensorError:
        raise
    except Exception as e:  # of a file of others, anything
        raise SensorError(f"{source}: a picture cannot be read as JPEG or PNG; it is cut off or damaged") from e
