"""The board on which people write: a white face in a frame, on a foot, that stands by itself."""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.boards.stroke import ACROSS, UNIT, UPWARDS
from vistel.space.things.things import Z_UP, GraspAxis, Thing, ThingPrimitive

SHAPE = "board"
WHITE = 0xF3F3EFFF
"""Colour of the face."""
FRAME = 0x8D9299FF
"""Colour of frame and foot."""
MASS = 50.0
"""[kg]."""
OVER_FLOOR = 0.80
"""Lower edge of the face [m]: who sits behind a table sees all of it."""
CENTRE = 0.4
"""Height of the centre of mass, in the heavy foot [m]."""
_THICK = 0.012
"""Half thickness of the face [m]."""
_EDGE = 0.016
"""Radius of the frame's bars [m]."""
_FOOT = 0.42, 0.016
"""Radius and half height of the foot [m]."""
_POLE = 0.025
"""Radius [m]."""
_NUMBERS = 13
"""Of the primitive that is the face: its radius and four corners."""


@dataclass(frozen=True, eq=False)
class Face:
    """Where people write, in the thing's frame [m] unless it is `posed`: corner (3,) the lower left one of the front, across and up
    (3,) along its edges, normal (3,) unit, out of the front."""

    corner: F64
    across: F64
    up: F64
    normal: F64

    def posed(self, position: F64, rotation: F64) -> "Face":
        """The face where its thing is, position (3,) [m] and quaternion (4,), in the frame of those."""
        turn = matrix_from_quaternion(rotation)
        return Face(turn @ self.corner + position, turn @ self.across, turn @ self.up, turn @ self.normal)

    def on_grid(self, places: F64) -> tuple[F64, F64, F64]:
        """x and y on the grid of strokes, and the distance in front of the face [m], (...) each, of places (..., 3)."""
        to = places - self.corner
        x, y = ((to * edge).sum(-1) / (edge * edge).sum() for edge in (self.across, self.up))
        return x * ACROSS, y * UPWARDS, (to * self.normal).sum(-1)

    def place(self, points: F64, off: F64) -> F64:
        """(n, 3) [m] of points (n, 2) on the grid; off: (n,) in front of the face [m]."""
        along = points[:, :1] / ACROSS * self.across + points[:, 1:] / UPWARDS * self.up
        return self.corner + along + off[:, None] * self.normal


def board(thing_id: str, name: str) -> Thing:
    """A board at the origin, its front to +Z."""
    width, height = ACROSS * UNIT, UPWARDS * UNIT
    x, low = width / 2.0, OVER_FLOOR - CENTRE
    high = low + height
    face = ThingPrimitive("rounded_polygon", (_THICK, -x, low, 0.0, x, low, 0.0, x, high, 0.0, -x, high, 0.0), colour=WHITE)
    corners = [(-x, low), (x, low), (x, high), (-x, high)]
    edges = [
        ThingPrimitive("cone_sphere", (*a, 0.0, *b, 0.0, _EDGE, _EDGE))
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
    ]
    pole = ThingPrimitive("cone_sphere", (0.0, 0.03 - CENTRE, 0.0, 0.0, low, 0.0, _POLE, _POLE))
    radius, half = _FOOT
    foot = ThingPrimitive("superellipsoid", (radius, radius, half, 0.3, 1.0), np.array([0.0, half - CENTRE, 0.0]), Z_UP)
    middle = (low + high) / 2.0
    sides = tuple(GraspAxis(np.array([k * x, middle, 0.0]), np.array([0.0, 1.0, 0.0]), _EDGE) for k in (-1.0, 1.0))
    # Half of the mass in the foot, half in the face [m^2].
    tall, wide = 0.5 * middle**2 + 0.5 * CENTRE**2, width**2 / 24.0 + radius**2 / 8.0
    inertia = np.diag([tall + radius**2 / 8.0, wide + radius**2 / 8.0, tall + wide])
    primitives = (face, *edges, pole, foot)
    return Thing(thing_id, name, SHAPE, primitives, MASS, 0.0, FRAME, np.zeros(3), axes=sides, inertia=inertia)


def facing_middle(standing: Thing, x: float, z: float) -> Thing:
    """A board on the floor at x, z [m], its front to the middle of the room."""
    half = 0.5 * math.atan2(-x, -z)
    place, turn = np.array([x, CENTRE, z]), np.array([0.0, math.sin(half), 0.0, math.cos(half)])
    return replace(standing, position=place, rotation=turn)


def face_of(thing: Thing) -> Face | None:
    """Where one writes on a thing; None for what is no board, and for a bent one."""
    if thing.shape != SHAPE or thing.curve is not None or not thing.primitives:
        return None
    return front_of(thing)


@lru_cache(32)  # the world asks for those of all boards at each step
def front_of(thing: Thing) -> Face | None:
    """The front of what is flat and stands, as a board or a panel; None where its first primitive is no rectangle."""
    first = thing.primitives[0]
    if first.kind != "rounded_polygon" or len(first.params) != _NUMBERS:
        return None
    turn = matrix_from_quaternion(first.rotation)
    lower_left, lower_right, _, upper_left = (turn @ corner + first.position for corner in np.array(first.params[1:]).reshape(4, 3))
    across, up = lower_right - lower_left, upper_left - lower_left
    normal = np.cross(across, up)
    normal = normal / np.sqrt((normal * normal).sum())
    return Face(lower_left + first.params[0] * normal, across, up, normal)
