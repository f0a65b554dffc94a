"""How different two pictures look, in a few lines: distances of colours as they are seen, after what the eye does not resolve.

Both pictures are made light, blurred by a pixel (edges that are smoothed a little differently are the same edge) and compared in
OKLab (Ottosson 2020), in which equal distances look equally different. What counts is the mean over the picture, which light and
colour change, and that of the worst tile, which something missing or displaced changes. This is FLIP's (Andersson 2020) order of
things without its display model and its edge detector.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from vistel.arrays import F32, U8
from vistel.colour import linear

BLUR, TILE = 1.0, 16
_LMS = np.array(
    (
        (0.4122214708, 0.5363325363, 0.0514459929),
        (0.2119034982, 0.6806995451, 0.1073969566),
        (0.0883024619, 0.2817188376, 0.6299787005),
    ),
    np.float32,
)
_LAB = np.array(
    (
        (0.2104542553, 0.7936177850, -0.0040720468),
        (1.9779984951, -2.4285922050, 0.4505937099),
        (0.0259040371, 0.7827717662, -0.8086757660),
    ),
    np.float32,
)


@dataclass(frozen=True)
class Difference:
    """mean: over the picture; worst: of the tile of TILE pixels that differs most; both in OKLab, where black to white is 1."""

    mean: float
    worst: float


def difference(a: U8, b: U8) -> Difference:
    """Of two pictures (h, w, 3) sRGB of one size."""
    if a.shape != b.shape:
        raise ValueError(f"pictures of {a.shape[1]}x{a.shape[0]} and {b.shape[1]}x{b.shape[0]}")
    apart = np.linalg.norm(_seen(a) - _seen(b), axis=2)
    rows, columns = (n // TILE for n in apart.shape)
    tiles = apart[: rows * TILE, : columns * TILE].reshape(rows, TILE, columns, TILE).mean(axis=(1, 3))
    return Difference(float(apart.mean()), float(tiles.max()))


def _seen(picture: U8) -> F32:
    """(h, w, 3) OKLab of a picture, blurred as light."""
    encoded = picture.astype(np.float32) / 255.0
    light = linear(encoded).astype(np.float32)
    blurred = np.asarray(cv2.GaussianBlur(light, (0, 0), BLUR), np.float32)
    return np.cbrt(np.maximum(blurred @ _LMS.T, 0.0)) @ _LAB.T
