"""Where a site's pictures and sound go beside its window: a file, browsers, other programs. None may take the picture away."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import cv2
from prometheus_client import Counter

from vistel.arrays import U8
from vistel.render.film.video import VideoWriter
from vistel.render.film.virtual_camera import FileDevice, NoCameraError, VirtualCamera, find_device
from vistel.wire import background
from vistel.wire.certificates.errors import CertificateError
from vistel.wire.clock import Clock
from vistel.wire.shared_pictures import PictureWriter
from vistel_services.process.clocks import ReplayClock
from vistel_services.renderer.out.stream import Stream
from vistel_services.serving.address import PageAddress

log = logging.getLogger("vistel.renderer")


_LEFT_OUT = Counter("vistel_renderer_video_left_out_total", "Pictures left out by the video encoder", ["site"])


@dataclass(frozen=True)
class Out:
    """What of a site goes out. video: the MP4 to write; stream: where browsers see it; None for none. sound: it has some.
    film: the MP4 to write when that is asked for at the window; a second one gets a number.
    shared: the memory other programs read; camera: a virtual camera's device or label, or "auto"; "": none."""

    video: Path | None = None
    stream: PageAddress | None = None
    sound: bool = False
    film: Path | None = None
    shared: Path | None = None
    camera: str = ""


class Outputs:
    """Takes pictures. An output that cannot be opened is logged in one line and left out."""

    def __init__(self, site: str, out: Out) -> None:
        self._site, self._out = site, out
        self._video: VideoWriter | None = None
        self._stream: Stream | None = None
        self._shared: PictureWriter | None = None
        self._camera: VirtualCamera | None = None
        self._size, self._rate, self._speed = (0, 0), 0.0, 1.0
        self._ending: set[asyncio.Task[None]] = set()

    @property
    def film(self) -> str:
        """Name of the file that is written; empty for none."""
        return self._video.path.name if self._video is not None else ""

    def record(self, on: bool) -> str:
        """Write a film from now on, or end it; what is in the way in one line, empty for nothing."""
        if not on and self._video is not None:
            ending = background.start(self._end(self._video), "film")
            self._ending.add(ending)
            ending.add_done_callback(self._ending.discard)
            self._video = None
        if not on or self._video is not None:
            return ""
        path = next((p for p in _takes(self._out.film) if not p.exists()), None) if self._out.film else None
        return self._write(path) if path is not None else "there is no folder to record into"

    def _write(self, path: Path) -> str:
        try:
            self._video = VideoWriter(path, *self._size, self._rate, self._out.sound, speed=self._speed)
            return ""
        except Exception as e:
            log.error("event=no_video path=%s reason=%r", path, str(e))
            return f"{path.name} cannot be written: {e}"

    async def _end(self, video: VideoWriter) -> None:
        await asyncio.to_thread(video.close)
        log.info("event=video_written path=%s frames=%d left_out=%d", video.path, video.written, video.left_out)

    async def open(self, size: tuple[int, int], rate: float, clock: Clock) -> None:
        """size: width and height of the pictures; rate: of them per second at most."""
        out = self._out
        self._size, self._rate = size, rate
        self._speed = clock.speed if isinstance(clock, ReplayClock) else 1.0
        if out.video is not None:
            self._write(out.video)
        if out.stream is not None:
            stream = Stream(self._site, out.stream, size, rate, out.sound, clock)
            try:
                await stream.open(datetime.now(UTC))
                self._stream = stream
            except CertificateError as e:
                log.error("event=no_stream address=%s reason=%r mend='a certificate'", out.stream, str(e))
                await stream.close()
            except OSError as e:
                log.error("event=no_stream address=%s reason=%r mend='another port'", out.stream, e.strerror or str(e))
                await stream.close()
        if out.shared is not None:
            try:
                self._shared = PictureWriter(out.shared, *size)
                log.info("event=sharing_pictures path=%s", out.shared)
            except OSError as e:
                log.error("event=no_shared_memory path=%s reason=%r", out.shared, e.strerror or str(e))
        if out.camera:
            self._camera = _camera_of(out.camera, size)

    def put(self, t_ns: int, rgba: U8, age_ns: int, somebody: bool) -> None:
        """A picture (h, w, 4) RGBA, first row at the bottom, drawn at `t_ns`, of motions then `age_ns` old; nobody changes it from
        now on. somebody: has been there by now; the empty room before is not worth a film, nor a replay's run-up."""
        if self._video is not None and somebody and not self._video.put(t_ns, rgba):
            _LEFT_OUT.labels(self._site).inc()
        if self._stream is not None:
            self._stream.put(t_ns, rgba, age_ns)
        if self._shared is not None:
            cv2.flip(rgba, 0, dst=self._shared.next_place())
            self._shared.done(t_ns)
        if self._camera is not None:
            self._camera.put(rgba)

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
        if self._shared is not None:
            self._shared.close()
        if self._camera is not None:
            await asyncio.to_thread(self._camera.close)
        self.record(False)
        await asyncio.gather(*self._ending)


def _takes(film: Path) -> Iterator[Path]:
    """The file, and those beside it with numbers."""
    yield film
    for n in range(2, 1000):
        yield film.with_stem(f"{film.stem}-{n}")


def _camera_of(said: str, size: tuple[int, int]) -> VirtualCamera | None:
    try:
        path = find_device(said)
        camera = VirtualCamera(FileDevice(path), *size)
        log.info("event=virtual_camera device=%s width=%d height=%d", path, *camera.size)
        return camera
    except (NoCameraError, OSError) as e:
        log.error("event=no_virtual_camera asked_for=%s reason=%r", said, str(e))
        return None
