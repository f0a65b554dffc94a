"""Where a site's pictures and sound go beside its window: a file, browsers, other programs. None may take the picture away."""

from __future__ import annotations

import asyncio
import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from prometheus_client import Counter

from vistel.wire.clock import Clock
from vistel_services.renderer.stream import Stream
from vistel_services.renderer.stream_address import StreamAddress
from vistel_services.renderer.video import VideoWriter

log = logging.getLogger("vistel.renderer")

U8 = NDArray[np.uint8]

_LEFT_OUT = Counter("vistel_renderer_video_left_out_total", "Pictures the video encoder had no time for", ["site"])


@dataclass(frozen=True)
class Out:
    """What of a site goes out. video: the MP4 to write; stream: where browsers see it; None for none. sound: it has some."""

    video: Path | None = None
    stream: StreamAddress | None = None
    sound: bool = False


class Outputs:
    """Takes pictures; those that cannot be opened are told in one line, and left."""

    def __init__(self, site: str, out: Out) -> None:
        self._site, self._out = site, out
        self._video: VideoWriter | None = None
        self._stream: Stream | None = None

    async def open(self, size: tuple[int, int], rate: float, clock: Clock) -> None:
        """size: width and height of the pictures; rate: of them per second at most."""
        out = self._out
        if out.video is not None:
            try:
                self._video = VideoWriter(out.video, *size, rate, out.sound)
            except Exception as e:
                log.error("event=no_video path=%s reason=%r", out.video, str(e))
        if out.stream is not None:
            stream = Stream(self._site, out.stream, size, rate, out.sound, clock)
            try:
                await stream.open()
                self._stream = stream
            except OSError as e:
                log.error("event=no_stream address=%s reason=%r mend='another port'", out.stream, e.strerror or str(e))
                await stream.close()

    def put(self, t_ns: int, rgba: U8, age_ns: int, somebody: bool) -> None:
        """A picture (h, w, 4) RGBA, first row at the bottom, drawn at `t_ns`, of motions `age_ns` old; nobody changes it from now
        on. somebody: has been there by now; the empty room before is not worth a film."""
        if self._video is not None and somebody and not self._video.put(t_ns, rgba):
            _LEFT_OUT.labels(self._site).inc()
        if self._stream is not None:
            self._stream.put(t_ns, rgba, age_ns)

    def put_sound(self, t_ns: int, opus: bytes) -> None:
        """A frame of sound (an Opus packet of 20 ms, stereo; empty: silence) whose first sample is heard at `t_ns`."""
        if self._video is not None:
            self._video.put_sound(t_ns, opus)
        if self._stream is not None:
            self._stream.put_sound(t_ns, opus)

    async def close(self) -> None:
        """Write what is left, end what is open."""
        if self._stream is not None:
            await self._stream.close()
        if (video := self._video) is not None:
            await asyncio.to_thread(video.close)
            log.info("event=video_written path=%s frames=%d left_out=%d", video.path, video.written, video.left_out)
