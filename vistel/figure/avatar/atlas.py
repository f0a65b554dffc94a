"""Several pictures side by side in one texture."""

import numpy as np
from PIL import Image

from vistel.arrays import F64, U8

WIDEST = 4096
"""Texels along a side of the whole texture, at most."""


def atlas(pictures: list[U8]) -> tuple[U8, F64]:
    """One picture that holds all of them, and (N, 4) the place of each: u0, v0, width, height in [0, 1], origin bottom
    left. One picture alone stays as it is; many large ones are reduced to what graphics cards take (WIDEST)."""
    if len(pictures) == 1:
        return pictures[0], np.array([[0.0, 0.0, 1.0, 1.0]])
    out, where = _packed(pictures)
    while max(out.shape) > WIDEST:
        largest = max(p.shape[0] * p.shape[1] for p in pictures)
        pictures = [_halved(p) if 4 * p.shape[0] * p.shape[1] > largest else p for p in pictures]
        out, where = _packed(pictures)
    return out, where


def _halved(picture: U8) -> U8:
    h, w, _ = picture.shape
    return np.asarray(Image.fromarray(picture).resize((max(1, w // 2), max(1, h // 2)), Image.Resampling.BOX), np.uint8)


def _packed(pictures: list[U8]) -> tuple[U8, F64]:
    """Pictures on shelves, tallest first; a shelf takes a whole number of the widest."""
    order = sorted(range(len(pictures)), key=lambda i: -pictures[i].shape[0])
    widest = max(p.shape[1] for p in pictures)
    total = sum(p.shape[0] * p.shape[1] for p in pictures)
    width = widest * int(np.ceil(np.sqrt(0.5 * total) / widest))
    place: dict[int, tuple[int, int]] = {}
    x = y = shelf = 0
    for i in order:
        h, w, _ = pictures[i].shape
        if x + w > width:
            x, y, shelf = 0, y + shelf, 0
        place[i] = (x, y)
        x, shelf = x + w, max(shelf, h)
    height = y + shelf
    out = np.full((height, width, 3), 128, np.uint8)
    where = np.zeros((len(pictures), 4))
    for i, (left, top) in place.items():
        h, w, _ = pictures[i].shape
        out[top : top + h, left : left + w] = pictures[i]
        where[i] = left / width, 1.0 - (top + h) / height, w / width, h / height
    return out, where
