"""Pictures as encoders take them: brightness and two colours in planes, first row at the top."""

import av
import cv2
import numpy as np

from vistel.arrays import U8


class Planes:
    """Makes frames of `width` x `height` (both even) of one encoder. Not for two threads at once."""

    def __init__(self, width: int, height: int) -> None:
        self._size = width, height
        self._room: U8 = np.empty((height * 3 // 2, width), np.uint8)

    def frame(self, rgba: U8) -> av.VideoFrame:
        """A picture (h, w, 4) RGBA, first row at the bottom, as yuv420p (BT.601); what is over the size at the right and at the
        bottom is left out."""
        width, height = self._size
        part = np.ascontiguousarray(rgba[rgba.shape[0] - height :, :width])
        made = np.asarray(cv2.cvtColor(part, cv2.COLOR_RGBA2YUV_I420, dst=self._room), np.uint8).reshape(-1)
        frame = av.VideoFrame(width, height, "yuv420p")
        at = 0
        # Planes are less to turn over than the picture that they are made of, and are copied anyway.
        for plane, (w, h) in zip(frame.planes, ((width, height), *((width // 2, height // 2),) * 2), strict=True):
            rows = np.frombuffer(memoryview(plane), np.uint8).reshape(-1, plane.line_size)
            rows[:h, :w] = made[at : at + w * h].reshape(h, w)[::-1]
            at += w * h
        return frame
