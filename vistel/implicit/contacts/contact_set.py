"""A set of posed primitives of any kind, as the flat arrays the contact and ghost kernels walk.

Sizes are those of the surface (where the primitive's own quartic field is T = 0.5). Kinds and parameters:

====================== ==================================================================
SPHERE (0)             r
CONE_SPHERE (1)        ax, ay, az, bx, by, bz, ra, rb
ROUNDED_POLYGON (2)    r, x0, y0, z0, x1, y1, z1, ...  planar, convex
SUPERELLIPSOID (3)     a1, a2, a3, e1, e2
SUPERTOROID (4)        a1, a2, a3, alpha, e1, e2  ring about Z
====================== ==================================================================
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vistel.arrays import F64, I32

SPHERE = 0
CONE_SPHERE = 1
ROUNDED_POLYGON = 2
SUPERELLIPSOID = 3
SUPERTOROID = 4
KIND_CODES = {
    "sphere": SPHERE,
    "cone_sphere": CONE_SPHERE,
    "rounded_polygon": ROUNDED_POLYGON,
    "superellipsoid": SUPERELLIPSOID,
    "supertoroid": SUPERTOROID,
}


@dataclass(frozen=True)
class PrimitiveSet:
    """N posed primitives.

    kind: (N,). params: flat; those of primitive i are params[start[i] : start[i + 1]], metres, in its frame.
    start: (N + 1,). rotation: (N, 3, 3) own frame to room; position: (N, 3) [m, room].
    """

    kind: I32
    start: I32
    params: F64
    rotation: F64
    position: F64

    def __len__(self) -> int:
        return len(self.kind)

    @staticmethod
    def of_cone_spheres(a: F64, b: F64, radius_a: F64, radius_b: F64) -> PrimitiveSet:
        """Cone-spheres given in the room frame: a, b (N, 3), radius_a, radius_b (N,) [m]."""
        cones = np.empty((len(radius_a), 8))
        cones[:, 0:3], cones[:, 3:6], cones[:, 6], cones[:, 7] = a, b, radius_a, radius_b
        return PrimitiveSet.of_cones(cones)

    @staticmethod
    def of_cones(cones: F64) -> PrimitiveSet:
        """Cone-spheres given in the room frame: (N, 8) ends and radii [m]. Sets of so many share all but `params`."""
        kind, start, rotation, position = _in_room(len(cones))
        return PrimitiveSet(kind, start, cones.reshape(-1), rotation, position)

    @staticmethod
    def of_kinds(kinds: Sequence[str], params: Sequence[Sequence[float]], rotation: F64, position: F64) -> PrimitiveSet:
        """Primitives by name: kinds (N), params (N lists), rotation (N, 3, 3), position (N, 3).

        Raises ValueError for a kind that is none.
        """
        for kind in kinds:
            if kind not in KIND_CODES:
                raise ValueError(f"kind: expected one of {', '.join(KIND_CODES)}, got {kind!r}")
        start = np.zeros(len(kinds) + 1, np.int32)
        start[1:] = np.cumsum([len(p) for p in params])
        flat = np.array([x for p in params for x in p], np.float64)
        return PrimitiveSet(
            np.array([KIND_CODES[k] for k in kinds], np.int32),
            start,
            flat,
            np.ascontiguousarray(rotation, dtype=np.float64).reshape(-1, 3, 3),
            np.ascontiguousarray(position, dtype=np.float64).reshape(-1, 3),
        )

    def moved(self, rotation: F64, position: F64) -> PrimitiveSet:
        """The same primitives carried along by a frame: rotation (3, 3), position (3,)."""
        return PrimitiveSet(
            self.kind,
            self.start,
            self.params,
            np.ascontiguousarray(rotation @ self.rotation),
            self.position @ rotation.T + position,
        )

    @staticmethod
    def join(sets: Sequence[PrimitiveSet]) -> PrimitiveSet:
        """All primitives of `sets` in one, in order."""
        offsets = np.cumsum([0] + [len(s.params) for s in sets])
        starts = [s.start[:-1] + o for s, o in zip(sets, offsets[:-1], strict=True)]
        return PrimitiveSet(
            np.concatenate([s.kind for s in sets]),
            np.concatenate([*starts, offsets[-1:]]).astype(np.int32),
            np.concatenate([s.params for s in sets]),
            np.concatenate([s.rotation for s in sets]),
            np.concatenate([s.position for s in sets]),
        )


@lru_cache(256)
def _in_room(count: int) -> tuple[I32, I32, F64, F64]:
    """Kinds, starts, rotations and positions of cone-spheres whose own frame is the room's; nobody writes to them."""
    kind, start = np.full(count, CONE_SPHERE, np.int32), np.arange(0, 8 * count + 1, 8, dtype=np.int32)
    return kind, start, np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
