"""The texture of a person: skin, lips, nails, brows, eyes, teeth, stubble and plain clothes, by the model's masks."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from vistel.arrays import F32, F64, U8, Bool
from vistel.figure.avatar.patch import Patch
from vistel.figure.body_model.assemble import EYE_POWER
from vistel.figure.body_model.model import BodyModel
from vistel.geometry.smoothstep import smooth

Colour = tuple[float, float, float]
Floats = NDArray[np.floating]

TONES: tuple[Colour, ...] = ((239, 205, 188), (227, 182, 156), (205, 155, 123), (170, 119, 86), (120, 79, 56), (74, 50, 40))
"""sRGB of skin, evenly from the lightest (0) to the darkest (1)."""
IRIS_ANGLE = np.radians(25.5)
"""Half the angle that an iris takes at the middle of its eyeball."""
_PUPIL = 0.36
"""Radius of the pupil, as a share of the iris's."""
_TEETH = (232.0, 226.0, 212.0)
_TONGUE = (186.0, 96.0, 94.0)
_INSIDE = (132.0, 52.0, 50.0)
_GAPS = 14
"""Teeth in a row."""


@dataclass(frozen=True)
class Colours:
    """What the model does not know of a person. skin: 0 the lightest .. 1 the darkest tone; stubble: of the beard, 0 none .. 1;
    others: sRGB 0 to 255, None for skin. grey: share of the hair that is; seed: of what differs from texel to texel."""

    skin: float = 0.25
    iris: Colour = (92, 64, 42)
    hair: Colour = (52, 38, 30)
    top: Colour | None = (74, 92, 118)
    shorts: Colour | None = (52, 56, 66)
    stubble: float = 0.0
    lips: float = 0.5
    seed: int = 0


def tone(skin: float) -> F64:
    """(3,) sRGB of a skin from the lightest, 0, to the darkest, 1."""
    at = min(max(skin, 0.0), 1.0) * (len(TONES) - 1)
    places, tones = np.arange(len(TONES)), np.array(TONES)
    return np.array([float(np.interp(at, places, tones[:, k])) for k in range(3)])


def paint(model: BodyModel, colours: Colours) -> tuple[U8, tuple[Patch, ...]]:
    """The texture (H, W, 3), and the patch of its lashes, which are seen through."""
    size = model.masks["skin"].shape
    rng = np.random.default_rng(colours.seed)
    skin = tone(colours.skin).astype(np.float32)
    dark = 1.0 - float(skin.mean()) / 255.0
    mottle, blotch, fine = (_noise(rng, size, (texels, texels)) for texels in (96, 28, 3))
    out: Floats = skin * (1.0 + 0.030 * mottle + 0.025 * blotch + 0.022 * fine)[..., None]
    red = 0.5 * _mask(model, "flush") * (0.85 + 0.3 * blotch) + 0.08 * mottle + 0.10 * blotch
    out *= 1.0 + red[..., None] * np.array((0.04, -0.19, -0.17), np.float32) * (1.0 - 0.55 * dark)
    lip = skin * (1.0 + (0.45 + 0.35 * colours.lips) * np.array((-0.10, -0.36, -0.31), np.float32))
    _over(out, lip * (1.0 + 0.05 * fine[..., None]), 0.9 * _mask(model, "lips"))
    _over(out, 0.35 * skin + 0.65 * np.array((232, 190, 180), np.float32) * (1.0 - 0.5 * dark), 0.75 * _mask(model, "nails"))
    hair = np.array(colours.hair, np.float32)
    stubble = 0.5 + 0.5 * np.clip(1.6 * _noise(rng, size, (1, 1)), -1.0, 1.0)
    # The head lies on its side in the texture: brows grow along its columns.
    strands = 0.5 + 0.5 * np.clip(1.6 * _noise(rng, size, (9, 1)), -1.0, 1.0)
    _over(out, hair, _mask(model, "scalp") * (0.80 + 0.18 * stubble))
    if colours.stubble:
        _over(out, 0.6 * hair + 0.25 * skin, colours.stubble * _mask(model, "beard") * (0.35 + 0.5 * stubble))
    brows = _mask(model, "brows")
    hairs = np.clip(1.5 * brows - 0.75 + 0.9 * strands * (brows > 0.0), 0.0, 1.0)
    _over(out, 0.85 * hair, 0.85 * hairs * np.minimum(1.0, 3.0 * brows))
    _over(out, np.array(_INSIDE, np.float32), _mask(model, "inside"))
    weave = 1.0 + 0.05 * fine[..., None] + 0.03 * mottle[..., None]
    for cloth, colour in (("top", colours.top), ("shorts", colours.shorts)):
        if colour is not None:
            _over(out, np.array(colour, np.float32) * weave, _mask(model, cloth))
    if colours.top is not None or colours.shorts is not None:
        _over(out, out * 0.78, _mask(model, "seam"))
    picture = _spread(np.clip(out, 0.0, 255.0).astype(np.uint8), model.masks["skin"] > 0)
    box = model.boxes["eye"]
    _put(picture, box, _eye(rng, np.array(colours.iris, np.float64), _texels(box, size)))
    for name, colour in (("upper_teeth", _TEETH), ("lower_teeth", _TEETH), ("tongue", _TONGUE)):
        box = model.boxes[name]
        high, wide = _texels(box, size)
        shade = np.ones((high, wide, 1))
        if name != "tongue":
            gap = np.abs(np.sin(np.linspace(0.0, np.pi * _GAPS, wide)))[None, :, None]
            aside = np.abs(np.linspace(-1.0, 1.0, wide))[None, :, None]
            # Little light comes to the back teeth: lips that are not quite closed would show a white seam else.
            shade *= (1.0 - 0.30 * (gap < 0.16)) * (1.0 - 0.78 * smooth((aside - 0.16) / 0.36))
        _put(picture, box, np.array(colour) * shade)
    box = model.boxes["lashes"]
    _put(picture, box, np.broadcast_to(0.4 * hair, (*_texels(box, size), 3)))
    return picture, (_lashes(box, rng),)


def _mask(model: BodyModel, name: str) -> F32:
    return model.masks[name].astype(np.float32) / 255.0


def _over(out: Floats, colour: Floats, share: Floats) -> None:
    """Mix a colour (3,) or (H, W, 3) into the picture, in place, where the share is above 0."""
    on = share > 0.0
    s = share[on][:, None]
    out[on] = out[on] * (1.0 - s) + (colour[on] if colour.ndim == 3 else colour) * s


def _noise(rng: np.random.Generator, size: tuple[int, ...], texels: tuple[int, int]) -> F32:
    """(H, W) smooth noise about 0, whose spots are some texels high and wide."""
    coarse = rng.standard_normal((size[0] // texels[0] + 2, size[1] // texels[1] + 2), np.float32)
    if texels == (1, 1):
        return coarse[: size[0], : size[1]]
    large = Image.fromarray(coarse).resize((coarse.shape[1] * texels[1], coarse.shape[0] * texels[0]), Image.Resampling.BICUBIC)
    return np.asarray(large, np.float32)[: size[0], : size[1]]


def _spread(picture: U8, known: Bool) -> U8:
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


def _texels(box: F64, size: tuple[int, ...]) -> tuple[int, int]:
    """Height and width of a box in texels."""
    return round((box[3] - box[1]) * size[0]), round((box[2] - box[0]) * size[1])


def _put(picture: U8, box: F64, part: Floats) -> None:
    """Lay a picture (h, w, 3), first row at the top, into a box of texture coordinates."""
    top, left = round((1.0 - box[3]) * picture.shape[0]), round(box[0] * picture.shape[1])
    picture[top : top + part.shape[0], left : left + part.shape[1]] = np.clip(part, 0, 255).astype(np.uint8)


def _eye(rng: np.random.Generator, colour: F64, size: tuple[int, int]) -> F64:
    """(h, w, 3) an eyeball from the front, its back at the edge: see `EYE_POWER`."""
    y, x = np.mgrid[1.0 : -1.0 : 1j * size[0], -1.0 : 1.0 : 1j * size[1]]
    angle = np.pi * np.minimum(np.hypot(x, y), 1.0) ** (1.0 / EYE_POWER)
    r, around = angle / IRIS_ANGLE, np.arctan2(y, x)
    sclera = np.array((240.0, 234.0, 228.0)) - np.clip(r - 1.4, 0.0, 4.0)[..., None] * (7.0, 22.0, 22.0)
    fibres = np.zeros_like(r)
    for n in range(9, 60, 5):
        fibres += rng.uniform(0.02, 0.06) * np.cos(n * around + rng.uniform(0.0, 6.28) + 2.0 * r)
    shade = 0.62 + 0.50 * np.clip(1.0 - np.abs(r - 0.55) / 0.5, 0.0, 1.0) + fibres
    shade = shade * (1.0 - 0.55 * smooth((r - 0.80) / 0.2))  # the dark ring at its edge
    iris = colour * shade[..., None] + np.clip(0.62 - r, 0.0, 1.0)[..., None] * (30.0, 22.0, 8.0)
    out = iris + (sclera - iris) * smooth((r - 0.96) / 0.12)[..., None]
    return out * smooth((r - _PUPIL) / 0.07)[..., None] + 8.0 * (1.0 - smooth((r - _PUPIL) / 0.07))[..., None]


def _lashes(box: F64, rng: np.random.Generator) -> Patch:
    """Of the lower lids (upper half) and the upper lids: hairs from root to tip, thinner to their ends."""
    high, wide = 96, 640
    v, u = np.mgrid[1.0 : 0.0 : 1j * high, 0.0 : 1.0 : 1j * wide]
    rows: list[F64] = []
    for count, longest, thick in ((34, 0.50, 0.0045), (64, 0.90, 0.0060)):
        cover = np.zeros_like(u)
        for root in np.linspace(0.03, 0.97, count) + rng.uniform(-0.006, 0.006, count):
            length = longest * rng.uniform(0.75, 1.0)
            lean = 0.10 * (root - 0.4) + rng.uniform(-0.012, 0.012)
            along = np.clip((v - 0.1) / length, 0.0, 1.0)
            half = thick * (1.0 - along)
            cover = np.maximum(
                cover, np.clip((half - np.abs(u - root - lean * along)) / 0.0016 + 0.5, 0.0, 1.0) * (v < 0.1 + length)
            )
        rows.append(cover)
    opacity = np.round(255.0 * np.concatenate(rows)).astype(np.uint8)
    u0, v0, u1, v1 = box.tolist()
    return Patch((u0, v0, u1, v1), roughness=0.7, opacity=opacity, cutoff=0.35, both_sides=True)
