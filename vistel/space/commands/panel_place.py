"""Where a panel, or a board, is put up: between people and seats, where those who are there see it without turning far."""

import math

import numpy as np

from vistel.arrays import F64
from vistel.space.boards.board import SHAPE as BOARD
from vistel.space.commands.context import Context
from vistel.space.commands.placing import free_spot
from vistel.space.people import PersonState
from vistel.space.room import ROOM_RADIUS
from vistel.space.things.things import Thing

NEAREST = 1.5
"""From the middle of the room to a panel, at least [m]."""
BEYOND = 0.7
"""From the people and seats next to it to a panel, further away from the middle [m]."""
WITHIN = math.radians(50.0)
"""Who sits in this angle beside a panel is next to it."""
APART = 1.7
"""From one panel to the next, at least, where the room is large enough [m]: as wide as a board."""
WIDE = math.radians(60.0)
"""Between people, seats and panels there is room for one in a gap so wide; where none is, it stands in the widest."""
OVERVIEW = math.atan2(0.62, 2.30)
"""From where the room is looked at as a whole (`vistel.render.view.camera.overview`), about +Y from +Z [rad]: no panel stands
there."""
SEEN = 0.3
"""How much it counts that the overview sees a panel's front, beside that people see it."""


def panel_place(context: Context, new: Thing) -> tuple[F64, F64]:
    """Position (3,) and rotation (4,) of a panel in the room, its front to the middle."""
    people = [f for f in context.state.figures if f.posture is not None]
    others = [
        context.state.motions.position[n] for n, t in enumerate(context.state.things) if t.pages is not None or t.shape == BOARD
    ]
    around = [f.posture.stance.position for f in people if f.posture is not None] + [s.position for s in context.room.seats]
    gaps = _gaps([*(math.atan2(p[0], p[2]) for p in (*around, *others)), OVERVIEW])
    wide = [g for g in gaps if g[0] >= WIDE] or [max(gaps)]
    angle = max((middle for _, middle in wide), key=lambda a: round(_seen(a, people), 3))
    beside = [math.hypot(p[0], p[2]) for p in around if _apart(math.atan2(p[0], p[2]), angle) < WITHIN]
    rotation = np.array([0.0, math.sin(0.5 * (angle + math.pi)), 0.0, math.cos(0.5 * (angle + math.pi))])
    away, farthest = max((NEAREST, *(d + BEYOND for d in beside))), ROOM_RADIUS - 0.5
    while True:
        foot = min(away, farthest) * _towards(angle)
        if away >= farthest or all(math.dist(foot[[0, 2]], p[[0, 2]]) >= APART for p in others):
            return free_spot(context, new, foot, rotation), rotation
        away += 0.25


def _gaps(angles: list[float]) -> list[tuple[float, float]]:
    """How wide each gap between directions is, and its middle [rad]."""
    around = sorted(a % (2.0 * math.pi) for a in angles)
    return [(b - a, a + 0.5 * (b - a)) for a, b in zip(around, [*around[1:], around[0] + 2.0 * math.pi], strict=True)]


def _seen(angle: float, people: list[PersonState]) -> float:
    """How well a panel in this direction from the middle is seen: the mean cosine of how far people must turn to it, and the
    overview's share."""
    place = NEAREST * _towards(angle)
    turns: list[float] = []
    for stance in (f.posture.stance for f in people if f.posture is not None):
        to = place - stance.position
        turns.append(math.cos(math.atan2(to[0], to[2]) - stance.heading))
    return sum(turns) / max(1, len(turns)) - SEEN * math.cos(angle - OVERVIEW)


def _towards(angle: float) -> F64:
    return np.array([math.sin(angle), 0.0, math.cos(angle)])


def _apart(a: float, b: float) -> float:
    return abs(math.remainder(a - b, 2.0 * math.pi))
