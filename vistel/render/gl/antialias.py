"""Smooths the stairs of edges in a finished picture, for machines where drawing more samples costs too much.

FXAA's direction and four taps (Lottes 2009), on the bytes that were read back: a fraction of what the same filter, or
multisampling, costs in software GL.
"""

import cv2
import numpy as np

from vistel.arrays import U8
from vistel.jit.kernel_jit import compiled

THRESHOLD = 32
"""Least difference of brightness among neighbours that counts as an edge, of 255."""
NOISE = 4.0
"""Slopes of brightness below this say nothing about where an edge runs [of 255]."""
SPAN = 6.0
"""How far along an edge the filter looks, both ways together [pixels]."""
MARGIN = 5
"""So near the border nothing is filtered [pixels]."""


def antialias(picture: U8) -> U8:
    """`picture` (h, w, 4) RGBA with smooth edges; the outermost MARGIN pixels stay as they are, and so does what is not wholly
    opaque: text laid over it."""
    out = picture.copy()
    luma = np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGBA2GRAY), np.uint8)
    _smooth(picture, luma, out)
    return out


@compiled(nogil=True, fastmath=True)
def _tap(p: U8, fx: float, fy: float) -> tuple[float, float, float]:
    """Bilinear colour at a place."""
    x, y = np.uint32(fx), np.uint32(fy)  # unsigned: no test for indices that count from the end
    ax, ay = fx - x, fy - y
    w00, w01, w10, w11 = (1.0 - ax) * (1.0 - ay), ax * (1.0 - ay), (1.0 - ax) * ay, ax * ay
    return (
        p[y, x, 0] * w00 + p[y, x + 1, 0] * w01 + p[y + 1, x, 0] * w10 + p[y + 1, x + 1, 0] * w11,
        p[y, x, 1] * w00 + p[y, x + 1, 1] * w01 + p[y + 1, x, 1] * w10 + p[y + 1, x + 1, 1] * w11,
        p[y, x, 2] * w00 + p[y, x + 1, 2] * w01 + p[y + 1, x, 2] * w10 + p[y + 1, x + 1, 2] * w11,
    )


@compiled(nogil=True, fastmath=True)
def _smooth(picture: U8, luma: U8, out: U8) -> None:
    h, w = luma.shape
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
            nw, ne, sw, se = float(above[x - 1]), float(above[x + 1]), float(below[x - 1]), float(below[x + 1])
            dx = (sw + se) - (nw + ne)
            dy = (nw + sw) - (ne + se)
            scale = 1.0 / (min(abs(dx), abs(dy)) + 0.03125 * (nw + ne + sw + se) + NOISE)
            dx = max(-SPAN, min(SPAN, dx * scale))
            dy = max(-SPAN, min(SPAN, dy * scale))
            r1, g1, b1 = _tap(picture, x - dx / 6.0, y - dy / 6.0)
            r2, g2, b2 = _tap(picture, x + dx / 6.0, y + dy / 6.0)
            r3, g3, b3 = _tap(picture, x - 0.5 * dx, y - 0.5 * dy)
            r4, g4, b4 = _tap(picture, x + 0.5 * dx, y + 0.5 * dy)
            r, g, b = 0.5 * (r1 + r2), 0.5 * (g1 + g2), 0.5 * (b1 + b2)
            wr, wg, wb = 0.5 * r + 0.25 * (r3 + r4), 0.5 * g + 0.25 * (g3 + g4), 0.5 * b + 0.25 * (b3 + b4)
            bright = 0.30 * wr + 0.59 * wg + 0.11 * wb
            high = max(here[x], above[x], below[x], here[x - 1], here[x + 1])
            low = min(here[x], above[x], below[x], here[x - 1], here[x + 1])
            if low <= bright <= high:  # the wide filter stayed on this edge
                r, g, b = wr, wg, wb
            out[y, x, 0], out[y, x, 1], out[y, x, 2] = np.uint8(r + 0.5), np.uint8(g + 0.5), np.uint8(b + 0.5)
