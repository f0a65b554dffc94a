"""Previews of wrinkles: a shape's curves, and a shape on cloth or skin."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import U8
from vistel.wrinkle.curve import sampled
from vistel.wrinkle.displacement import Map, displacement_map
from vistel.wrinkle.instance import Instance
from vistel.wrinkle.shape import WrinkleShape
from vistel.wrinkle.texture import Lighting, wrinkled_texture

CLOTH = (112, 134, 170)
"""Colour of plain cloth, sRGB."""
SKIN = (222, 178, 152)
"""Colour of plain skin, sRGB."""
MARGIN = 1.35
"""Half the side of a picture in the shape's unit."""


def typical(shape: WrinkleShape, *, wrinkledness: float = 0.0, seed: int = 0) -> tuple[Instance, float]:
    """The shape as large as it usually is, in the middle of a square plane, and the plane's side [m]."""
    unit, thickness, height = (0.09, 0.016, 0.0075) if shape.material == "cloth" else (0.03, 0.0032, 0.0011)
    side = 2.0 * MARGIN * unit
    return Instance(shape, (side / 2, side / 2), (unit, unit), thickness, height, 0.0, False, wrinkledness, seed), side


def light_on(shape: WrinkleShape) -> Lighting:
    """Light that suits a shape's material."""
    return Lighting() if shape.material == "cloth" else Lighting(depth=0.001)


def relief(shape: WrinkleShape, texels: int, *, wrinkledness: float = 0.0, seed: int = 0) -> U8:
    """(texels, texels, 3): the shape on plain cloth or skin, lit."""
    wrinkle, side = typical(shape, wrinkledness=wrinkledness, seed=seed)
    of = displacement_map([wrinkle], (side, side), texels)
    plain = np.full((*of.height.shape, 3), CLOTH if shape.material == "cloth" else SKIN, np.uint8)
    return wrinkled_texture(plain, of, light_on(shape))[0]


def drawing(shape: WrinkleShape, texels: int) -> U8:
    """(texels, texels, 3): the shape's curves, thicker and darker where they are; control points red."""
    picture = np.full((texels, texels, 3), 250, np.uint8)
    for branch in shape.branches:
        at, parameter = sampled(branch.places, 40)
        span = np.minimum(parameter.astype(int), len(branch.points) - 2)
        t = (parameter - span) ** 2 * (3.0 - 2.0 * (parameter - span))
        strength = branch.intensities[span] * (1 - t) + branch.intensities[span + 1] * t
        width = branch.thicknesses[span] * (1 - t) + branch.thicknesses[span + 1] * t
        for place, s, w in zip(at, np.abs(strength), width, strict=True):
            _dot(picture, place, 0.030 * w, int(220 - 190 * s) * np.ones(3))
        for place in branch.places:
            _dot(picture, place, 0.022, np.array((208, 60, 48)))
    return picture


def height_picture(of: Map) -> NDArray[np.uint16]:
    """(H, W) 16 bit: 32768 for no displacement, the largest one 0 or 65535."""
    most = float(np.abs(of.height).max(initial=0.0)) or 1.0
    return np.asarray(np.round(of.height / most * 32767.0 + 32768.0), np.uint16)


def sheet_of(pictures: Sequence[U8], columns: int) -> U8:
    """Pictures of one size side by side, `columns` to a row."""
    blank = np.full_like(pictures[0], 255)
    rows = -(-len(pictures) // columns)
    filled = [*pictures, *[blank] * (rows * columns - len(pictures))]
    return np.vstack([np.hstack(filled[r * columns : (r + 1) * columns]) for r in range(rows)])


def _dot(picture: U8, place: NDArray[np.float64], radius: float, colour: NDArray[np.floating]) -> None:
    """A disc; place and radius in the shape's unit; darker colours stay."""
    texels = len(picture)
    per_unit = texels / (2.0 * MARGIN)
    x, y, r = (place[0] + MARGIN) * per_unit, (MARGIN - place[1]) * per_unit, radius * per_unit
    i0, i1 = max(0, int(y - r)), min(texels, int(y + r) + 2)
    j0, j1 = max(0, int(x - r)), min(texels, int(x + r) + 2)
    i, j = np.mgrid[i0:i1, j0:j1]
    inside = np.hypot(j + 0.5 - x, i + 0.5 - y) <= r
    part = picture[i0:i1, j0:j1]
    part[inside] = np.minimum(part[inside], colour.astype(np.uint8)) if colour.std() == 0 else colour.astype(np.uint8)
