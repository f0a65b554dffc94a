"""What is sewn on trousers: seams, flies, pockets, creases, belts, as lines of stitches and height over their panels."""

import numpy as np

from vistel.figure.clothes.build import Build
from vistel.figure.clothes.sheet import Paint
from vistel.figure.clothes.tops import painter
from vistel.figure.clothes.weave import Colour, Floats, Look, Weave

_LEATHER: Colour = (44, 34, 28)
_METAL: Colour = (168, 162, 148)
_STITCH: Colour = (176, 132, 84)


def trouser_painter(build: Build, weave: Weave, seed: int, *, jeans: bool, belt: bool) -> Paint:
    """The look of trousers or jeans, with a belt or without."""
    plain, scale = painter(weave, seed), build.scale
    top = build.waist - float(build.joint("left_upper_leg")[1])
    half = [0.5 * np.pi * tube.around for tube in build.legs]

    def paint(panel: str, u: Floats, v: Floats) -> Look:
        if panel == "buckle":
            return Look(np.broadcast_to(np.array(_METAL, np.float32), (*u.shape, 3)), np.zeros_like(u))
        look = plain(panel, u, v)
        if panel == "waistband" and belt:
            edge = np.exp(-np.square((np.abs(v + 0.017 * scale) - 0.015 * scale) / 0.002))
            return Look(np.array(_LEATHER, np.float32) * (1.0 - 0.3 * edge)[..., None], look.height)
        if "leg" not in panel:
            return look
        side = half[panel.startswith("right")]
        # From the outer seam inwards, and from the waist down.
        out = side - u if panel.startswith("left") != panel.endswith("back") else side + u
        low = top - v
        seam = np.minimum(np.abs(out), np.abs(2.0 * side - out))
        lines = [seam]
        if panel.endswith("back"):
            lines.append(_box(out - 1.02 * side, low - 0.135 * scale, 0.062 * scale, 0.066 * scale))
        else:
            slant = np.hypot(out - 0.02 * scale, 0.55 * low) - 0.075 * scale
            lines.append(np.where(low < 0.17 * scale, np.abs(slant), 1.0))
            if jeans:
                fly = np.abs(2.0 * side - out - 0.036 * scale)
                lines.append(np.where(low < 0.15 * scale, fly, 1.0))
        near = np.min(lines, axis=0)
        if jeans:
            return _stitched(look, near, v + u)
        crease = np.exp(-np.square(u / 0.0045)) * np.clip((low - 0.12 * scale) / (0.15 * scale), 0.0, 1.0)
        line = np.exp(-np.square(near / 0.0020))
        colour = look.colour * (1.0 + 0.05 * crease - 0.20 * line)[..., None]
        return Look(colour, look.height + 0.0011 * crease - 0.0005 * line)

    return paint


def _box(x: Floats, y: Floats, half_width: float, half_height: float) -> Floats:
    """How far places are from the outline of a box [m]."""
    return np.abs(np.maximum(np.abs(x) - half_width, np.abs(y) - half_height))


def _stitched(look: Look, near: Floats, along: Floats) -> Look:
    """With a seam where `near` is 0, and stitches beside it, which are worn lighter."""
    ridge = np.exp(-np.square(near / 0.0025))
    thread = np.exp(-np.square((near - 0.0045) / 0.0016)) * (0.6 + 0.4 * np.cos(2.0 * np.pi * along / 0.007))
    worn = np.exp(-np.square(near / 0.008))
    colour = look.colour * (1.0 + 0.10 * worn - 0.28 * ridge)[..., None]
    colour = colour + 0.55 * thread[..., None] * (np.array(_STITCH, np.float32) - colour)
    return Look(colour, look.height + 0.0006 * worn - 0.0006 * ridge)
