"""The texture of a built-in person, texel by texel, from the rest position, the material and the normal."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vistel.arrays import F64, I32, I64, U8
from vistel.figure.people import cloth, material
from vistel.figure.people.bake_kernels import rasterise, spread
from vistel.figure.people.field import Solid
from vistel.figure.people.hair import paint_hair, strands
from vistel.figure.people.head import EYE, EYE_RADIUS
from vistel.figure.people.mouth import Mouth, shade
from vistel.figure.people.noise_kernels import noise
from vistel.figure.people.recipe import Recipe
from vistel.figure.people.reduce import normals
from vistel.figure.people.skin import paint_lip, paint_skin
from vistel.figure.people.trunk import collar_height, within_collar
from vistel.geometry.smoothstep import smoothstep
from vistel.implicit.constants import THRESHOLD

_PAINTERS: dict[int, Callable[[Recipe, F64, F64], F64]] = {
    material.SKIN: paint_skin,
    material.LIP: paint_lip,
    material.HAIR: paint_hair,
    material.TOP: cloth.paint_top,
    material.COLLAR: cloth.paint_collar,
    material.TROUSERS: cloth.paint_trousers,
    material.SHOE: cloth.paint_shoe,
    material.SOLE: cloth.paint_sole,
}
_SOFT = 0.0007  # half width of the seam between two materials [m]


def paint(
    recipe: Recipe,
    solid: Solid,
    parts: list[tuple[F64, I64]],
    mouth: Mouth,
    corner_vertex: I64,
    uv: F64,
    corner_triangles: I64,
    size: int,
) -> U8:
    """(size, size, 3) sRGB texture; parts are the skin mesh, with its mouth, and the two eyeballs of the reference person."""
    owner, weight = rasterise(uv, corner_triangles, size)
    texel = owner >= 0
    corners = corner_vertex[corner_triangles[owner[texel]]]
    w = weight[texel].astype(np.float64)
    w = np.stack([w[:, 0], w[:, 1], 1.0 - w[:, 0] - w[:, 1]], axis=1)
    normal_at = np.concatenate([normals(v, t) for v, t in parts])
    light_at = np.concatenate([_openness(solid, parts[0][0], normal_at), *(np.ones(len(v)) for v, _ in parts[1:])])
    p = _at(np.concatenate([v for v, _ in parts]), corners, w)
    n = _at(normal_at, corners, w)
    n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-9)
    light = np.einsum("nk,nk->n", w, light_at[corners])
    eye = owner[texel] >= len(parts[0][1])
    inside = ~eye & (owner[texel] >= mouth.face)
    skin = ~(eye | inside)
    colour = np.empty((len(p), 3))
    colour[eye] = _eye(recipe, p[eye])
    colour[skin] = _surface(recipe, solid, p[skin], n[skin])
    # The hollows a lamp never reaches, a little warm; ends of sleeves and legs show their dark inside.
    colour[skin] *= 1.0 - 0.55 * _insides(p[skin], n[skin])[:, None]
    colour *= 1.0 - (1.0 - light[:, None]) * np.array((0.50, 0.56, 0.58))
    inner = np.zeros((len(normal_at), 3))
    inner[: len(mouth.colour)] = mouth.colour
    colour[inside] = shade(p[inside], _at(inner, corners[inside], w[inside]))
    image = np.zeros((size, size, 3), np.uint8)
    image[texel] = np.clip(colour + 0.5, 0, 255).astype(np.uint8)
    spread(image, texel, 8)
    return image


def _at(values: F64, corners: I64, weight: F64) -> F64:
    return sum((weight[:, k, None] * values[corners[:, k]] for k in range(3)), np.zeros((len(corners), 3)))


def _surface(recipe: Recipe, solid: Solid, p: F64, n: F64) -> F64:
    first, second, margin = solid.materials(p)
    first, second = _neckline(recipe, first, p), _neckline(recipe, second, p)
    second = np.where(second == 0, first, second)
    # Hair thins out at its edge instead of stopping at a line.
    hairline = ((first == material.HAIR) & (second == material.SKIN)) | ((first == material.SKIN) & (second == material.HAIR))
    sign = np.where(first == material.HAIR, 1.0, -1.0)
    lead = np.where(hairline, sign * margin, margin)
    lead[hairline] += 0.0032 * strands(recipe, p[hairline]) + 0.0006 * noise(p[hairline] / 0.0025, 1, recipe.seed + 71)
    soft = np.where(hairline, 0.0009, np.where((first == material.LIP) | (second == material.LIP), 0.0012, _SOFT))
    share = 0.5 + 0.5 * np.clip(lead / soft, -1.0, 1.0)
    a = np.where(hairline, material.HAIR, first)
    b = np.where(hairline, material.SKIN, second)
    out = np.zeros((len(p), 3))
    for m, painter in _PAINTERS.items():
        for which, amount in ((a, share), (b, 1.0 - share)):
            here = (which == m) & (amount > 0.0)
            if here.any():
                out[here] += amount[here, None] * painter(recipe, p[here], n[here])
    return out


def _neckline(recipe: Recipe, what: I32, p: F64) -> I32:
    """Bare above and within the collar's ring, cloth outside it, whichever muscle carries the surface there."""
    near = (p[:, 1] > 1.43) & (p[:, 1] < 1.53) & (np.abs(p[:, 0]) < 0.13)
    inside = within_collar(recipe, p) & (p[:, 1] > collar_height(recipe, p[:, 2]))
    above = (p[:, 1] > collar_height(recipe, p[:, 2]) + 0.008) & (p[:, 1] < 1.56) & (np.abs(p[:, 0]) < 0.085)
    out = np.where(((near & inside) | above) & (what == material.TOP), material.SKIN, what)
    return np.where(
        near & ~within_collar(recipe, p) & (p[:, 1] < collar_height(recipe, p[:, 2])) & (what == material.SKIN), material.TOP, out
    ).astype(np.int32)


def _insides(p: F64, n: F64) -> F64:
    """(N,) 1 where a sleeve or a trouser leg ends."""
    side = np.abs(p[:, 0])
    cuff = smoothstep(0.55, 0.85, n[:, 0] * np.sign(p[:, 0])) * (side > 0.700) * (side < 0.722)
    hem = smoothstep(-0.55, -0.85, n[:, 1]) * (p[:, 1] > 0.048) * (p[:, 1] < 0.085) * (p[:, 2] < 0.09)
    return np.maximum(cuff, hem)


def _openness(solid: Solid, vertices: F64, normal: F64) -> F64:
    """(V,) share of the hemisphere over each vertex not blocked within six centimetres by the body itself."""
    rays = 20
    k = np.arange(rays)
    z = 1.0 - (k + 0.5) / rays
    phi = k * np.pi * (3.0 - np.sqrt(5.0))
    local = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], axis=1)
    n = normal[: len(vertices)]
    helper = np.where(np.abs(n[:, :1]) < 0.7, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    u = np.cross(n, helper)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(n, u)
    free = np.zeros(len(vertices))
    for ray in local:
        d = ray[0] * u + ray[1] * v + ray[2] * n
        blocked = np.zeros(len(vertices), bool)
        for reach in (0.006, 0.015, 0.03, 0.055):
            blocked |= solid.fields(vertices + 0.001 * n + reach * d) > THRESHOLD
        free += (~blocked) * ray[2]
    return free / local[:, 2].sum()


def _eye(recipe: Recipe, p: F64) -> F64:
    """(N, 3) colours of points on the eyeballs: white with fine veins, iris with fibres, pupil, a spark of light."""
    x = (np.abs(p[:, 0]) - EYE[0]) * np.sign(p[:, 0])
    y, front = p[:, 1] - EYE[1], p[:, 2] > EYE[2]
    r = np.where(front, np.hypot(x, y) / EYE_RADIUS, 2.0)
    angle = np.arctan2(y, x)
    white = np.array((234.0, 229.0, 224.0))
    veins = smoothstep(0.25, 0.6, np.abs(noise(np.stack([angle * 3.0, r * 3.0, p[:, 2] * 90], axis=1), 3, recipe.seed + 81)))
    out = white * (1.0 - np.clip(r - 0.6, 0, 0.6)[:, None] * (0.10, 0.16, 0.16) - 0.03 * veins[:, None] * (0.2, 1.0, 1.0))
    iris = np.array(recipe.colour("eyes"), np.float64)
    fibre = noise(np.stack([np.cos(angle) * 9, np.sin(angle) * 9, r * 2.5], axis=1), 2, recipe.seed + 82)
    ring = (r - 0.20) / 0.27
    tone = (0.80 + 0.45 * np.clip(1.0 - ring, 0, 1) + 0.22 * fibre) * (1.0 - 0.65 * smoothstep(0.40, 0.48, r))
    inside = smoothstep(0.49, 0.455, r)[:, None]
    out = out * (1 - inside) + inside * iris * tone[:, None]
    pupil = smoothstep(0.215, 0.185, r)[:, None]
    out = out * (1 - pupil) + pupil * 10.0
    # The upper lid's shadow and a reflected lamp.
    out *= (1.0 - 0.45 * smoothstep(0.14, 0.42, y / EYE_RADIUS))[:, None]
    spark = (smoothstep(0.095, 0.06, np.hypot(x / EYE_RADIUS - 0.13, y / EYE_RADIUS - 0.16)) * front)[:, None]
    return out * (1 - spark) + spark * 250.0
