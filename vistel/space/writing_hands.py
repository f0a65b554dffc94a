"""Hands that write on boards: with the tip of the index finger, with a thing that is held, which writes in its colour, and rub with
the flat of the hand or a white thing."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.boards.board import Face, face_of
from vistel.space.boards.stroke import ACROSS, MOST_POINTS, UPWARDS, WIDTH, Stroke, touches
from vistel.space.commands.names import COLOURS
from vistel.space.commands.reference import name_of_colour
from vistel.space.dynamics.solids import Solids
from vistel.space.ink import FullError, without, written
from vistel.space.people import DIGITS, PALM, Posed
from vistel.space.state import Pen, State

INDEX = 1
"""Place of the index finger among the digits."""
TOUCHES = 0.004
"""What is so near the face touches it [m]: trackers are no better."""
LEAVES = 0.010
"""What writes goes on to this distance [m], so that a hand that trembles draws one line."""
BEHIND = 0.06
"""What is further behind the face is somebody who stands behind the board [m]."""
HAND = 0.3
"""No fingertip is further from its wrist [m]."""
APART = 4
"""From one point of a hand's stroke to the next, at least, in units of the grid: 2 mm."""
SPONGE = 160
"""Width of what a hand rubs, in units: 8 cm."""


@dataclass(frozen=True)
class _Tip:
    """What a hand writes with, at a board: x, y on the grid; colour: None: it rubs."""

    x: float
    y: float
    colour: int | None


def written_by_hand(state: State, s: Solids, posed: Mapping[str, Posed]) -> State:
    """The state after hands have written for a step. posed: everybody at this step."""
    m = state.motions
    faces = [
        (n, face.posed(m.position[n], m.rotation[n]))
        for n, thing in enumerate(state.things)
        if (face := face_of(thing)) is not None
    ]
    if not faces:
        return state.but(pens=()) if state.pens else state
    before = {(p.participant, p.right): p for p in state.pens}
    pens: list[Pen] = []
    for name in sorted(posed):
        for right in (False, True):
            for n, face in faces:
                last = before.get((name, right))
                pen = last if last is not None and last.board == state.things[n].id else None
                tip = _tip(state, s, posed[name], right, n, face, LEAVES if pen else TOUCHES)
                if tip is not None:
                    state, pen = _moved(state, name, right, state.things[n].id, tip, pen)
                    pens += [pen] if pen is not None else []
                    break
    return state.but(pens=tuple(pens)) if pens or state.pens else state


def _tip(state: State, s: Solids, p: Posed, right: bool, n: int, face: Face, reach: float) -> _Tip | None:
    """What of a hand, or of the thing in it, is nearest to board n, whose face is in the room, if it is within `reach` of it."""
    held = next((g.thing for g in state.grasps if (g.participant, g.right) == (p.name, right)), None)
    if held is not None:
        m = state.rows[held]
        if m == n or s.notes[m]:
            return None
        rows = slice(int(s.contact_point_first[m]), int(s.contact_point_first[m + 1]))
        own = matrix_from_quaternion(state.motions.rotation[m])
        points = s.contact_point[rows] @ own.T + state.motions.position[m]
        thing = state.things[m]
        colour = None if name_of_colour(thing.colour) == "white" else thing.colour | 0xFF
        return _nearest(points, s.contact_point_radius[rows], face, reach, colour)
    wrist = p.joints.position[JOINT_INDEX["right_hand" if right else "left_hand"]]
    if abs(face.on_grid(wrist)[2]) > HAND:
        return None
    first = DIGITS * int(right)
    for digit, colour in ((PALM, None), (INDEX, COLOURS["black"])):
        rows = np.flatnonzero(p.build.digit == first + digit)
        points = np.concatenate([p.body.a[rows], p.body.b[rows]])
        radius = np.concatenate([p.body.radius_a[rows], p.body.radius_b[rows]])
        if (tip := _nearest(points, radius, face, reach, colour)) is not None:
            return tip
    return None


def _nearest(points: F64, radius: F64, face: Face, reach: float, colour: int | None) -> _Tip | None:
    """points (n, 3) in the room [m], radius (n,) of balls round them."""
    x, y, off = face.on_grid(points)
    off = off - radius
    there = (off > -BEHIND) & (off < reach) & (x >= 0.0) & (x <= ACROSS) & (y >= 0.0) & (y <= UPWARDS)
    if not there.any():
        return None
    n = int(np.argmin(np.where(there, off, np.inf)))
    return _Tip(float(x[n]), float(y[n]), colour)


def _moved(state: State, who: str, right: bool, board: str, tip: _Tip, pen: Pen | None) -> tuple[State, Pen | None]:
    """The state after the tip of a hand has come to a place on a board, and the hand's pen; None where there is no more ink."""
    x, y = math.floor(tip.x + 0.5), math.floor(tip.y + 0.5)
    if pen is not None and max(abs(x - pen.x), abs(y - pen.y)) < APART:
        return state, pen
    if tip.colour is None:
        path = np.array([(pen.x, pen.y), (x, y)] if pen is not None else [(x, y)], np.int64)
        gone = [k for k in state.strokes if k.board == board and touches(k, path, SPONGE)]
        return without(state, who, gone), Pen(who, right, board, 0, x, y)
    old = next((k for k in state.strokes if pen is not None and k.number == pen.number), None)
    points = [(x, y)]
    if old is None or old.count > MOST_POINTS // 2:
        points = [(pen.x, pen.y), (x, y)] if pen is not None and old is not None else points
        name = f"hand {state.marks}"
    else:
        name = old.id
    try:
        state = written(state, Stroke(0, board, who, name, tip.colour, WIDTH, b""), points)
    except FullError:
        return state, None
    number = next(k.number for k in reversed(state.strokes) if (k.by, k.id) == (who, name))
    return state, Pen(who, right, board, number, x, y)
