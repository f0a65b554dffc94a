"""One step of dents and bonds, for the things whose material keeps them."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.implicit.contacts.contact import find_contacts
from vistel.space.boards.stroke import Stroke
from vistel.space.dynamics.solids import Solids
from vistel.space.materials.bond_forces import frame_of, regrasped
from vistel.space.memory.bonds import NEAR, Bond, Frame, StickyTouch, Torn, glue_of, published_alike, stick
from vistel.space.memory.dents import MOST_IN_ROOM, DentRecord, Press, deepest, remember
from vistel.space.people import Posed
from vistel.space.state import State
from vistel.space.things.things import ThingPrimitive

REACH = 0.75
"""How far round it a bond deforms a limb: this share of the sum of the radii at the limb's two ends."""
LEAST_REACH = 0.012
"""A bond deforms at least this far [m]."""
MOST_REACH = 0.02
"""A bond deforms a thing at most this far [m]."""


def remembered(state: State, s: Solids, posed: Mapping[str, Posed], dt: float) -> tuple[State, tuple[Torn, ...]]:
    """The state with dents pressed and recovered, and bonds made, moved and torn, after all motion; and the torn bonds."""
    chosen = s.remembering
    if not chosen and not (state.dents or state.bonds):
        return state, ()
    dents: list[DentRecord] = []
    bonds: list[Bond] = []
    torn: list[Torn] = []
    number = state.marks
    for n in chosen:
        thing = s.things[n]
        frame = matrix_from_quaternion(state.motions.rotation[n]), state.motions.position[n]
        presses, grips = _touches(n, state, s, posed, frame)
        if thing.material.elasticity != "elastic" and thing.compliance > 0.0:
            before = [d for d in state.dents if d.thing == thing.id]
            more, number = remember(before, thing.id, thing.material, s.part(n), presses, number, state.t_ns, dt)
            dents += more
        if thing.material.sticky > 0.0:
            held = [b for b in state.bonds if b.thing == thing.id]
            stuck = stick(
                held,
                thing.id,
                lambda b, t=thing, size=float(s.radius[n]): glue_of(t, size, b.reach),
                frame,
                grips,
                lambda body, primitive: frame_of(state, posed, body, primitive),
                number,
                state.t_ns,
                dt,
            )
            number, bonds, torn = stuck.next_number, [*bonds, *stuck.bonds], [*torn, *stuck.torn]
    state = state.but(dents=deepest(dents, MOST_IN_ROOM), bonds=tuple(bonds), marks=number)
    return regrasped(state, posed, frozenset(x for t in torn for x in (t.thing, t.body))), tuple(torn)


def changes(before: State, now: State) -> tuple[frozenset[int], tuple[int, ...]]:
    """Numbers of new or changed dents, bonds and strokes, and of ended ones. An unchanged one is the same object."""
    same_ink = before.strokes is now.strokes
    if same_ink and not (before.dents or before.bonds or now.dents or now.bonds):
        return frozenset(), ()
    old = {mark.number: mark for mark in (*before.dents, *before.bonds, *(() if same_ink else before.strokes))}
    new = {mark.number: mark for mark in (*now.dents, *now.bonds, *(() if same_ink else now.strokes))}
    fresh = frozenset(k for k, mark in new.items() if not _unchanged(old.get(k), mark))
    return fresh, tuple(sorted(old.keys() - new.keys()))


def _unchanged(old: DentRecord | Bond | Stroke | None, mark: DentRecord | Bond | Stroke) -> bool:
    if isinstance(old, Bond) and isinstance(mark, Bond):
        return published_alike(old, mark)
    return old is mark


def _touches(n: int, state: State, s: Solids, posed: Mapping[str, Posed], frame: Frame) -> tuple[list[Press], list[StickyTouch]]:
    """The bodies that overlap thing n as shapes in its frame, and the points of touch."""
    rotation, position = frame
    body = s.part(n).moved(rotation, position)
    presses: list[Press] = []
    grips: list[StickyTouch] = []
    for name in sorted(posed):
        p = posed[name]
        c = find_contacts(p.primitives, body, margin=NEAR)
        for k in _deepest(c.a, c.field_depth):
            i, b = int(c.a[k]), p.body
            a_end, b_end = (rotation.T @ (end - position) for end in (b.a[i], b.b[i]))
            ends = (*a_end.tolist(), *b_end.tolist(), float(b.radius_a[i]), float(b.radius_b[i]))
            depth = float(c.field_depth[k])
            if depth > 0.0:
                presses.append(Press(name, i, ThingPrimitive("cone_sphere", ends), depth))
            grips.append(StickyTouch(name, i, c.point[k], max(LEAST_REACH, REACH * float(b.radius_a[i] + b.radius_b[i]))))
    sticky = s.things[n].material.sticky > 0.0
    for m, other in enumerate(s.things):
        if m == n or (other.fixed and not sticky) or _far(state, m, n) > s.radius[m] + s.radius[n] + NEAR:
            continue
        turn = matrix_from_quaternion(state.motions.rotation[m])
        c = find_contacts(s.part(m).moved(turn, state.motions.position[m]), body, margin=NEAR if sticky else 0.0)
        for k in _deepest(c.a, c.field_depth):
            i, depth = int(c.a[k]), float(c.field_depth[k])
            if depth > 0.0 and not other.fixed:
                presses.append(Press(other.id, i, _seen_from(other.primitives[i], turn, state.motions.position[m], frame), depth))
            if sticky and not (m < n and other.material.sticky > 0.0):  # of two that stick the first one's glue counts
                grips.append(
                    StickyTouch(other.id, i, c.point[k], min(MOST_REACH, max(LEAST_REACH, REACH * float(s.bound[s.first[n]]))))
                )
    return presses, grips


def _deepest(a: NDArray[np.int32], depth: F64) -> list[int]:
    """Of every primitive a, its deepest contact; in order."""
    best: dict[int, int] = {}
    for k in range(len(a)):
        if int(a[k]) not in best or depth[k] > depth[best[int(a[k])]]:
            best[int(a[k])] = k
    return [best[i] for i in sorted(best)]


def _seen_from(p: ThingPrimitive, turn: F64, at: F64, frame: Frame) -> ThingPrimitive:
    """A primitive of a thing at `turn`, `at`, in another frame."""
    rotation, position = frame
    r = rotation.T @ turn @ matrix_from_quaternion(p.rotation)
    place = rotation.T @ (turn @ p.position + at - position)
    return ThingPrimitive(p.kind, p.params, place, quaternion_from_matrix(np.ascontiguousarray(r)))


def _far(state: State, m: int, n: int) -> float:
    d = state.motions.position[m] - state.motions.position[n]
    return float(np.sqrt(d @ d))
