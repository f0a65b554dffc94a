"""The sound track of a video: packets as they were heard, and silence where none came, without a gap.

Players lose step where a track has holes; so every 20 ms hold a packet.
"""

from fractions import Fraction
from typing import Any

import av

_RATE = 48_000
_FRAME = 960
_SILENCE = b"\xfc\xff\xfe"
"""An Opus packet: 20 ms, stereo, nothing."""
_CLOSE = _FRAME // 2


class SoundTrack:
    """Times are nanoseconds from the video's beginning."""

    def __init__(self, container: Any) -> None:
        self._container = container
        stream = container.add_stream("libopus", rate=_RATE)
        stream.codec_context.layout = "stereo"
        stream.codec_context.open()  # for the header only; packets come encoded
        self._stream = stream
        self._next = 0

    def put(self, t_ns: int, opus: bytes) -> None:
        """A packet whose first sample is heard at `t_ns`; empty: silence. What lies before the beginning is left out."""
        at = round(t_ns * _RATE / 1_000_000_000)
        if at < self._next - _CLOSE:
            return
        while at > self._next + _CLOSE:
            self._write(_SILENCE)
        self._write(opus or _SILENCE)

    def fill(self, t_ns: int) -> None:
        """Nothing more comes for the time before `t_ns`."""
        while (self._next + _FRAME) * 1_000_000_000 <= t_ns * _RATE:
            self._write(_SILENCE)

    def _write(self, opus: bytes) -> None:
        packet = av.Packet(opus)
        packet.stream = self._stream
        packet.time_base = Fraction(1, _RATE)
        packet.pts = packet.dts = self._next
        packet.duration = _FRAME
        self._container.mux(packet)
        self._next += _FRAME
