"""The colours of a built-in person, texel by texel, from the rest position, the material and the normal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vistel.figure.people import material
from vistel.figure.people.bake import rasterise, spread
from vistel.figure.people.field import Solid
from vistel.figure.people.head import EYE, EYE_RADIUS
from vistel.figure.people.recipe import Recipe

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]


def paint(
    recipe: Recipe, solid: Solid, parts: list[tuple[F64, I64]], corner_vertex: I64, uv: F64, corner_triangles: I64, size: int
) -> U8:
    """(size, size, 3) sRGB texture; parts are the skin mesh and the two eyeballs of the reference person."""
    owner, weight = rasterise(uv, corner_triangles, size)
    texel = owner >= 0
    corners = corner_triangles[owner[texel]]
    w = weight[texel].astype(np.float64)
    w = np.stack([w[:, 0], w[:, 1], 1.0 - w[:, 0] - w[:, 1]], axis=1)
    position = np.concatenate([v for v, _ in parts])[corner_vertex]
    p = np.einsum("nk,nkc->nc", w, position[corners])
    eye = owner[texel] >= len(parts[0][1])
    what = np.where(eye, material.EYE, solid.materials(p))
    colour = np.zeros((len(p), 3))
    for m, fill in (
        (material.SKIN, recipe.colour("skin")), (material.LIP, recipe.colour("skin")), (material.HAIR, recipe.colour("hair")),
        (material.TOP, recipe.colour("top")), (material.COLLAR, recipe.colour("top")), (material.TROUSERS, recipe.colour("trousers")),
        (material.SHOE, recipe.colour("shoes")), (material.SOLE, (40, 38, 36)),
    ):  # fmt: skip
        colour[what == m] = fill
    colour[what == material.LIP] *= (0.86, 0.62, 0.60)
    colour[eye] = _eye(recipe, p[eye])
    image = np.zeros((size, size, 3), np.uint8)
    image[texel] = np.clip(colour + 0.5, 0, 255).astype(np.uint8)
    spread(image, texel, 8)
    return image


def _eye(recipe: Recipe, p: F64) -> F64:
    """(N, 3) colours of points on the eyeballs: white, iris, pupil."""
    r = np.hypot(np.abs(p[:, 0]) - EYE[0], p[:, 1] - EYE[1]) / EYE_RADIUS
    out = np.full((len(p), 3), (236.0, 232.0, 226.0))
    front = p[:, 2] > EYE[2]
    out[front & (r < 0.49)] = recipe.colour("eyes")
    out[front & (r < 0.20)] = (12, 10, 10)
    return out
