"""What skin is like besides its colour: how rough and how uneven, as a patch of the whole texture."""

import numpy as np

from vistel.figure.avatar.patch import WHOLE, Patch
from vistel.figure.body_model.lid_rims import lid_rims
from vistel.figure.body_model.model import BodyModel
from vistel.figure.body_model.texels import between_lips, mask, noise
from vistel.geometry.smoothstep import smooth

_FACE = 0.72, 0.50
"""Middle of the face in the texture."""
_TEXEL = 0.7
"""Of a texel's sides on a face [mm]."""
_FOLD = 0.55
"""Depth of the deepest fold of an old face [mm]."""
_WET = {"eye": (0.08, 0.70), "tongue": (0.50, 0.45), "upper_teeth": (0.30, 0.75), "lower_teeth": (0.35, 0.55)}
"""Roughness of what is smooth, and how much of the light from everywhere comes there."""


def relief(model: BodyModel, rng: np.random.Generator, folded: float, stubbly: float) -> Patch:
    """folded: how deep folds are, 0 of young people .. 1; stubbly: 0 .. 1."""
    size = model.masks["skin"].shape
    lips, oil, scalp, folds = (mask(model, name) for name in ("lips", "oil", "scalp", "folds"))
    fine, middling = noise(rng, size, (2, 2)), noise(rng, size, (5, 5))
    across_lips = noise(rng, size, (3, 40))
    v, u = np.linspace(1.0, 0.0, size[0], dtype=np.float32)[:, None], np.linspace(0.0, 1.0, size[1], dtype=np.float32)
    # Away from the face texels are longer than wide: pores would become lines.
    small = 1.0 - 0.8 * smooth((np.hypot(2.0 * (u - _FACE[0]), v - _FACE[1]) - 0.20) / 0.15)
    height = small * (0.020 * fine + 0.030 * middling) * (1.0 - 0.8 * lips) * (1.0 + 0.8 * folded)
    height += 0.030 * across_lips * lips - _FOLD * folded * folds
    height += 0.05 * stubbly * mask(model, "beard") * fine
    rough = 0.62 - 0.09 * oil - 0.15 * lips + 0.20 * scalp + 0.03 * middling + 0.03 * folded
    rough = np.where(mask(model, "inside") > 0.5, 0.55, rough - 0.25 * mask(model, "nails"))
    rims = lid_rims(model)
    rough = rough + (0.42 - rough) * rims.rim
    rough = rough + (0.14 - rough) * np.maximum(rims.wet, rims.duct)
    # Between lips there is little to mirror.
    wet = between_lips(model, 22.0)
    rough += 0.30 * wet
    open_share = (1.0 - 0.5 * folded * folds) * (1.0 - 0.9 * wet) * (1.0 - 0.65 * mask(model, "inside"))
    rough += (0.85 - rough) * np.maximum(mask(model, "top"), mask(model, "shorts"))
    for name, (smoothness, reached) in _WET.items():
        u0, v0, u1, v1 = model.boxes[name]
        rows, columns = (
            slice(round((1.0 - v1) * size[0]), round((1.0 - v0) * size[0])),
            slice(round(u0 * size[1]), round(u1 * size[1])),
        )
        rough[rows, columns], open_share[rows, columns], height[rows, columns] = smoothness, reached, 0.0
    open_share, rough = open_share[::2, ::2], rough[::2, ::2]
    finish = np.stack([open_share, np.clip(rough, 0.05, 1.0), np.zeros_like(rough)], axis=-1)
    down, right = np.gradient(height, _TEXEL)
    up = 1.0 / np.sqrt(1.0 + right**2 + down**2)
    normal = np.stack([-right * up, down * up, up], axis=-1)
    return Patch(WHOLE, finish=np.round(255.0 * finish).astype(np.uint8), normal=np.round(127.0 * normal + 128.0).astype(np.uint8))
