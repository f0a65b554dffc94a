"""Notes stick: one that is free near something that stands (a wall, furniture, a board, a panel, another note) lies flat against it
from then on, upright and readable, until a hand or a mouse takes it. What it sticks to may be moved: it goes along."""

import math
from collections.abc import Iterator

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.implicit.contacts.contact import find_contacts
from vistel.space.boards.board import front_of
from vistel.space.dynamics.dynamics import ASLEEP, FREE, HELD, Motions
from vistel.space.dynamics.solids import Solids
from vistel.space.notes.note import THICK
from vistel.space.room import HALF_WIDTH
from vistel.space.state import State

NEAR = 0.08
"""A free note sticks to what is no further from it [m]: who lets go of one at a board has their fingers behind it."""
SLACK = 0.0005
"""Between a note and what it sticks to [m]."""
STEEP = 0.7
"""On what faces up by more than this cosine, a note lies the way it was turned; to what faces down so, none sticks."""
_ROUNDS = 3
"""In which a note is brought to its place: the distance to what is not flat is found better from nearby."""


def stuck(before: State, state: State, m: Motions, s: Solids, walls: bool) -> Motions:
    """How things move after a step, with notes stuck. before: at its beginning; state: when only forces had yet to act; m: after
    these; walls: whether the room has the built-in ones."""
    notes = np.flatnonzero(s.notes).tolist()
    if not notes:
        return m
    was, now, out = _of_same_things(before, state), state.motions, m.copy()
    moved = {n for n in np.flatnonzero(s.holds_notes).tolist() if not _same_pose(was, m, n)}
    for n in notes:
        stays = was.mode[n] == ASLEEP and now.mode[n] != HELD and _same_pose(was, now, n)
        if stays and (k := _stuck_to(was, s, n, moved)) is not None:
            _go_along(out, was, n, k)
            moved.add(n)
        elif now.mode[n] == ASLEEP:  # whatever pushes it
            _put(out, n, now.position[n], now.rotation[n])
            moved.discard(n)
        elif out.mode[n] == FREE and (found := _nearest(out, s, n, walls)) is not None:
            _stick(out, s, n, *found)
    return out


def _of_same_things(before: State, state: State) -> Motions:
    """How the things of `state` moved before; what was not there, as it moves now."""
    if before.things is state.things:
        return before.motions
    out, rows = state.motions.copy(), before.rows
    for n, thing in enumerate(state.things):
        if (was := rows.get(thing.id)) is not None:
            for name in Motions.__dataclass_fields__:
                getattr(out, name)[n] = getattr(before.motions, name)[was]
    return out


def _same_pose(a: Motions, b: Motions, n: int) -> bool:
    return bool((a.position[n] == b.position[n]).all() and (a.rotation[n] == b.rotation[n]).all())


def _put(m: Motions, n: int, position: F64, rotation: F64) -> None:
    """Note n rests at a pose. `m` is changed."""
    m.position[n], m.rotation[n], m.velocity[n], m.spin[n] = position, rotation, 0.0, 0.0
    m.mode[n], m.still[n] = ASLEEP, 0


def _stuck_to(m: Motions, s: Solids, n: int, among: set[int]) -> int | None:
    return next((k for k in sorted(among) if k != n and _contact(m, s, n, k, THICK) is not None), None)


def _go_along(m: Motions, was: Motions, n: int, k: int) -> None:
    """Note n moves as thing k has. `m` is changed."""
    turn = matrix_from_quaternion(m.rotation[k]) @ matrix_from_quaternion(was.rotation[k]).T
    place = m.position[k] + turn @ (was.position[n] - was.position[k])
    _put(m, n, place, quaternion_from_matrix(np.ascontiguousarray(turn @ matrix_from_quaternion(was.rotation[n]))))


def _nearest(m: Motions, s: Solids, n: int, walls: bool) -> tuple[F64 | None, F64, int] | None:
    """What note n would stick to: a point (3,) of it, None where it is not flat; the unit normal (3,) out of it; its row, -1 for a
    wall. None: nothing is near."""
    found = sorted(_surfaces(m, s, n, walls), key=lambda f: -f[0])
    return found[0][1:] if found else None


def _surfaces(m: Motions, s: Solids, n: int, walls: bool) -> Iterator[tuple[float, F64 | None, F64, int]]:
    """What is near note n: how deep it is in that [m], and as `_nearest` has it."""
    for k in np.flatnonzero(s.holds_notes | (s.inverse_mass == 0.0)).tolist():
        if k != n and not s.things[k].hidden and (found := _contact(m, s, n, k, NEAR)) is not None:
            depth, point, normal = found
            if normal[1] > -STEEP:
                yield depth, point, normal, k
    for axis, side in ((0, -1.0), (0, 1.0), (2, -1.0), (2, 1.0)) if walls else ():
        depth = side * float(m.position[n, axis]) - HALF_WIDTH
        if depth > -NEAR:
            normal = np.zeros(3)
            normal[axis] = -side
            yield depth, m.position[n] + depth * normal, normal, -1


def _contact(m: Motions, s: Solids, n: int, k: int, margin: float) -> tuple[float, F64 | None, F64] | None:
    """How deep note n is in thing k where it is deepest [m]; a point (3,) of the thing's surface, None where that is not flat; the
    unit normal (3,) out of the thing. None: the thing is further away than `margin` [m]."""
    off = m.position[n] - m.position[k]
    if math.sqrt(float(off @ off)) > float(s.radius[n] + s.radius[k]) + margin:
        return None
    front = front_of(s.things[k]) if s.holds_notes[k] else None
    parts = s.part(n), s.part(k) if front is None else s.first_part(k)
    mine, its = (p.moved(matrix_from_quaternion(m.rotation[i]), m.position[i]) for i, p in zip((n, k), parts, strict=True))
    found = find_contacts(mine, its, margin=margin)
    if len(found) == 0:
        return None
    deepest = int(found.depth.argmax())
    depth, normal = float(found.depth[deepest]), -found.normal[deepest]
    if front is None:
        return depth, None, normal
    # The side on which the note's middle is, also where its edge is deep in the thing.
    face, thick = front.posed(m.position[k], m.rotation[k]), s.things[k].primitives[0].params[0]
    if float((m.position[n] - face.corner) @ face.normal) > -thick:
        return depth, face.corner, face.normal
    return depth, face.corner - 2.0 * thick * face.normal, -face.normal


def _stick(m: Motions, s: Solids, n: int, point: F64 | None, normal: F64, k: int) -> None:
    """Note n lies against a surface. `m` is changed."""
    turn = quaternion_from_matrix(np.ascontiguousarray(_upright(normal, matrix_from_quaternion(m.rotation[n]))))
    out_of = 0.0 if point is None else float((point - m.position[n]) @ normal) + THICK + SLACK
    _put(m, n, m.position[n] + out_of * normal, turn)
    for _ in range(_ROUNDS if point is None else 0):
        if (now := _contact(m, s, n, k, 2.0 * NEAR)) is not None:
            _put(m, n, m.position[n] + (now[0] + SLACK) * normal, turn)


def _upright(normal: F64, now: F64) -> F64:
    """(3, 3) the turn of a note whose front is along `normal`: its upper edge up, or where that lies, as near as it is `now`."""
    up = np.array([0.0, 1.0, 0.0]) if abs(float(normal[1])) < STEEP else now[:, 1]
    up = up - float(up @ normal) * normal
    if float(up @ up) < 1e-6:  # it stood on its edge
        up = now[:, 2] - float(now[:, 2] @ normal) * normal
    up = up / np.sqrt(up @ up)
    return np.stack([np.cross(up, normal), up, normal], axis=1)
