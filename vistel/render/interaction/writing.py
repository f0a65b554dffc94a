"""Writing on a board with the mouse of a window: the way of the mouse on its face as commands, some of them in a second."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.render.interaction.picking import Ray
from vistel.space.actions import Draw, Rub
from vistel.space.arguments import Which
from vistel.space.boards.board import Face, face_of
from vistel.space.boards.stroke import ACROSS, FURTHEST, MOST_POINTS, UPWARDS
from vistel.space.things.things import Thing

EVERY_NS = 150_000_000
"""From one part of a stroke to the next: the world takes ten commands a second."""
APART = 3
"""From one point to the next, at least, in units of the grid."""
LONGEST = MOST_POINTS // 2
"""Points after which the next stroke begins where this one ends: the world puts some between those that are far apart."""


@dataclass
class Writing:
    """One stroke, or a way that rubs, on a board. points: on the grid; sent: how many have been sent."""

    board: str
    face: Face
    rubs: bool
    t_ns: int
    points: list[tuple[int, int]]
    name: str = ""
    sent: int = field(default=0)
    count: int = field(default=1)

    @staticmethod
    def begin(thing: Thing, pose: Pose, ray: Ray, rubs: bool, t_ns: int) -> Writing | None:
        """Begin where a ray meets the face of a board; None for other things, and beside its face or behind it."""
        face = face_of(thing)
        point = None if face is None else _met(face, pose, ray)
        return None if face is None or point is None else Writing(thing.id, face, rubs, t_ns, [point], f"mouse {t_ns}")

    def move(self, pose: Pose, ray: Ray, t_ns: int) -> list[Draw | Rub]:
        """Go on to where a ray meets the face; what is to be asked for now."""
        point = _met(self.face, pose, ray)
        if point is None:
            return []
        far = max(abs(point[0] - self.points[-1][0]), abs(point[1] - self.points[-1][1]))
        if far < APART:
            return []
        self.points.append(point)
        self.count += -(-far // FURTHEST)
        if self.count > LONGEST:
            out = self.rest()
            self.points, self.sent, self.count, self.name, self.t_ns = [point], 0, 1, f"mouse {t_ns}", t_ns
            return out
        if t_ns - self.t_ns < EVERY_NS:
            return []
        self.t_ns = t_ns
        return self.rest()

    def rest(self) -> list[Draw | Rub]:
        """What has not been asked for yet."""
        if self.sent == len(self.points):
            return []
        begin, self.sent = self.sent, len(self.points)
        if self.rubs:  # it begins where it was last
            return [Rub(_flat(self.points[max(0, begin - 1) :]), Which(self.board))]
        return [Draw(_flat(self.points[begin:]), Which(self.board), stroke=self.name)]


def _flat(points: list[tuple[int, int]]) -> tuple[int, ...]:
    return tuple(number for point in points for number in point)


def _met(face: Face, pose: Pose, ray: Ray) -> tuple[int, int] | None:
    """Where on the grid a ray meets a face from before it."""
    turn = matrix_from_quaternion(np.ascontiguousarray(pose.rotation))
    origin, way = (ray.origin - pose.position) @ turn, ray.direction @ turn
    slope = float(way @ face.normal)
    if slope > -1e-3:
        return None
    x, y, _ = map(float, face.on_grid(origin + float((face.corner - origin) @ face.normal) / slope * way))
    return (round(x), round(y)) if 0.0 <= x <= ACROSS and 0.0 <= y <= UPWARDS else None
