"""Spots of a key picture, with sub-pixel centres; merged spots can be split."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, U8

_RISE = 0.35
"""Share of the full key from which a pixel belongs to a spot."""
_MARGIN = 2
"""Pixels round a spot that belong to its blurred edge."""
_FAINT = 0.08
"""Share of the full key below which a pixel is noise."""


@dataclass(frozen=True)
class Spots:
    """centre: (n, 2) x, y [px]; a pixel's centre has whole coordinates. mass: (n,) pixels' worth of mark. box: (n, 4)
    x, y, width, height [px] with its margin. length: (n,) longer side of the box over the square root of the mass."""

    centre: F64
    mass: F64
    box: NDArray[np.int64]
    length: F64

    def __len__(self) -> int:
        return len(self.mass)


def find_spots(key: U8, full: float, *, smallest: float = 6.0, largest: float = 4000.0) -> Spots:
    """Spots of a key picture (h, w), `full` over a mark, with masses [px] within smallest..largest."""
    _, mask = cv2.threshold(key, _RISE * full, 255, cv2.THRESH_BINARY)
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    height, width = key.shape
    centres: list[tuple[float, float]] = []
    masses: list[float] = []
    boxes: list[tuple[int, int, int, int]] = []
    for outline in outlines:
        x, y, w, h = cv2.boundingRect(outline)
        if w * h < smallest or w * h > 6.0 * largest:
            continue
        x0, y0 = max(0, x - _MARGIN), max(0, y - _MARGIN)
        x1, y1 = min(width, x + w + _MARGIN), min(height, y + h + _MARGIN)
        weight = window_weights(key, (x0, y0, x1 - x0, y1 - y0), full)
        mass = float(weight.sum())
        if not smallest <= mass <= largest:
            continue
        along, down = (np.arange(n, dtype=np.float64) for n in (x1 - x0, y1 - y0))
        centres.append((x0 + float(weight.sum(0) @ along) / mass, y0 + float(weight.sum(1) @ down) / mass))
        masses.append(mass)
        boxes.append((x0, y0, x1 - x0, y1 - y0))
    box = np.array(boxes, np.int64).reshape(-1, 4)
    mass = np.array(masses)
    return Spots(np.array(centres).reshape(-1, 2), mass, box, box[:, 2:].max(1, initial=0) / np.sqrt(mass))


def window_weights(key: U8, box: tuple[int, int, int, int], full: float) -> F64:
    """(h, w) share of mark in each pixel of a box x, y, w, h: 0..about 1."""
    x, y, w, h = box
    weight = np.asarray(key[y : y + h, x : x + w], np.float64) * (1.0 / full)
    weight[weight < _FAINT] = 0.0
    return weight


def split_spot(key: U8, box: tuple[int, int, int, int], full: float, seeds: F64, rounds: int = 8) -> tuple[F64, F64]:
    """Centres (k, 2) [px] and masses (k,) of `k` merged marks near `seeds` (k, 2) [px], by k-means.

    A centre without pixels has mass 0.
    """
    weight = window_weights(key, box, full)
    ys, xs = np.nonzero(weight)
    points = np.column_stack((xs + box[0], ys + box[1])).astype(np.float64)
    w = weight[ys, xs]
    centres = np.array(seeds, np.float64)
    masses: F64 = np.zeros(len(centres))
    for _ in range(rounds):
        owner = ((points[:, None] - centres[None]) ** 2).sum(2).argmin(1)
        masses = np.asarray(np.bincount(owner, w, len(centres)), np.float64)
        new = np.column_stack([np.bincount(owner, w * points[:, k], len(centres)) for k in (0, 1)])
        moved = np.where(masses[:, None] > 0.0, new / np.maximum(masses, 1e-9)[:, None], centres)
        if np.abs(moved - centres).max() < 0.01:
            break
        centres = moved
    return centres, masses
