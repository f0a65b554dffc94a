"""H.264 in MP4, written in fragments: what was written stays playable however the process ends."""

import contextlib
import logging
import queue
import threading
from collections import deque
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
from av.error import FFmpegError
from av.video.frame import PictureType
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc

from vistel.arrays import U8
from vistel.render.film.planes import Planes
from vistel.render.film.sound_track import SoundTrack

log = logging.getLogger("vistel.renderer")


_TIME_BASE = Fraction(1, 90_000)
_KEY_EVERY = 90_000
_QUEUE = 8
_SOUNDS = 2000
"""Packets that wait for their pictures: of forty seconds."""
_SOUND_LATE_NS = 1_000_000_000
"""Sound that has not come by then is silence."""


Quality = Mapping[str, str]
"""Options of x264."""
LIVE: Quality = {"preset": "ultrafast", "tune": "zerolatency", "crf": "21"}
FILM: Quality = {"preset": "medium", "crf": "18", "bf": "0"}
"""Without pictures that are coded after later ones: a file in fragments cannot tell players to begin earlier for them, and the
film would come behind its sound."""


class VideoWriter:
    """Encodes in a thread of its own; `put` never waits: when it falls behind, pictures are left out and counted.

    A file that is there already (this renderer was started again) is kept, and "name.2.mp4" written.
    A disk that fails ends the video with one line, not the renderer.
    speed: 0.5 makes a second of what is shown take two in the film. Such a film has no sound.
    """

    def __init__(
        self, path: Path, width: int, height: int, rate: float, sound: bool = False, quality: Quality = LIVE, speed: float = 1.0
    ) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path = _free(path)
        width, height = width - width % 2, height - height % 2
        self._planes = Planes(width, height)
        self.left_out = 0
        self.written = 0
        self._queue: queue.Queue[tuple[int, U8] | None] = queue.Queue(_QUEUE)
        self._sounds: deque[tuple[int, bytes]] = deque(maxlen=_SOUNDS)
        options = {"movflags": "frag_keyframe+empty_moov+default_base_moof", "flush_packets": "1"}
        self._container: Any = av.open(str(self.path), "w", format="mp4", options=options)
        stream = self._container.add_stream("libx264", rate=max(1, round(rate)))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.time_base = _TIME_BASE
        stream.codec_context.time_base = _TIME_BASE
        stream.codec_context.thread_count = 1
        stream.codec_context.color_range = ColorRange.MPEG
        stream.codec_context.colorspace = Colorspace.ITU601  # what cv2 makes
        # Players that are told a part of it only take all of it to be BT.709.
        stream.codec_context.color_primaries, stream.codec_context.color_trc = ColorPrimaries.BT709, ColorTrc.BT709
        stream.codec_context.gop_size = max(1, round(rate))
        stream.options = dict(quality)
        self._stream = stream
        self._track = SoundTrack(self._container) if sound and speed == 1.0 else None
        self._ticks_per_ns = 90e-6 / speed
        self._failed = False
        self._last_pts, self._key_due = -1, 0
        self._start_ns: int | None = None
        self._thread = threading.Thread(target=self._work, name="video", daemon=True)
        self._thread.start()

    def put(self, t_ns: int, rgba: U8) -> bool:
        """A picture (h, w, 4) RGBA, first row at the bottom, shown at `t_ns`; the array is the writer's from now on.

        False when there was no time for it.
        """
        try:
            self._queue.put_nowait((t_ns, rgba))
        except queue.Full:
            self.left_out += 1
            return False
        return True

    def put_waiting(self, t_ns: int, rgba: U8) -> bool:
        """The same, for who has time: waits until there is room. False when the video has failed."""
        self._queue.put((t_ns, rgba))
        return not self._failed

    def put_sound(self, t_ns: int, opus: bytes) -> None:
        """A frame of sound (an Opus packet of 20 ms, stereo) whose first sample is heard at `t_ns`."""
        self._sounds.append((t_ns, opus))

    def close(self) -> None:
        """Write what is left and end the file, however long a busy machine takes for that."""
        self._queue.put(None)
        self._thread.join()

    def _work(self) -> None:
        while (item := self._queue.get()) is not None:
            if self._failed:
                continue
            try:
                self._encode(*item)
            except (FFmpegError, OSError) as e:
                self._failed = True
                log.error("event=video_failed path=%s reason=%r written=%d", self.path, str(e), self.written)
        with contextlib.suppress(FFmpegError, OSError):
            if not self._failed:
                self._sound()
                self._container.mux(self._stream.encode(None))
            self._container.close()

    def _encode(self, t_ns: int, rgba: U8) -> None:
        frame = self._planes.frame(rgba)
        if self._start_ns is None:
            self._start_ns = t_ns
        pts = max(self._last_pts + 1, round((t_ns - self._start_ns) * self._ticks_per_ns))
        self._last_pts = frame.pts = pts
        if pts >= self._key_due:  # what is written begins anew with each: a slow renderer that dies loses a second, too
            frame.pict_type = PictureType.I
            self._key_due = pts + _KEY_EVERY
        frame.time_base = _TIME_BASE
        self._container.mux(self._stream.encode(frame))
        self.written += 1
        self._sound()
        if self._track is not None:
            self._track.fill(t_ns - self._start_ns - _SOUND_LATE_NS)

    def _sound(self) -> None:
        """Write the sounds that have come."""
        while self._sounds and self._start_ns is not None:
            at_ns, opus = self._sounds.popleft()
            if self._track is not None:
                self._track.put(at_ns - self._start_ns, opus)


def _free(path: Path) -> Path:
    number = 1
    out = path
    while out.exists():
        number += 1
        out = path.with_name(f"{path.stem}.{number}{path.suffix}")
    return out
