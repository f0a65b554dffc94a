"""Where a frame stands in another, as one value."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, slerp


class Pose(NamedTuple):
    """A frame's place in an outer frame, which is the room unless another is named.

    position: (3,) of its origin [m]; rotation: (4,) unit quaternion (x, y, z, w). Both are right-handed. A pose takes points
    of the inner frame to the outer one: R p + position.
    """

    position: F64
    rotation: F64

    @property
    def matrix(self) -> F64:
        """R (3, 3)."""
        return matrix_from_quaternion(self.rotation)

    def apply(self, points: F64) -> F64:
        """Points (..., 3) of the inner frame in the outer one."""
        return points @ self.matrix.T + self.position

    def compose(self, inner: Pose) -> Pose:
        """A pose in the inner frame as a pose in the outer one."""
        return inner.moved(self.matrix, self.position)

    def inverse(self) -> Pose:
        """The outer frame's pose in the inner one."""
        return Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])).relative_to(self.matrix, self.position)

    def interpolate(self, other: Pose, share: float) -> Pose:
        """Between this pose (share 0) and another (1): positions along the line, rotations along the shorter arc."""
        return Pose(self.position + share * (other.position - self.position), slerp(self.rotation, other.rotation, share))

    def moved(self, rotation: F64, position: F64) -> Pose:
        """This pose in a frame that stands at `position` (3,) with `rotation` (3, 3), in the frame that stands outside that."""
        turned = quaternion_from_matrix(np.ascontiguousarray(rotation @ self.matrix))
        return Pose(position + rotation @ self.position, turned)

    def relative_to(self, rotation: F64, position: F64) -> Pose:
        """This pose as seen from a frame that stands beside it, at `position` (3,) with `rotation` (3, 3)."""
        turned = quaternion_from_matrix(np.ascontiguousarray(rotation.T @ self.matrix))
        return Pose(rotation.T @ (self.position - position), turned)
