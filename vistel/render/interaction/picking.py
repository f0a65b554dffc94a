"""Picking: rays from the picture into the room, and where they meet things."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.render.view.screens import Sight
from vistel.space.things.tessellate import Surface3

FURTHEST = 12.0
"""Nothing further than this is pointed at [m]."""
EDGE = 1e-6
"""A triangle reaches over its edges by this share of it: rays slip between no two."""


@dataclass(frozen=True)
class Ray:
    """origin: (3,) room [m]; direction: (3,) unit."""

    origin: F64
    direction: F64

    def at(self, distance: float) -> F64:
        """(3,) so far along it [m]."""
        return self.origin + distance * self.direction


@dataclass(frozen=True)
class Hit:
    """A ray meets a thing at (3,) `place`, `distance` metres along it."""

    thing: str
    place: F64
    distance: float


def ray_through(sights: Sequence[Sight], x: float, y: float, size: tuple[int, int]) -> Ray | None:
    """The ray of the pixel (x, y) of a picture of `size`, from its upper left; None where no eye's picture is. Where both
    eyes' pictures lie over one another, the first one's."""
    width, height = size
    for sight in sights:
        left, bottom, w, h = sight.box or (0, 0, width, height)
        u, v = (x - left) / w, (height - y - bottom) / h
        if not (0.0 <= u <= 1.0 and 0.0 <= v <= 1.0):
            continue
        direction = sight.camera.through(u, v, w / h)
        return Ray(sight.camera.position, direction / np.linalg.norm(direction))
    return None


class Targets:
    """Surfaces that a ray may meet, each in its thing's frame."""

    def __init__(self) -> None:
        self._corners: dict[str, F64] = {}
        self._reach: dict[str, float] = {}

    def put(self, thing: str, surfaces: Sequence[Surface3]) -> None:
        """A thing looks like this now."""
        parts = [s.vertices.astype(np.float64)[s.triangles] for s in surfaces if len(s.triangles)]
        if not parts:
            self.drop(thing)
            return
        corners = np.concatenate(parts)
        self._corners[thing] = corners
        self._reach[thing] = math.sqrt(float((corners * corners).sum(axis=2).max()))

    def drop(self, thing: str) -> None:
        """A thing is no longer there."""
        self._corners.pop(thing, None)
        self._reach.pop(thing, None)

    def lowest(self, thing: str, rotation: F64) -> float:
        """How far a thing's lowest point is over its origin when it is turned so; below it, hence negative, as a rule [m]."""
        if thing not in self._corners:
            return 0.0
        upwards = matrix_from_quaternion(np.ascontiguousarray(rotation))[1]
        return float((self._corners[thing] @ upwards).min())

    def first_hit(self, ray: Ray, poses: Mapping[str, Pose], hidden_from: float = FURTHEST) -> Hit | None:
        """The first thing a ray meets. poses: position (3,) and quaternion (4,) of things; what is further than
        `hidden_from` metres stands behind something else."""
        best: Hit | None = None
        nearest = min(FURTHEST, hidden_from)
        for thing, corners in self._corners.items():
            if thing not in poses:
                continue
            position, rotation = poses[thing]
            away = position - ray.origin
            along = float(away @ ray.direction)
            reach = self._reach[thing]
            if along < -reach or along - reach > nearest or float(away @ away) - along * along > reach * reach:
                continue
            turn = matrix_from_quaternion(np.ascontiguousarray(rotation))
            distance = first_intersection(corners, (ray.origin - position) @ turn, ray.direction @ turn)
            if distance < nearest:
                nearest = distance
                best = Hit(thing, ray.at(distance), distance)
        return best


def first_intersection(corners: F64, origin: F64, direction: F64) -> float:
    """How far along a ray the first of the triangles `corners` (n, 3, 3) is; infinite where none is.

    T. Möller, B. Trumbore, "Fast, minimum storage ray/triangle intersection", 1997; both sides count.
    """
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(direction, ac)
    det = (ab * p).sum(axis=1)
    safe = np.where(np.abs(det) < 1e-14, np.inf, det)
    s = origin - a
    u = (s * p).sum(axis=1) / safe
    q = np.cross(s, ab)
    v = (q @ direction) / safe
    t = (q * ac).sum(axis=1) / safe
    hits = (np.abs(det) >= 1e-14) & (u >= -EDGE) & (v >= -EDGE) & (u + v <= 1.0 + EDGE) & (t > 1e-6)
    return float(t[hits].min()) if hits.any() else math.inf


def on_plane(ray: Ray, place: F64, normal: F64) -> F64 | None:
    """(3,) where a ray meets a plane; None where it runs along it or away from it."""
    slope = float(ray.direction @ normal)
    if abs(slope) < 1e-3:
        return None
    distance = float((place - ray.origin) @ normal) / slope
    return ray.at(distance) if 0.0 < distance <= FURTHEST else None
