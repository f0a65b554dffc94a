"""The dark between parted lips, for heads whose mouth is painted on closed skin: where the skin between the lips is stretched, it
is drawn as the inside of the mouth."""

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, I64
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.face.landmarks import JAW, landmarks_of
from vistel.figure.face.marks import MARK_INDEX
from vistel.figure.face.shape import FaceShape
from vistel.figure.face.targets import meant

DARK = 0.07
"""Brightness of what is behind the lips."""
SPREAD = 0.3
"""Least difference of the jaw's share between corners of a triangle that is stretched when the mouth opens."""
RIM = (0.12, 0.85)
"""Shares of the jaw's motion between which skin shows what is behind the lips."""


def between_the_lips(avatar: Avatar, owner: NDArray[np.int32], weight: F32) -> tuple[I64, F32]:
    """Texels that darken when the mouth opens, and their brightness then. owner, weight: (T,) triangle of each texel, -1 none,
    and (T, 3) its corners' shares. None for an avatar without a face, and for one with a shape of its own for the open jaw: that
    has a mouth."""
    mesh, none = avatar.mesh, (np.zeros(0, np.int64), np.zeros(0, np.float32))
    if any(meaning.unit == JAW for meaning in meant(t.name for t in mesh.targets).values()):
        return none
    try:
        marks = landmarks_of(avatar)
    except ValueError:
        return none
    shape = FaceShape(mesh.vertices, marks, triangles=mesh.triangles)
    share = np.zeros(len(mesh.vertices))
    share[shape.vertex] = shape.jaw[: len(shape.vertex)]
    corner = marks.marks[MARK_INDEX["left_mouth_corner"]]
    p = mesh.vertices.astype(np.float64)
    half = np.array((corner[0] - marks.between[0], 0.016 * marks.scale, 0.02 * marks.scale))
    mouth = np.asarray((np.abs(p - marks.between) < half).all(axis=1))
    faces = mesh.triangles
    low, high = share[faces].min(axis=1), share[faces].max(axis=1)
    crossing = np.asarray(mouth[faces].any(axis=1) & (high - low > SPREAD))
    texel = np.flatnonzero((owner >= 0) & crossing[owner])
    of = owner[texel]
    at = (share[faces[of]] * weight[texel]).sum(axis=1)
    inside = np.minimum(at - RIM[0], RIM[1] - at) / 0.1
    x = (p[faces[of], 0] * weight[texel]).sum(axis=1) - marks.between[0]
    # Lips never part at the corners.
    across = np.abs(x) / (corner[0] - marks.between[0])
    strength = np.clip(0.5 + inside, 0.0, 1.0) * np.clip((0.86 - across) / 0.14, 0.0, 1.0)
    keep = strength > 0.0
    return texel[keep], (1.0 - strength[keep] * (1.0 - DARK)).astype(np.float32)
