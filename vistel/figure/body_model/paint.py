"""The texture of a person: skin, lips, nails, brows, eyes, teeth, stubble and plain clothes, by the model's masks."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64, U8
from vistel.figure.avatar.patch import Patch
from vistel.figure.body_model import hairs
from vistel.figure.body_model.eye_paint import eye
from vistel.figure.body_model.lid_rims import lid_rims
from vistel.figure.body_model.model import BodyModel
from vistel.figure.body_model.mouth_paint import in_mouth, inside
from vistel.figure.body_model.relief import relief
from vistel.figure.body_model.texels import Colour, Floats, between_lips, mask, noise, over, put, soft, spread, texels
from vistel.geometry.smoothstep import smooth

TONES: tuple[Colour, ...] = ((223, 181, 160), (213, 163, 135), (194, 143, 110), (163, 112, 80), (117, 77, 55), (73, 50, 41))
"""sRGB of skin, evenly from the lightest (0) to the darkest (1)."""
_RIM = (214.0, 146.0, 134.0)
_DUCT = (206.0, 118.0, 108.0)


@dataclass(frozen=True)
class Colours:
    """What the model does not know of a person. skin: 0 the lightest .. 1 the darkest tone; stubble: of the beard, brows:
    how bushy, freckles, grey: share of the hair that is, lips: how red: 0 none .. 1; age [years]; others: sRGB 0
    to 255, None for skin. seed: of what differs from texel to texel."""

    skin: float = 0.25
    iris: Colour = (92, 64, 42)
    hair: Colour = (52, 38, 30)
    top: Colour | None = (74, 92, 118)
    shorts: Colour | None = (52, 56, 66)
    stubble: float = 0.0
    brows: float = 0.5
    freckles: float = 0.0
    grey: float = 0.0
    lips: float = 0.5
    age: float = 30.0
    seed: int = 0


def tone(skin: float) -> F64:
    """(3,) sRGB of a skin from the lightest, 0, to the darkest, 1."""
    at = min(max(skin, 0.0), 1.0) * (len(TONES) - 1)
    places, tones = np.arange(len(TONES)), np.array(TONES)
    return np.array([float(np.interp(at, places, tones[:, k])) for k in range(3)])


def paint(model: BodyModel, colours: Colours) -> tuple[U8, tuple[Patch, ...]]:
    """The texture (H, W, 3), and the patches of all of it and of its lashes."""
    size = model.masks["skin"].shape
    rng = np.random.default_rng(colours.seed)
    old = float(smooth((colours.age - 28.0) / 52.0))
    out = _skin(model, colours, rng, old)
    hair = np.array(colours.hair, np.float32)
    skin = tone(colours.skin).astype(np.float32)
    if colours.stubble:
        over(out, 0.45 * hair + 0.30 * skin, colours.stubble * hairs.stubble(rng, size, mask(model, "beard")))
    brow = mask(model, "brows")
    # Skin is darker between the hairs.
    over(out, 0.5 * hair + 0.5 * skin, 0.45 * smooth((brow - 0.35) / 0.5))
    grey = 0.5 * colours.grey * np.array((150.0, 147.0, 144.0), np.float32) + (1.0 - 0.5 * colours.grey) * 0.72 * hair
    over(out, grey, 0.92 * hairs.brows(brow, rng, colours.brows))
    inside(model, out)
    weave = 1.0 + 0.05 * noise(rng, size, (3, 3))[..., None] + 0.03 * noise(rng, size, (96, 96))[..., None]
    for cloth, colour in (("top", colours.top), ("shorts", colours.shorts)):
        if colour is not None:
            over(out, np.array(colour, np.float32) * weave, mask(model, cloth))
    if colours.top is not None or colours.shorts is not None:
        over(out, out * 0.78, mask(model, "seam"))
    picture = spread(np.clip(out, 0.0, 255.0).astype(np.uint8), model.masks["skin"] > 0)
    _parts(model, picture, colours, rng)
    lash = model.boxes["lashes"]
    put(picture, lash, np.broadcast_to(0.35 * hair, (*texels(lash, size), 3)))
    return picture, (relief(model, rng, old, colours.stubble), hairs.lashes(lash, rng))


def _skin(model: BodyModel, colours: Colours, rng: np.random.Generator, old: float) -> Floats:
    """(H, W, 3) bare skin with lips and nails. old: 0 .. 1."""
    size = model.masks["skin"].shape
    skin = tone(colours.skin).astype(np.float32)
    dark = 1.0 - float(skin.mean()) / 255.0
    light = 1.0 - 0.55 * dark
    mottle, blotch, fine, grain = (noise(rng, size, (n, n)) for n in (96, 28, 6, 2))
    out: Floats = skin * (1.0 + 0.028 * mottle + 0.022 * blotch + 0.020 * fine + 0.018 * grain)[..., None]
    flush = np.clip(mask(model, "flush") * (0.85 + 0.3 * blotch), 0.0, 1.2)
    red = (0.55 + 0.15 * colours.lips) * flush + 0.08 * mottle + 0.10 * blotch + 0.08 * fine
    out *= 1.0 + red[..., None] * np.array((0.02, -0.20, -0.17), np.float32) * light
    palms = mask(model, "palms")[..., None]
    # Little of what darkens skin is in palms and soles.
    out += palms * ((0.35 + 0.35 * dark) * (np.array((226.0, 168.0, 146.0), np.float32) - out))
    lids = mask(model, "lids")[..., None]
    out *= 1.0 - lids * (np.array((0.13, 0.19, 0.16), np.float32) * (1.0 + 0.5 * old))
    rims = lid_rims(model)
    over(out, 0.55 * np.array(_RIM, np.float32) + 0.45 * skin, 0.75 * rims.rim)
    over(out, np.array(_DUCT, np.float32) * (0.55 + 0.45 * light), 0.9 * rims.duct)
    sun = mask(model, "sun")
    known = model.masks["skin"] > 0
    if colours.freckles:
        where = hairs.spots(rng, colours.freckles * (sun + 0.08), known, 34.0, (0.8, 1.7))
        over(out, skin * np.array((0.74, 0.60, 0.50), np.float32), 0.55 * where)
    if old > 0.0:
        where = hairs.spots(rng, old * (0.5 * sun + 0.08), known, 420.0, (1.5, 4.0))
        over(out, skin * np.array((0.80, 0.68, 0.60), np.float32), 0.45 * where)
        out *= 1.0 - (0.16 * old * mask(model, "folds"))[..., None] * np.array((0.8, 1.1, 1.1), np.float32)
    if colours.stubble:
        over(out, skin * np.array((0.86, 0.87, 0.90), np.float32), 0.35 * colours.stubble * mask(model, "beard"))
    lip = skin * (1.0 + (0.52 + 0.35 * colours.lips) * (1.0 - 0.45 * old) * np.array((-0.08, -0.34, -0.28), np.float32))
    lines = noise(rng, size, (3, 40))
    over(out, lip * (1.0 + 0.035 * fine + 0.045 * lines)[..., None], 0.92 * soft(mask(model, "lips")))
    # Where lips touch they are darker: light does not reach there.
    out *= 1.0 - 0.55 * between_lips(model, 18.0)[..., None] * np.array((0.85, 1.0, 1.0), np.float32)
    nail = 0.35 * skin + 0.65 * np.array((232, 186, 176), np.float32) * (1.0 - 0.5 * dark)
    over(out, nail, 0.85 * mask(model, "nails"))
    return out


def _parts(model: BodyModel, picture: U8, colours: Colours, rng: np.random.Generator) -> None:
    """Eyes, teeth and tongue, in place."""
    size = picture.shape[:2]
    box = model.boxes["eye"]
    put(picture, box, eye(rng, np.array(colours.iris, np.float64), texels(box, size), colours.age))
    in_mouth(model, picture, rng)
