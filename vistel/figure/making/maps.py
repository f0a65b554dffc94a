"""Pictures of a material that are laid differently from its colour, resampled to lie as the colour does; and combined."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from PIL import Image

from vistel.arrays import F64, U8
from vistel.colour import linear, srgb

REPEAT = "repeat"
MIRROR = "mirror"
CLAMP = "clamp"


@dataclass(frozen=True, eq=False)
class Lying:
    """How a picture lies: of texture coordinates `named`, (3, 3) to its own (origin bottom left, 0 to 1 over it); wrap: what
    is beyond, along u and v."""

    named: str = ""
    matrix: F64 = field(default_factory=lambda: np.eye(3))
    wrap: tuple[str, str] = (REPEAT, REPEAT)


def laid(picture: U8, its: Lying, like: Lying) -> U8 | None:
    """The picture as it appears on a square of the coordinates of `like`; None where it is of other coordinates."""
    if its.named != like.named:
        return None
    way = its.matrix @ np.linalg.inv(like.matrix)
    if np.allclose(way, np.eye(3), atol=1e-6):
        return picture
    size: tuple[int, ...] = picture.shape
    h, w = size[:2]
    down: F64 = (np.arange(h) + 0.5) / h
    across: F64 = (np.arange(w) + 0.5) / w
    u, v = np.broadcast_to(across, (h, w)), np.broadcast_to(1.0 - down[:, None], (h, w))
    at = np.stack([u, v, np.ones_like(u)], axis=-1) @ way.T
    x = (wrapped(at[..., 0], its.wrap[0]) * w).astype(np.int64).clip(0, w - 1)
    y = ((1.0 - wrapped(at[..., 1], its.wrap[1])) * h).astype(np.int64).clip(0, h - 1)
    return np.ascontiguousarray(picture[y, x])


def wrapped(t: F64, how: str) -> F64:
    """Where in 0 to 1 a coordinate falls."""
    if how == CLAMP:
        return np.clip(t, 0.0, 1.0)
    if how == MIRROR:
        return 1.0 - np.abs(np.mod(t, 2.0) - 1.0)
    return np.mod(t, 1.0)


def tiled(picture: U8, low: tuple[int, int], high: tuple[int, int], wrap: tuple[str, str]) -> U8:
    """The picture over whole squares `low` to `high` of its coordinates (u, v)."""
    rows: list[U8] = []
    for v in range(high[1] - 1, low[1] - 1, -1):
        row = [_turned(picture, wrap, u, v) for u in range(low[0], high[0])]
        rows.append(np.concatenate(row, axis=1))
    return np.ascontiguousarray(np.concatenate(rows, axis=0))


def _turned(picture: U8, wrap: tuple[str, str], u: int, v: int) -> U8:
    across = wrap[0] == MIRROR and u % 2
    over = wrap[1] == MIRROR and v % 2
    return picture[:: -1 if over else 1, :: -1 if across else 1]


def together(parts: Sequence[U8 | None], otherwise: Sequence[int]) -> U8 | None:
    """(H, W, C) of single channels (H, W), the smaller ones made larger; a number where there is none; None where none is."""
    known = [p for p in parts if p is not None]
    if not known:
        return None
    h, w = max(p.shape[0] for p in known), max(p.shape[1] for p in known)
    each = zip(parts, otherwise, strict=True)
    columns = [np.full((h, w), rest, np.uint8) if p is None else scaled(p, (h, w)) for p, rest in each]
    return np.ascontiguousarray(np.stack(columns, axis=-1))


def scaled(picture: U8, size: tuple[int, int]) -> U8:
    """The picture at another size (H, W)."""
    if picture.shape[:2] == size:
        return picture
    return np.asarray(Image.fromarray(picture).resize((size[1], size[0]), Image.Resampling.BILINEAR), np.uint8)


def times(channel: U8 | None, factor: float) -> U8 | None:
    """A channel with a factor in it."""
    return channel if channel is None or factor == 1.0 else np.round(np.clip(channel * factor, 0.0, 255.0)).astype(np.uint8)


def occluded(channel: U8 | None, strength: float) -> U8 | None:
    """Occlusion as strong as glTF says."""
    if channel is None:
        return None
    return np.round(255.0 + strength * (channel.astype(np.float64) - 255.0)).clip(0, 255).astype(np.uint8)


def steeper(normal: U8 | None, scale: float) -> U8 | None:
    """A normal map whose slopes are `scale` times as steep."""
    if normal is None or scale == 1.0:
        return normal
    n: F64 = normal.astype(np.float64) / 127.5 - 1.0
    n[..., :2] *= scale
    n /= np.maximum(np.linalg.norm(n, axis=-1, keepdims=True), 1e-9)
    return np.round((n + 1.0) * 127.5).clip(0, 255).astype(np.uint8)


def tinted(picture: U8, factor: F64) -> U8:
    """A picture in sRGB times a colour (3,) in linear light."""
    if (factor == 1.0).all():
        return picture
    return np.round(255.0 * srgb(linear(picture / 255.0) * factor)).clip(0, 255).astype(np.uint8)
