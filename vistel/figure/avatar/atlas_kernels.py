"""Texels of an atlas: which point of the surface each one shows, and the margin round the charts."""

# pyright: basic

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32, I64
from vistel.jit.kernel_jit import compiled


@compiled
def rasterise(uv: F64, triangles: I64, size: int) -> tuple[I32, F32]:
    """(size, size) triangle at each texel centre (-1: none), (size, size, 2) barycentric weights of its corners 0, 1.

    Row 0 is at v = 1.
    """
    owner = np.full((size, size), -1, np.int32)
    weight = np.zeros((size, size, 2), np.float32)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = uv[a, 0] * size - 0.5, (1.0 - uv[a, 1]) * size - 0.5
        bx, by = uv[b, 0] * size - 0.5, (1.0 - uv[b, 1]) * size - 0.5
        cx, cy = uv[c, 0] * size - 0.5, (1.0 - uv[c, 1]) * size - 0.5
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if abs(area) < 1e-12:
            continue
        x0, x1 = max(0, int(np.ceil(min(ax, bx, cx)))), min(size - 1, int(np.floor(max(ax, bx, cx))))
        y0, y1 = max(0, int(np.ceil(min(ay, by, cy)))), min(size - 1, int(np.floor(max(ay, by, cy))))
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                u = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / area
                v = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / area
                if u >= -1e-6 and v >= -1e-6 and 1.0 - u - v >= -1e-6:
                    owner[y, x] = t
                    weight[y, x, 0], weight[y, x, 1] = u, v
    return owner, weight


@compiled
def spread(image: NDArray[np.uint8], filled: NDArray[np.bool_], steps: int) -> None:
    """Grows the filled texels outwards by `steps`, in place, so that filtering over a seam meets no foreign colour."""
    h, w, _ = image.shape
    for _ in range(steps):
        before = filled.copy()
        for y in range(h):
            for x in range(w):
                if before[y, x]:
                    continue
                n = 0
                r = g = b = 0
                for dy in range(-1, 2):
                    for dx in range(-1, 2):
                        yy, xx = y + dy, x + dx
                        if 0 <= yy < h and 0 <= xx < w and before[yy, xx]:
                            n += 1
                            r += image[yy, xx, 0]
                            g += image[yy, xx, 1]
                            b += image[yy, xx, 2]
                if n:
                    image[y, x, 0], image[y, x, 1], image[y, x, 2] = r // n, g // n, b // n
                    filled[y, x] = True
