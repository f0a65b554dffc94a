"""Dragging a thing with the mouse: where it is to be, from rays, the wheel and what stands under it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix
from vistel.render.interaction.picking import Hit, Ray, Targets, on_plane
from vistel.render.interaction.requests import Drag, Drop
from vistel.render.view.camera import Pinhole

NOTCH = 0.06
"""A notch of the wheel moves a thing by so much of its distance."""
NEAREST = 0.25
"""A thing is dragged no nearer to the eye than this [m]."""
REACH = 4.5
"""A thing is dragged no further from the table's middle than this [m]."""
HIGHEST = 2.8
"""A thing is dragged no higher than this [m]."""
TURN = 0.01
"""A pixel turns a thing by so much [rad]."""
FASTEST = 6.0
"""Beyond this speed a thing is dragged there without a velocity in the message [m/s]."""
THROW_NS = 120_000_000
"""A thing that is dropped flies on with its mean velocity over this time."""
THROWN = 4.0
"""... but no faster than this [m/s]."""
LOST_M = 0.2
"""A thing this far from all places to which it was dragged lately [m] ..."""
LOST_NS = 700_000_000
"""... for so long is held by somebody else."""
REMEMBERED_NS = 1_500_000_000
"""Places to which it was dragged are remembered for so long."""


@dataclass
class Dragging:
    """One thing that is dragged. position, rotation: where it is to be; grip: (3,) from its origin to where it was taken; depth:
    of the plane it moves in, before the eye [m]."""

    thing: str
    position: F64
    rotation: F64
    grip: F64
    depth: float
    t_ns: int

    def __post_init__(self) -> None:
        self._velocity = np.zeros(3)
        self._path: deque[tuple[int, F64]] = deque([(self.t_ns, self.position)])
        self._followed_ns = self.t_ns

    @staticmethod
    def begin(hit: Hit, camera: Pinhole, pose: Pose, t_ns: int) -> Dragging:
        """Begin with what the mouse points at; pose: of the thing then."""
        depth = float((hit.place - camera.position) @ -camera.rotation[:, 2])
        return Dragging(hit.thing, pose[0].copy(), pose[1].copy(), hit.place - pose[0], depth, t_ns)

    def move_to(self, ray: Ray, camera: Pinhole, targets: Targets, poses: Mapping[str, Pose], t_ns: int) -> Drag:
        """Bring it under a ray, at its depth before the camera, onto what stands there rather than into it."""
        ahead = -camera.rotation[:, 2]
        place = on_plane(ray, camera.position + self.depth * ahead, ahead)
        wanted = self.position if place is None else _inside(place - self.grip)
        wanted = self._over(wanted, targets, poses)
        dt = max(1e-3, (t_ns - self.t_ns) * 1e-9)
        velocity = 0.5 * self._velocity + 0.5 * (wanted - self.position) / dt
        speed = float(np.linalg.norm(velocity))
        self._velocity = velocity if speed < FASTEST else np.zeros(3)
        self.position, self.t_ns = wanted, t_ns
        self._path.append((t_ns, wanted))
        while t_ns - self._path[0][0] > REMEMBERED_NS:
            self._path.popleft()
        return Drag(self.thing, wanted, self.rotation, self._velocity)

    def drop(self) -> Drop:
        """It is free from now on."""
        (t1, p1), before = self._path[-1], [one for one in self._path if one is not self._path[-1]]
        lately = [one for one in before if t1 - one[0] <= THROW_NS] or before[-1:]
        velocity = (p1 - lately[0][1]) / (1e-9 * max(1, t1 - lately[0][0])) if lately else np.zeros(3)
        speed = float(np.linalg.norm(velocity))
        return Drop(self.thing, p1, self.rotation, velocity * min(1.0, THROWN / max(speed, 1e-9)))

    def nearer(self, notches: float) -> None:
        """To the eye for negative notches, away for positive ones."""
        self.depth = max(NEAREST, min(2 * REACH, self.depth * (1.0 + NOTCH) ** notches))

    def turn(self, across: float, down: float, camera: Pinhole) -> None:
        """By a mouse that went so many pixels."""
        turned = matrix_from_rotvec(np.array((0.0, TURN * across, 0.0)))
        tipped = matrix_from_rotvec(np.ascontiguousarray(TURN * down * camera.rotation[:, 0]))
        before = matrix_from_quaternion(self.rotation)
        self.rotation = quaternion_from_matrix(np.ascontiguousarray(tipped @ turned @ before))

    def lost(self, shown: F64, t_ns: int) -> bool:
        """Whether the thing, shown at (3,), has not followed: somebody else moves it, or the world does not allow it."""
        if min(float(np.linalg.norm(shown - place)) for _, place in self._path) < LOST_M:
            self._followed_ns = t_ns
        return t_ns - self._followed_ns > LOST_NS

    def _over(self, wanted: F64, targets: Targets, poses: Mapping[str, Pose]) -> F64:
        """`wanted`, raised until the thing stands on what is under it: a table, the floor, another thing."""
        lowest = targets.lowest(self.thing, self.rotation)
        others = {name: pose for name, pose in poses.items() if name != self.thing}
        from_above = np.array((wanted[0], max(self.position[1], wanted[1]) + 0.02, wanted[2]))
        below = targets.first_hit(Ray(from_above, np.array((0.0, -1.0, 0.0))), others)
        ground = max(0.0, float(below.place[1])) if below is not None else 0.0
        return np.array((wanted[0], max(wanted[1], ground - lowest), wanted[2]))


def _inside(place: F64) -> F64:
    """The nearest place within the room."""
    far = math.hypot(place[0], place[2])
    shrink = min(1.0, REACH / max(far, 1e-9))
    return np.array((place[0] * shrink, min(HIGHEST, place[1]), place[2] * shrink))
