"""Short hairs in the texture: brows hair by hair, stubble, and the patch of the lashes."""

import numpy as np
from PIL import Image, ImageDraw

from vistel.arrays import F32, F64, Bool
from vistel.figure.avatar.patch import Patch
from vistel.geometry.smoothstep import smooth

_FINE = 4
"""Steps of a brow's picture to a texel."""


def brows(shape: F32, rng: np.random.Generator, thick: float) -> F32:
    """(H, W) how far hairs of the brows cover the texture. shape: (H, W) 1 in the middle of a brow, 0 beyond its last hairs; thick:
    0 thin .. 1 bushy. The head lies on its side there: the left brow goes upwards from the nose, the right one downwards, and the
    forehead is on the left."""
    out = np.zeros_like(shape)
    half = shape.shape[0] // 2
    least = 0.55 - 0.5 * thick
    for side, first in ((1.0, 0), (-1.0, half)):
        own = shape[first : first + half]
        rows, columns = np.nonzero(own > 0.0)
        if not len(rows):
            continue
        top, left = int(rows.min()) - 8, int(columns.min()) - 12
        high, wide = int(rows.max()) + 8 - top, int(columns.max()) + 8 - left
        picture = Image.new("L", (wide * _FINE, high * _FINE))
        pen = ImageDraw.Draw(picture)
        first_row, last_row = int(rows.min()), int(rows.max())
        along = (last_row - rows if side > 0.0 else rows - first_row).astype(np.float64) / max(1, last_row - first_row)
        chance = smooth((own[rows, columns] - least) / 0.35)
        for k in np.flatnonzero(rng.random(len(rows)) < (0.12 + 0.08 * thick) * chance):
            at = float(along[k])
            # Upright at the nose, then lying along the brow, down at the outer end.
            lean = float(np.interp(at, (0.0, 0.25, 1.0), (0.95, 0.40, -0.10))) + rng.normal(0.0, 0.16)
            length = rng.uniform(8.0, 14.0) * float(np.interp(at, (0.0, 0.3, 1.0), (0.6, 1.0, 0.7)))
            x, y = columns[k] - left + rng.random(), rows[k] - top + rng.random()
            bend = rng.normal(0.10, 0.08)
            ways = lean - bend * np.linspace(0.0, 2.0, 4)
            points = np.cumsum(np.vstack([(x, y), np.column_stack([-np.sin(ways), -side * np.cos(ways)]) * length / 4.0]), axis=0)
            pen.line([(float(u) * _FINE, float(v) * _FINE) for u, v in points], fill=int(rng.uniform(150, 255)), width=2)
        drawn = np.asarray(picture.resize((wide, high), Image.Resampling.BOX), np.float32) / 255.0
        out[first + top : first + top + high, left : left + wide] = drawn
    return np.minimum(1.2 * out, 1.0).astype(np.float32)


def stubble(rng: np.random.Generator, size: tuple[int, ...], where: F32) -> F32:
    """(H, W) how far stubble covers skin; where: (H, W) how thick it grows."""
    dots = rng.random(size, np.float32)
    return where * np.where(dots < 0.25, np.float32(0.72), np.float32(0.22))


def spots(rng: np.random.Generator, where: F32, within: Bool, each: float, radius: tuple[float, float]) -> F32:
    """(H, W) freckles and spots, 0 to 1. where: (H, W) how likely; each: of so many texels one has one where that is 1;
    radius: least and most [texels]."""
    out = np.zeros_like(where)
    rows, columns = np.nonzero(within & (rng.random(where.shape, np.float32) < where / each))
    y, x = np.mgrid[-5:6, -5:6]
    for r, c in zip(rows, columns, strict=True):
        if 5 <= r < where.shape[0] - 5 and 5 <= c < where.shape[1] - 5:
            size = rng.uniform(*radius)
            away = np.square(x - rng.normal(0, 0.3)) + np.square(y * rng.uniform(0.8, 1.25))
            spot = rng.uniform(0.3, 1.0) * np.exp(-away / size**2)
            part = out[r - 5 : r + 6, c - 5 : c + 6]
            np.maximum(part, spot, out=part)
    return out


def lashes(box: F64, rng: np.random.Generator) -> Patch:
    """Of the lower lids (upper half) and the upper lids: hairs from root to tip, thinner to their ends."""
    high, wide = 96, 640
    v, u = np.mgrid[1.0 : 0.0 : 1j * high, 0.0 : 1.0 : 1j * wide]
    rows: list[F64] = []
    for count, longest, thick, dense in ((30, 0.42, 0.0030, 0.0), (70, 0.90, 0.0055, 0.10)):
        cover = 0.9 * smooth((dense + 0.02 - np.abs(v - 0.06)) / 0.05) * (dense > 0.0)
        for root in np.linspace(0.03, 0.97, count) + rng.uniform(-0.006, 0.006, count):
            length = longest * rng.uniform(0.7, 1.0) * (0.65 + 0.35 * np.sin(np.pi * root) ** 0.5)
            lean = 0.12 * (root - 0.4) + rng.uniform(-0.014, 0.014)
            along = np.clip((v - 0.06) / length, 0.0, 1.0)
            half = thick * (1.0 - along)
            hair = np.clip((half - np.abs(u - root - lean * along**1.5)) / 0.0022 + 0.5, 0.0, 1.0)
            cover = np.maximum(cover, hair * (v < 0.06 + length) * (v > 0.04))
        rows.append(cover)
    opacity = np.round(255.0 * np.concatenate(rows)).astype(np.uint8)
    u0, v0, u1, v1 = box.tolist()
    return Patch((u0, v0, u1, v1), roughness=0.7, opacity=opacity, cutoff=0.35, both_sides=True)
