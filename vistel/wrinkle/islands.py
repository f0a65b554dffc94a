"""The islands of a texture: which texels show, and colour spread beyond their edges, so that mipmaps do not mix in what is between
them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import I32, U8
from vistel.figure.avatar.atlas_kernels import rasterise
from vistel.figure.avatar.avatar import Mesh
from vistel.jit.kernel_jit import compiled


def shown_by(meshes: Sequence[Mesh], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """(H, W) texels that meshes show; shape: (H, W) of their texture."""
    height, width = shape
    size = max(shape)
    out = np.zeros(shape, np.bool_)
    for mesh in meshes:
        uv = mesh.uv.astype(np.float64) * np.array((width, height)) / size
        uv[:, 1] += 1.0 - height / size
        out |= rasterise(uv, mesh.corner_triangles.astype(np.int64), size)[0][:height, :width] >= 0
    return out


def spread_out(picture: U8, shown: NDArray[np.bool_]) -> U8:
    """The picture (H, W, 3) with the colour of the nearest texel that is shown wherever none is."""
    if not shown.any():
        return picture
    nearest = _nearest(shown)
    return np.ascontiguousarray(picture.reshape(-1, picture.shape[2])[nearest.ravel()].reshape(picture.shape))


@compiled
def _nearest(shown: NDArray[np.bool_]) -> I32:
    """(H, W) index of a texel that is shown and, but for a texel or so, nearest: two sweeps over the picture."""
    height, width = shown.shape
    best = np.full((height, width), 1 << 30, np.int32)
    at = np.zeros((height, width), np.int32)
    for y in range(height):
        for x in range(width):
            if shown[y, x]:
                best[y, x], at[y, x] = 0, y * width + x
    for sweep in range(2):
        step = 1 - 2 * sweep
        for row in range(height):
            y = row if sweep == 0 else height - 1 - row
            for column in range(width):
                x = column if sweep == 0 else width - 1 - column
                for k in range(4):
                    dy, dx = (0, -step) if k == 0 else (-step, k - 2)
                    j, i = y + dy, x + dx
                    if j < 0 or j >= height or i < 0 or i >= width or best[j, i] == 1 << 30:
                        continue
                    source = at[j, i]
                    away = (source // width - y) ** 2 + (source % width - x) ** 2
                    if away < best[y, x]:
                        best[y, x], at[y, x] = away, source
    return at
