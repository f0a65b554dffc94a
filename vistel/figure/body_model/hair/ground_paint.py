"""Skin from which hair grows, in the texture: it is seen between hairs, and at the hairline before them."""

import numpy as np

from vistel.arrays import F32, F64, U8
from vistel.figure.body_model.hair.scalp import Scalp
from vistel.figure.body_model.texels import Colour, noise, on_triangles
from vistel.geometry.smoothstep import smooth

_BEGINS = -0.045
"""How far inside the hairline the first short hairs are, as a share of the head's size."""
_WHOLE = 0.09
"""How far inside it they are as many as farther in, likewise."""
_SHAVED = 2.2
"""By how much farther that is on a shaved head."""
_BEYOND = 4
"""Texels beyond the skin's edges in the texture that are painted as well: filters see them."""


def paint_ground(picture: U8, scalp: Scalp, colour: Colour, share: float, rng: np.random.Generator, *, shaved: bool) -> None:
    """Paint it into the texture (H, W, 3), in place. colour: of the hair; share: how much of the skin hair hides well inside the
    hairline, 0 to 1."""
    mesh = scalp.body.mesh
    d = mesh.vertices.astype(np.float64) - scalp.middle
    far = np.linalg.norm(d, axis=1)
    inside = np.minimum(scalp.within(mesh), scalp.size * _facing(d / far[:, None], scalp.normals))
    reach = scalp.size * (_SHAVED if shaved else 1.0)
    of = mesh.triangles
    hairy = (far > 0.6 * scalp.size)[of].all(axis=1) & (inside > _BEGINS * reach)[of].any(axis=1)
    # Triangle by triangle: between the islands of a texture lie other parts of the body.
    box, deep = on_triangles(mesh.uv, mesh.corner_triangles[hairy], inside[mesh.corner_vertex], picture.shape[:2], _BEYOND)
    grown = smooth((deep / reach - _BEGINS) / (_WHOLE - _BEGINS)).astype(np.float32)
    hair: F32 = share * _hair_by_hair(grown, rng)
    mixed = picture[box] * (1.0 - hair[..., None]) + np.array(colour, np.float32) * hair[..., None]
    picture[box] = np.round(mixed).astype(np.uint8)


def _facing(out: F64, normal: F64) -> F64:
    """(V,) 1 where skin faces away from the head, below 0 where it faces along it, as on ears."""
    return 4.0 * (np.einsum("ni,ni->n", out, normal) - 0.5)


def _hair_by_hair(grown: F32, rng: np.random.Generator) -> F32:
    """(H, W) how much of the skin is hidden; grown: how much of it on average."""
    spots = np.clip(0.5 + 0.4 * noise(rng, grown.shape, (1, 2)), 0.0, 1.0)
    return grown * (0.35 + 0.65 * smooth((grown + 0.35 - spots) / 0.4)).astype(np.float32)
