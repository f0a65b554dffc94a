"""Smooths the stairs of edges in a finished picture, for machines where drawing more samples costs too much.

FXAA's direction and four taps (Lottes 2009), on the bytes that were read back: a fraction of what the same filter, or
multisampling, costs in software GL.
"""

# pyright: reportCallIssue=false

from typing import Any

import cv2
import numpy as np

from vistel.arrays import U8
from vistel.jit.kernel_jit import compiled, inlined
from vistel.jit.lanes import lane
from vistel.jit.pixels import CHANNELS, load_pixel, store_pixel
from vistel.jit.pointers import at, keep, pointer

THRESHOLD = 32
"""Least difference of brightness among neighbours that counts as an edge, of 255."""
NOISE = np.float32(4.0)
"""Slopes of brightness below this say nothing about where an edge runs [of 255]."""
SPAN = np.float32(6.0)
"""How far along an edge the filter looks, both ways together [pixels]."""
MARGIN = 5
"""So near the border nothing is filtered [pixels]."""


def antialias(picture: U8) -> U8:
    """`picture` (h, w, 4) RGBA with smooth edges; the outermost MARGIN pixels stay as they are, and so does what is not wholly
    opaque: text laid over it."""
    picture = np.ascontiguousarray(picture)
    out = picture.copy()
    luma = np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGBA2GRAY), np.uint8)
    _smooth(picture, luma, out)
    return out


@inlined
def _tap(pixels: Any, width: int, fx: Any, fy: Any) -> Any:
    """Bilinear colour at a place."""
    x, y = np.int64(fx), np.int64(fy)
    ax, ay = fx - np.float32(x), fy - np.float32(y)
    bx, by = np.float32(1.0) - ax, np.float32(1.0) - ay
    above = at(pixels, CHANNELS * (y * width + x))
    below = at(above, CHANNELS * width)
    upper = load_pixel(above) * bx + load_pixel(at(above, CHANNELS)) * ax
    lower = load_pixel(below) * bx + load_pixel(at(below, CHANNELS)) * ax
    return upper * by + lower * ay


@compiled(nogil=True, fastmath=True)
def _smooth(picture: U8, luma: U8, out: U8) -> None:
    h, w = luma.shape
    f = np.float32
    pixels, smoothed = pointer(picture), pointer(out)
    edge = np.empty(w, np.uint8)
    for y in range(MARGIN, h - MARGIN):
        above, here, below = luma[y - 1], luma[y], luma[y + 1]
        for x in range(MARGIN, w - MARGIN):  # no branches: done eight pixels at a time
            high = max(here[x], above[x], below[x], here[x - 1], here[x + 1])
            low = min(here[x], above[x], below[x], here[x - 1], here[x + 1])
            edge[x] = high - low
        for x in range(MARGIN, w - MARGIN):
            if edge[x] < THRESHOLD or picture[y, x, 3] < 255:
                continue
            nw, ne, sw, se = f(above[x - 1]), f(above[x + 1]), f(below[x - 1]), f(below[x + 1])
            dx = (sw + se) - (nw + ne)
            dy = (nw + sw) - (ne + se)
            scale = f(1.0) / (min(abs(dx), abs(dy)) + f(0.03125) * (nw + ne + sw + se) + NOISE)
            dx = max(-SPAN, min(SPAN, dx * scale))
            dy = max(-SPAN, min(SPAN, dy * scale))
            near_x, near_y, far_x, far_y = dx * f(1.0 / 6.0), dy * f(1.0 / 6.0), dx * f(0.5), dy * f(0.5)
            narrow = _tap(pixels, w, f(x) - near_x, f(y) - near_y) + _tap(pixels, w, f(x) + near_x, f(y) + near_y)
            wide = _tap(pixels, w, f(x) - far_x, f(y) - far_y) + _tap(pixels, w, f(x) + far_x, f(y) + far_y)
            wide = narrow * f(0.25) + wide * f(0.25)
            bright = f(0.30) * lane(wide, 0) + f(0.59) * lane(wide, 1) + f(0.11) * lane(wide, 2)
            high = max(here[x], above[x], below[x], here[x - 1], here[x + 1])
            low = min(here[x], above[x], below[x], here[x - 1], here[x + 1])
            stays = f(low) <= bright <= f(high)  # the wide filter stayed on this edge
            store_pixel(at(smoothed, CHANNELS * (y * w + x)), (wide if stays else narrow * f(0.5)) + f(0.5))
    keep(picture, out)
