"""Sheets: the panels of a garment side by side in one picture, and the picture of them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64, U8
from vistel.figure.clothes.cloth import Cloth
from vistel.figure.clothes.folds import Folds
from vistel.figure.clothes.weave import Floats, Look

SIZE = 512
"""Texels of a sheet along a side."""
_SHADE = 60.0
"""Share of light that a fold takes, per metre."""
_GAP = 3
"""Texels between panels."""


Paint = Callable[[str, Floats, Floats], Look]
"""The look of a panel, by its name, at places u and v (H, W) on it [m]."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """where: (2, 2) of each panel, as `vistel.figure.clothes.cloth.mesh_of` takes it; box: of each, its first and last column and
    row, first row at the top, in texels."""

    where: dict[str, F64]
    box: dict[str, tuple[int, int, int, int]]
    texels: float

    @staticmethod
    def of(cloth: Cloth) -> "Sheet":
        """With all that the cloth (of the finest level) uses, at as many texels a metre as go in."""
        low = {name: np.full(2, np.inf) for name in cloth.panels}
        high = {name: np.full(2, -np.inf) for name in cloth.panels}
        for k, name in enumerate(cloth.panels):
            flat = cloth.flat[cloth.panel == k].reshape(-1, 2)
            if len(flat):
                low[name], high[name] = flat.min(axis=0), flat.max(axis=0)
        used = [name for name in cloth.panels if np.isfinite(low[name]).all()]
        texels = 4000.0
        while (places := _placed([(high[n] - low[n]) * texels for n in used])) is None:
            texels *= 0.97
        where, box = dict[str, F64](), dict[str, tuple[int, int, int, int]]()
        for name, (x, y) in zip(used, places, strict=True):
            size = (high[name] - low[name]) * texels
            offset = np.array((x, SIZE - y - size[1])) - low[name] * texels
            where[name] = np.array((offset, np.full(2, texels))) / SIZE
            box[name] = (max(0, x - _GAP), min(SIZE, int(x + size[0]) + _GAP), max(0, y - _GAP), min(SIZE, int(y + size[1]) + _GAP))
        return Sheet(where | {n: np.zeros((2, 2)) for n in cloth.panels if n not in used}, box, texels)

    def painted(self, paint: Paint, folds: Folds) -> tuple[U8, U8]:
        """(SIZE, SIZE, 3) colours, and normals as `vistel.figure.avatar.patch.Patch` has them."""
        colour, normal = np.full((SIZE, SIZE, 3), 128, np.uint8), np.full((SIZE, SIZE, 3), (128, 128, 255), np.uint8)
        for name, (x0, x1, y0, y1) in self.box.items():
            offset, scale = self.where[name]
            u = (((np.arange(x0, x1) + 0.5) / SIZE - offset[0]) / scale[0]).astype(np.float32)
            v = ((1.0 - (np.arange(y0, y1) + 0.5) / SIZE - offset[1]) / scale[1]).astype(np.float32)
            across, up = np.tile(u, (len(v), 1)), np.repeat(v[:, None], len(u), axis=1)
            look, fold = paint(name, across, up), folds.height(name, across, up)
            # Less light comes into a fold.
            shade = 1.0 + np.clip(_SHADE * fold, -0.14, 0.05)
            colour[y0:y1, x0:x1] = np.clip(look.colour * shade[..., None], 0.0, 255.0)
            slope_v, slope_u = np.gradient(look.height + fold, 1.0 / self.texels)
            n = np.stack([-slope_u, slope_v, np.ones_like(slope_u)], axis=-1)
            normal[y0:y1, x0:x1] = np.round(128.0 + 127.0 * n / np.linalg.norm(n, axis=-1, keepdims=True))
        return colour, normal


def _placed(sizes: list[F64]) -> list[tuple[int, int]] | None:
    """Upper left corners, on shelves; None where they do not go in."""
    order = sorted(range(len(sizes)), key=lambda k: -sizes[k][1])
    out = [(0, 0)] * len(sizes)
    x, y, shelf = _GAP, _GAP, 0
    for k in order:
        w, h = (int(np.ceil(side)) + 2 * _GAP for side in sizes[k])
        if x + w > SIZE:
            x, y, shelf = _GAP, y + shelf, 0
        if x + w > SIZE or y + h > SIZE:
            return None
        out[k] = (x, y)
        x, shelf = x + w, max(shelf, h)
    return out
