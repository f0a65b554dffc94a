"""The rims of the lids in the model's texture: skin between the lashes and the eyeball, wet where both meet, and the tear duct."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32, F64
from vistel.figure.body_model.model import BodyModel
from vistel.figure.body_model.texels import between
from vistel.geometry.smoothstep import smooth

_NEAR = 0.008
"""Skin that counts is so near to the eyeball [m]."""
_SOCKET = 0.3
"""What has less u than this is the hollow behind the eyeball."""
_RIM = 0.0016, 0.0022
"""A rim is nearer to the eyeball than the one; beyond the other there is none [m]."""
_WET = 0.0004, 0.0011
"""Tears stand up to the one; beyond the other rims are dry [m]."""
_DUCT = -0.0105, -0.0012
"""Of the tear duct from the middle of the left eye, towards the side and up [m]."""
_DUCT_RADIUS = 0.0034
"""From its middle to where it ends [m]."""


@dataclass(frozen=True, eq=False)
class LidRims:
    """(H, W), 0 to 1 each. rim: skin inside of the lashes; wet: where tears stand; duct: the pink flesh in the inner corner."""

    rim: F32
    wet: F32
    duct: F32


def lid_rims(model: BodyModel) -> LidRims:
    """Of both eyes of the base's head: all people have them at the same place of the texture."""
    level, shape = model.levels[0], model.stood(model.base.astype(np.float64))
    size = model.masks["skin"].shape
    rim, wet, duct = (np.zeros(size, np.float32) for _ in range(3))
    vertex = level.vertex[level.corner_vertex]
    for middle, side in zip(shape.eyes, (1.0, -1.0), strict=True):
        from_eye: F64 = shape.points[vertex] - middle
        deep = np.linalg.norm(from_eye, axis=1) - shape.eye_radius
        near = (deep < _NEAR) & (from_eye[:, 2] > 0.0) & (vertex < model.body) & (level.uv[:, 0] > _SOCKET)
        box, told = between(level.uv[near], np.column_stack([deep, from_eye])[near], size)
        away = np.hypot(side * told[..., 1] - _DUCT[0], told[..., 2] - _DUCT[1])
        rim[box] = np.maximum(rim[box], smooth((_RIM[1] - told[..., 0]) / (_RIM[1] - _RIM[0])))
        wet[box] = np.maximum(wet[box], smooth((_WET[1] - told[..., 0]) / (_WET[1] - _WET[0])))
        inner = smooth((0.0034 - told[..., 0]) / 0.001)
        duct[box] = np.maximum(duct[box], inner * smooth((_DUCT_RADIUS - away) / 0.0016))
    return LidRims(rim, wet, duct)
