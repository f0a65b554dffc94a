"""Wrinkled colour textures: the flat one displaced, lit and drawn again (Singh §5.2.2, Figures 49 and 50; mathematics M9.4).

Cloth does not stretch: where it rises and falls it covers less of the plane, and the cloth beside it is drawn in.
The wrinkled texture shows at P the cloth of P + d(P), where div d = |grad h|^2 / 2 is the length used up by the displacement h.
By that motion the wrinkled texture no longer corresponds to the flat one; it is kept within a limit and reported (`Loss`).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel import colour
from vistel.arrays import F32, U8
from vistel.wrinkle.displacement import Map, bump_normals, slopes
from vistel.wrinkle.errors import WrinkleError

Float = NDArray[np.floating]


@dataclass(frozen=True)
class Lighting:
    """Light on a flat texture, close to that of the room.

    towards: direction to the lamp, right, up and out of the texture. ambient: share of the light that comes from everywhere.
    cavity: how much darker what lies a `depth` [m] below its surroundings is, and how much lighter what stands as high.
    """

    towards: tuple[float, float, float] = (-0.35, 0.62, 0.70)
    ambient: float = 0.45
    cavity: float = 0.35
    depth: float = 0.006


@dataclass(frozen=True)
class Loss:
    """How far a wrinkled texture no longer corresponds to the flat one.

    shift: largest motion of the texture [m]; mean: mean motion [m]; wanted: largest motion that keeps all lengths [m], more
    than `shift` where it was limited. slope: steepest slope of the displacement.
    """

    shift: float
    mean: float
    wanted: float
    slope: float

    @property
    def limited(self) -> bool:
        """Whether the motion was limited, so that lengths are not kept."""
        return self.wanted > self.shift * (1.0 + 1e-6)


def shading(of: Map, light: Lighting = Lighting()) -> F32:
    """(H, W) brightness of the displaced plane, 1 where it is flat; in linear light."""
    towards = np.array(light.towards, np.float32)
    towards /= np.linalg.norm(towards)
    direct = np.maximum(bump_normals(of) @ towards, 0.0)
    below = _blurred(of.height, light.depth * 2.0 / of.step, of.wraps) - of.height
    ambient = light.ambient * np.exp(-light.cavity * np.tanh(below / light.depth))
    flat = light.ambient + (1.0 - light.ambient) * float(towards[2])
    return np.asarray((ambient + (1.0 - light.ambient) * direct) / flat, np.float32)


def drawn_in(of: Map, limit: float | None = None) -> tuple[F32, Loss]:
    """(H, W, 2) where the cloth that is seen at each texel lies when flat, less the texel's place [m, right and up]; at most
    `limit` [m]."""
    du, dv = slopes(of)
    slope = math.sqrt(float((du * du + dv * dv).max(initial=0.0)))
    shift = _solved(0.5 * (du * du + dv * dv), of.step)
    length = np.linalg.norm(shift, axis=2)
    wanted = float(length.max(initial=0.0))
    scale = 1.0 if limit is None or wanted <= limit else limit / wanted
    return shift * np.float32(scale), Loss(scale * wanted, scale * float(length.mean()), wanted, slope)


def wrinkled_texture(
    flat: U8, of: Map, light: Lighting = Lighting(), *, limit: float | None = 0.003, mask: F32 | None = None
) -> tuple[U8, Loss]:
    """The wrinkled texture of a flat one (H, W, 3), sRGB, and what it loses. limit: of the motion of the texture [m].
    mask: (H, W), 0 where nothing is to change. Raises WrinkleError where map and texture are of different sizes."""
    if flat.shape[:2] != of.height.shape:
        (h, w), (rows, columns) = flat.shape[:2], of.height.shape
        raise WrinkleError(f"texture: is {w} x {h}, the displacement map {columns} x {rows}; make the map of the texture's size")
    shift, loss = drawn_in(of, limit)
    light_here = shading(of, light)
    if mask is not None:
        shift, light_here = shift * mask[..., None], 1.0 + (light_here - 1.0) * mask
    moved = sample(linear(flat), shift / np.float32(of.step), of.wraps)
    return encoded(moved * light_here[..., None]), loss


def sample(picture: F32, shift: F32, wraps: bool) -> F32:
    """A picture (H, W, C) read `shift` (H, W, 2) texels right of and above every texel, bilinear; edges go on."""
    height, width = picture.shape[:2]
    x: F32 = np.arange(width, dtype=np.float32)[None] + shift[..., 0]
    y: F32 = np.clip(np.arange(height, dtype=np.float32)[:, None] - shift[..., 1], 0, height - 1)
    x0, y0 = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    fx, fy = (x - x0).astype(np.float32)[..., None], (y - y0).astype(np.float32)[..., None]
    y1 = np.minimum(y0 + 1, height - 1)
    if wraps:
        x1, x0 = (x0 + 1) % width, x0 % width
    else:
        x1, x0 = np.clip(x0 + 1, 0, width - 1), np.clip(x0, 0, width - 1)
    above = picture[y0, x0] * (1 - fx) + picture[y0, x1] * fx
    below = picture[y1, x0] * (1 - fx) + picture[y1, x1] * fx
    return np.asarray(above * (1 - fy) + below * fy, np.float32)


def linear(picture: U8) -> F32:
    """Linear light of sRGB bytes."""
    return colour.linear(np.arange(256) / 255.0).astype(np.float32)[picture]


def encoded(light: F32) -> U8:
    """sRGB bytes of linear light."""
    return np.asarray(colour.srgb(np.clip(light, 0.0, 1.0)) * 255.0 + 0.5, np.uint8)


def smoothed(of: Map, sigma: float) -> Map:
    """The map without detail finer than `sigma` [m]."""
    return Map(_blurred(of.height, sigma / of.step, of.wraps), of.step, of.wraps)


def _blurred(height: F32, sigma: float, wraps: bool) -> F32:
    """Gaussian of `sigma` texels; edges are repeated, or wrap to the left and right."""
    if sigma <= 0.0:
        return height
    reach = min(math.ceil(3.0 * sigma), max(height.shape))
    rows, columns = np.flatnonzero(height.any(axis=1)), np.flatnonzero(height.any(axis=0))
    if len(rows) == 0:
        return height
    # Most of a map is flat and stays flat.
    top, bottom = max(0, rows[0] - reach), min(height.shape[0], rows[-1] + reach + 1)
    left, right = int(columns[0]) - reach, int(columns[-1]) + reach + 1
    if left < 0 or right > height.shape[1]:
        left, right = 0, height.shape[1]
    out = np.zeros_like(height)
    whole = right - left == height.shape[1]
    out[top:bottom, left:right] = _transformed(height[top:bottom, left:right], sigma, reach, wraps and whole)
    return out


def _transformed(height: F32, sigma: float, reach: int, wraps: bool) -> F32:
    padded = np.pad(height, ((reach, reach), (0, 0)), mode="edge")
    padded = np.pad(padded, ((0, 0), (reach, reach)), mode="wrap" if wraps else "edge")
    fy, fx = np.fft.fftfreq(padded.shape[0])[:, None], np.fft.rfftfreq(padded.shape[1])[None]
    gain = np.exp(-2.0 * (math.pi * sigma) ** 2 * (fx * fx + fy * fy))
    out = np.fft.irfft2(np.fft.rfft2(padded) * gain, padded.shape)
    return out[reach : reach + height.shape[0], reach : reach + height.shape[1]].astype(np.float32)


def _solved(source: Float, step: float) -> F32:
    """(H, W, 2) the curl-free field, right and up, whose divergence is `source` less its mean; edges wrap."""
    rows, columns = source.shape
    ky = 2.0 * math.pi * np.fft.fftfreq(rows, step)[:, None]
    kx = 2.0 * math.pi * np.fft.rfftfreq(columns, step)[None]
    square = kx * kx + ky * ky
    square[0, 0] = 1.0
    potential = -np.fft.rfft2(source) / square
    potential[0, 0] = 0.0
    right = np.fft.irfft2(1j * kx * potential, source.shape)
    down = np.fft.irfft2(1j * ky * potential, source.shape)
    return np.stack((right, -down), axis=2).astype(np.float32)
