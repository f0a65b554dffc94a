"""Texels of a texture: which triangle each one shows."""

import numpy as np

from vistel.arrays import F64, I32


def rasterise(triangles: F64, size: tuple[int, int]) -> tuple[I32, F64]:
    """(H, W) triangle at each texel's middle, -1 for none, and (H, W, 3) shares of its corners there. triangles: (F, 3, 2) corners
    in texels from the lower left; size: H, W. Row 0 is the highest."""
    h, w = size
    owner, share = np.full(size, -1, np.int32), np.zeros((*size, 3))
    for k, corner in enumerate(triangles):
        low = np.floor(corner.min(axis=0) - 0.5).astype(int).clip(0)
        high = np.ceil(corner.max(axis=0) + 0.5).astype(int).clip(0, (w, h))
        x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
        (ax, ay), (bx, by), (cx, cy) = corner
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if abs(area) < 1e-12 or not x.size:
            continue
        u = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / area
        v = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / area
        s = np.stack([u, v, 1.0 - u - v], axis=-1)
        inside = (s >= -1e-6).all(axis=-1)
        rows, columns = h - 1 - (y[inside] - 0.5).astype(int), (x[inside] - 0.5).astype(int)
        owner[rows, columns], share[rows, columns] = k, s[inside]
    return owner, share
