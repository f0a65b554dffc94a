"""A body that gives ghosts and takes them."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vistel.arrays import F64
from vistel.implicit.checks import Vec3, vector, within
from vistel.implicit.graph.combine import Placed
from vistel.implicit.graph.shape import Shape

SOFTEST = 50.0
"""Largest compliance of a body; flesh has 1."""


@dataclass(frozen=True, eq=False)
class Deformable:
    """A body that gives ghosts and takes them.

    shape: its field at rest, in its own frame; compliance: 0 rigid, 1 as soft as flesh, up to 50; position (3,) [m]
    and rotation, a quaternion (x, y, z, w): body to room.
    """

    name: str
    shape: Shape
    compliance: float = 1.0
    position: Vec3 = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        within(f"Deformable {self.name}", "compliance", self.compliance, 0.0, SOFTEST)
        object.__setattr__(self, "position", vector("Deformable", "position", self.position))

    @cached_property
    def placed(self) -> Placed:
        """Its field at rest, in the room."""
        return self.shape.moved(self.position, self.rotation)

    def at(self, position: ArrayLike, rotation: ArrayLike | None = None) -> "Deformable":
        """The same body elsewhere."""
        x, y, z = (float(v) for v in np.asarray(position, np.float64))
        turn = self.rotation if rotation is None else tuple(float(v) for v in np.asarray(rotation, np.float64))
        return replace(self, position=(x, y, z), rotation=turn)

    def to_room(self, points: ArrayLike) -> F64:
        """Points (..., 3) of its frame, in the room."""
        m = self.placed.matrix
        return np.asarray(points, np.float64) @ m[:, :3].T + m[:, 3]

    def to_body(self, points: ArrayLike) -> F64:
        """Points (..., 3) of the room, in its frame."""
        m = self.placed.matrix
        return (np.asarray(points, np.float64) - m[:, 3]) @ m[:, :3]
