"""What is in a mouth, in the texture: teeth, gums, tongue, and the skin behind the lips, the darker the deeper."""

import numpy as np

from vistel.arrays import F64, U8
from vistel.figure.body_model.model import BodyModel
from vistel.figure.body_model.texels import Colour, Floats, between, noise, put, texels
from vistel.geometry.smoothstep import smooth

_TEETH: Colour = (226.0, 218.0, 202.0)
_TONGUE: Colour = (194.0, 104.0, 98.0)
_INSIDE: Colour = (160.0, 70.0, 64.0)
_GAPS = 14
"""Teeth in a row."""
_DEEP = {"mouth": (0.014, -0.045), "tongue": (-0.012, -0.052)}
"""Light comes in as far as the one; behind the other there is little of it [m before the eyes]."""
_LEAST = 0.35
"""Of the light there."""


def inside(model: BodyModel, out: Floats) -> None:
    """Skin behind the lips, in place; out: (H, W, 3)."""
    _deepened(model, out, "mouth", _INSIDE)


def in_mouth(model: BodyModel, picture: U8, rng: np.random.Generator) -> None:
    """Teeth and tongue, in place; picture: (H, W, 3)."""
    size = picture.shape[:2]
    for name in ("upper_teeth", "lower_teeth"):
        box = model.boxes[name]
        high, wide = texels(box, size)
        put(picture, box, _teeth(high, wide))
    high, wide = texels(model.boxes["tongue"], size)
    across = np.linspace(-1.0, 1.0, wide)
    rough = 1.0 + 0.05 * noise(rng, (high, wide), (2, 2)) - 0.16 * np.exp(-np.square(across / 0.10))
    put(picture, model.boxes["tongue"], np.array(_TONGUE) * rough[..., None])
    _deepened(model, picture, "tongue")


def _teeth(high: int, wide: int) -> F64:
    """(high, wide, 3) a row from side to side."""
    u = np.linspace(0.0, 1.0, wide)
    gap, aside = np.abs(np.sin(np.pi * _GAPS * u)), np.abs(2.0 * u - 1.0)
    out = np.broadcast_to(np.array(_TEETH), (high, wide, 3)) * (1.0 - 0.30 * (gap < 0.16))[None, :, None]
    # Little light comes to the back teeth: lips that are not quite closed would show a white seam else.
    return out + smooth((aside - 0.24) / 0.34)[None, :, None] * (0.5 * np.array(_INSIDE) - out)


def _deepened(model: BodyModel, picture: Floats | U8, name: str, colour: Colour | None = None) -> None:
    """A part of the texture, in a colour if one is told: the darker the deeper it lies in the base's head."""
    level, (u0, v0, u1, v1) = model.levels[0], model.boxes[name]
    u, v = level.uv.T
    on = (u >= u0 - 1e-3) & (u <= u1 + 1e-3) & (v >= v0 - 1e-3) & (v <= v1 + 1e-3)
    ahead = (model.base[level.vertex[level.corner_vertex[on]], 2] - model.stood(model.base.astype(np.float64)).eyes[0, 2])[:, None]
    box, depth = between(level.uv[on], ahead.astype(np.float64), picture.shape[:2])
    out, deepest = _DEEP[name]
    light = _LEAST + (1.0 - _LEAST) * smooth((depth - deepest) / (out - deepest))
    part = picture[box]
    part[...] = np.where(depth < 0.9, light * (part if colour is None else np.array(colour)), part).astype(part.dtype)
