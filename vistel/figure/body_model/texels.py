"""Pictures in the model's texture coordinates: mixing, noise, edges."""

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFilter
from scipy.ndimage import distance_transform_edt

from vistel.arrays import F32, F64, I32, U8, Bool
from vistel.figure.avatar.atlas_kernels import rasterise
from vistel.figure.body_model.model import BodyModel
from vistel.geometry.smoothstep import smooth

Floats = NDArray[np.floating]
Colour = tuple[float, float, float]


def mask(model: BodyModel, name: str) -> F32:
    """(H, W) 0 to 1."""
    return model.masks[name].astype(np.float32) / 255.0


def over(out: Floats, colour: Floats, share: Floats) -> None:
    """Mix a colour (3,) or (H, W, 3) into the picture, in place, where the share is above 0."""
    on = share > 0.0
    s = share[on][:, None]
    out[on] = out[on] * (1.0 - s) + (colour[on] if colour.ndim == 3 else colour) * s


def noise(rng: np.random.Generator, size: tuple[int, ...], texels: tuple[int, int]) -> F32:
    """(H, W) smooth noise about 0, whose spots are some texels high and wide."""
    coarse = rng.standard_normal((size[0] // texels[0] + 2, size[1] // texels[1] + 2), np.float32)
    if texels == (1, 1):
        return coarse[: size[0], : size[1]]
    large = Image.fromarray(coarse).resize((coarse.shape[1] * texels[1], coarse.shape[0] * texels[0]), Image.Resampling.BICUBIC)
    return np.asarray(large, np.float32)[: size[0], : size[1]]


def spread(picture: U8, known: Bool) -> U8:
    """The picture with its parts' colours beyond their edges, so that filtering over them meets no other colour."""
    image = Image.fromarray(np.where(known[..., None], picture, 0).astype(np.uint8))
    cover = Image.fromarray(np.where(known, 255, 0).astype(np.uint8))
    out = picture.copy()
    filled = known.copy()
    for factor in (2, 4, 8, 16, 32):
        size = (max(1, image.width // factor), max(1, image.height // factor))
        colour = np.asarray(image.resize(size, Image.Resampling.BOX).resize(image.size, Image.Resampling.BILINEAR), np.float32)
        share = np.asarray(cover.resize(size, Image.Resampling.BOX).resize(image.size, Image.Resampling.BILINEAR), np.float32)
        new = ~filled & (share > 4.0)
        out[new] = np.clip(colour[new] * 255.0 / share[new][:, None], 0, 255).astype(np.uint8)
        filled |= new
    return out


def texels(box: F64, size: tuple[int, ...]) -> tuple[int, int]:
    """Height and width of a box in texels."""
    return round((box[3] - box[1]) * size[0]), round((box[2] - box[0]) * size[1])


def between(uv: F32, values: F64, size: tuple[int, ...]) -> tuple[tuple[slice, slice], F64]:
    """Rows and columns of a picture of `size` (H, W) that hold texture coordinates uv (N, 2), and there (h, w, K) what lies between
    values (N, K) at them; far away where there is none."""
    at = uv * (size[1], -size[0]) + (-0.5, size[0] - 0.5)
    low, high = np.maximum(np.floor(at.min(axis=0)).astype(int), 0), np.ceil(at.max(axis=0)).astype(int) + 1
    box = slice(low[1], min(high[1], size[0])), slice(low[0], min(high[0], size[1]))
    y, x = np.mgrid[box]
    scipy: Any = import_module("scipy.interpolate")  # slow to load, and only people who are made need it
    return box, np.asarray(scipy.griddata(at, values, (x, y), fill_value=1.0))


def on_triangles(uv: F32, triangles: I32, values: F64, size: tuple[int, ...], beyond: float) -> tuple[tuple[slice, slice], F32]:
    """Rows and columns of a picture of `size` (H, W) that hold triangles (F, 3) of texture coordinates uv (N, 2), and there (h, w)
    what values (N,) at these say, up to so many texels `beyond` the triangles; -inf farther away."""
    at = np.column_stack([uv[:, 0] * size[1], (1.0 - uv[:, 1]) * size[0]]).astype(np.float64)
    used = at[triangles].reshape(-1, 2)
    low = np.maximum(np.floor(used.min(axis=0) - beyond).astype(int), 0)
    high = np.minimum(np.ceil(used.max(axis=0) + beyond).astype(int), size[1::-1])
    (left, top), (wide, tall) = low, high - low
    side = int(max(wide, tall))
    square = np.column_stack([at[:, 0] - left, side - (at[:, 1] - top)]) / side
    owner, weight = rasterise(square, triangles.astype(np.int64), side)
    of, share = owner[:tall, :wide], weight[:tall, :wide]
    first, second, third = (values[triangles[of, k]] for k in range(3))
    there = third + share[..., 0] * (first - third) + share[..., 1] * (second - third)
    nearest: Any = distance_transform_edt(of < 0, return_indices=True)
    away, (row, column) = nearest
    box = slice(int(top), int(top + tall)), slice(int(left), int(left + wide))
    return box, np.where(away <= beyond, there[row, column], -np.inf).astype(np.float32)


def put(picture: U8, box: F64, part: Floats) -> None:
    """Lay a picture (h, w, 3), first row at the top, into a box of texture coordinates."""
    top, left = round((1.0 - box[3]) * picture.shape[0]), round(box[0] * picture.shape[1])
    picture[top : top + part.shape[0], left : left + part.shape[1]] = np.clip(part, 0, 255).astype(np.uint8)


def soft(shape: F32, texels: float = 2.5) -> F32:
    """A mask with edges as soft as so many texels."""
    image = Image.fromarray(np.round(255.0 * shape).astype(np.uint8)).filter(ImageFilter.GaussianBlur(texels))
    return np.asarray(image, np.float32) / 255.0


def between_lips(model: BodyModel, reach: float) -> F32:
    """(H, W) 1 at the inner edges of the lips, nothing `reach` texels before them."""
    lips, out = model.masks["lips"] > 127, np.zeros(model.masks["lips"].shape, np.float32)
    rows, columns = np.nonzero(lips)
    box = slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)
    away = distance_transform_edt(model.masks["skin"][box] > 0)
    out[box] = smooth(1.0 - np.asarray(away, np.float32) / reach)
    return out
