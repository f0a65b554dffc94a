"""Where on an avatar a place of the anatomy lies: skin depths measured on its mesh at rest."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.layers.anatomy import AnatomicalSite
from vistel.figure.skeleton import JOINT_INDEX, REFERENCE_HEIGHT

_NEAREST = 0.15
"""Depth of the skin, at least, as a share of the depth that the body's primitives give."""
_FURTHEST = 2.2
"""Depth of the skin, at most, as a share of the same depth: what is further is another limb, or the far side of a hole."""


@dataclass(frozen=True)
class Anchor:
    """A place fixed to a bone: offset (3,) in the frame of `joint` from the position of the joint `at` [m]; depth: from
    the bone's axis to the skin there [m]; rest: (3,) in the rest pose, model frame [m]."""

    joint: int
    at: int
    offset: F64
    depth: float
    rest: F64


class Places:
    """Finds places on one avatar."""

    def __init__(self, avatar: Avatar) -> None:
        self.avatar = avatar
        mesh = avatar.mesh
        corners = mesh.vertices.astype(np.float64)[mesh.triangles]
        self._corner, self._u, self._v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        self._middle = corners.mean(axis=1)
        self._reach = float(np.linalg.norm(corners - self._middle[:, None], axis=2).max())

    @property
    def scale(self) -> float:
        """Height of the avatar / that of the person the anatomy is written for."""
        return self.avatar.skeleton.height / REFERENCE_HEIGHT

    def anchor(self, site: AnatomicalSite) -> Anchor:
        """The place of `site`."""
        skeleton = self.avatar.skeleton
        joint, at = JOINT_INDEX[site.joint], JOINT_INDEX[site.at or site.joint]
        axis = skeleton.rest[at] + site.along * skeleton.tip[joint]
        direction = unit(np.array(site.direction))
        depth = self.skin_depth(joint, axis, direction)
        rest = axis + site.depth * depth * direction
        return Anchor(joint, at, rest - skeleton.rest[at], depth, rest)

    def skin_depth(self, joint: int, start: F64, direction: F64) -> float:
        """From `start` (3,) along the unit `direction` (3,) to the skin [m]; where the mesh has a hole, or another limb
        lies there, what the body's primitives say."""
        expected = self._primitive_depth(joint, start, direction)
        hits = self._hits(start, direction, _FURTHEST * expected)
        hits = hits[hits > _NEAREST * expected]
        return float(hits.min()) if len(hits) else expected

    def _hits(self, start: F64, direction: F64, furthest: float) -> F64:
        """Distances at which a ray meets the mesh (Möller and Trumbore)."""
        w = self._middle - start
        along = w @ direction
        beside = np.square(w).sum(axis=1) - along * along
        near = (beside < self._reach**2) & (along > -self._reach) & (along < furthest + self._reach)
        u, v, s = self._u[near], self._v[near], start - self._corner[near]
        p = np.cross(direction, v)
        det = (u * p).sum(axis=1)
        det = np.where(np.abs(det) < 1e-14, np.inf, det)
        a = (s * p).sum(axis=1) / det
        q = np.cross(s, u)
        b = q @ direction / det
        t = (v * q).sum(axis=1) / det
        hit = (a >= -1e-9) & (b >= -1e-9) & (a + b <= 1 + 1e-9) & (t > 0) & (t < furthest)
        return t[hit]

    def _primitive_depth(self, joint: int, start: F64, direction: F64) -> float:
        """How far along a ray the surface of the cone-sphere nearest to its start is [m], at least a centimetre of scale."""
        body, rest = self.avatar.body, self.avatar.skeleton.rest
        a, b = rest[body.joint] + body.a, rest[body.joint] + body.b
        axis = b - a
        s = np.clip(((start - a) * axis).sum(axis=1) / np.maximum((axis * axis).sum(axis=1), 1e-12), 0.0, 1.0)
        radius = body.radius_a + s * (body.radius_b - body.radius_a)
        closest = a + s[:, None] * axis
        away = np.linalg.norm(start - closest, axis=1) / radius - 0.5 * (body.joint == joint)
        i = int(np.argmin(away))
        w = start - closest[i]
        along = float(w @ direction)
        inside = max(0.0, float(radius[i]) ** 2 - float(w @ w) + along * along)
        return max(0.006 * self.scale, float(np.sqrt(inside)) - along)


def unit(v: F64) -> F64:
    """v (..., 3) of length 1; zero stays zero."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)
