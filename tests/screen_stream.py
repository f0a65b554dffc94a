"""Streams as a page makes them of what somebody shows live, encoded by FFmpeg."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

import av
import numpy as np

from vistel.protocol.pages.screen_parts import ScreenPicture

ENCODERS = {
    "avc1.42e028": ("libx264", {"preset": "ultrafast", "tune": "zerolatency", "profile": "baseline"}),
    "vp8": ("libvpx", {"deadline": "realtime", "cpu-used": "8", "lag-in-frames": "0"}),
    "vp09.00.40.08": ("libvpx-vp9", {"deadline": "realtime", "cpu-used": "8", "lag-in-frames": "0"}),
}
KEY_EVERY = 20
"""Pictures: two seconds."""


def plain(colour: tuple[int, int, int], width: int = 320, height: int = 180) -> np.ndarray:
    """A picture (height, width, 3) of one colour."""
    return np.broadcast_to(np.array(colour, np.uint8), (height, width, 3)).copy()


def stream_of(codec: str, pictures: Iterable[np.ndarray], stream: int = 7, first: int = 0) -> list[ScreenPicture]:
    """Encoded, ten a second; stream: its number; first: number of its first picture."""
    name, options = ENCODERS[codec]
    out: list[ScreenPicture] = []
    context = None
    for n, rgb in enumerate(pictures, first):
        height, width = rgb.shape[:2]
        if context is None:
            context = av.CodecContext.create(name, "w")
            context.width, context.height, context.pix_fmt = width, height, "yuv420p"
            context.bit_rate, context.time_base, context.framerate = 1_200_000, Fraction(1, 10), 10
            context.gop_size, context.options = KEY_EVERY, options
        frame = av.VideoFrame.from_ndarray(rgb, format="rgb24").reformat(format="yuv420p")
        frame.pts = n
        for packet in context.encode(frame):
            out.append(ScreenPicture(stream, n, packet.is_keyframe, codec, width, height, n * 100_000, bytes(packet)))
    assert len(out) == n - first + 1, "every picture comes at once"
    return out
