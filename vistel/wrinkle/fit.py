"""Whether a region of an avatar can wear wrinkles: whether it is there, and has a place of its own on the texture."""

import numpy as np
from numpy.typing import NDArray

from vistel.figure.avatar.avatar import Avatar
from vistel.wrinkle.region import Tube

COARSEST = 100.0
"""Texels per metre below which skin counts as having no texture coordinates (a plain colour, or a point)."""
MOST_BARE = 0.3
"""Share of a region's surface that may have none."""
MOST_SHARED = 0.15
"""Share of a region's texels that may also be those of other parts."""


def unfit(avatar: Avatar, around: Tube, owner: NDArray[np.int32] | None) -> str | None:
    """Why a region cannot wear wrinkles, or None. owner: (T,) triangle that each texel shows, -1 none; None where the region has
    a chart of its own, or nothing is painted."""
    mesh = avatar.mesh
    faces = np.flatnonzero((around.attenuation[mesh.triangles] > 0.0).any(axis=1))
    if len(faces) == 0:
        return "the mesh is too coarse there" if around.member.any() else "the avatar has no skin there"
    if owner is None:
        return None
    height, width = avatar.albedo.shape[:2]
    texels = _areas(mesh.uv[mesh.corner_triangles[faces]] * np.array((width, height)))
    surface = _areas(mesh.vertices[mesh.triangles[faces]])
    bare = float(surface[texels < COARSEST**2 * surface].sum() / surface.sum())
    if bare > MOST_BARE:
        return f"{bare:.0%} of it has no texture coordinates (a plain colour); give the avatar a texture (vistel avatar texture)"
    mine = np.zeros(len(mesh.triangles), np.bool_)
    mine[faces] = True
    shared = 1.0 - float(mine[owner[owner >= 0]].sum() / texels.sum())
    if shared > MOST_SHARED:
        return f"{shared:.0%} of its texture is shown elsewhere too; give it texture coordinates that do not overlap"
    return None


def _areas(corners: NDArray[np.floating]) -> NDArray[np.float64]:
    """(N,) of triangles (N, 3, 2 or 3)."""
    a, b = (np.asarray(corners[:, k] - corners[:, 0], np.float64) for k in (1, 2))
    squares = (a * a).sum(axis=1) * (b * b).sum(axis=1) - (a * b).sum(axis=1) ** 2
    return 0.5 * np.sqrt(np.maximum(squares, 0.0))
