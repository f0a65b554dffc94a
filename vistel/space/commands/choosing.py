"""Commands about hands, choices and second thoughts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.contacts.contact import find_contacts
from vistel.space import actions as ask
from vistel.space.actions import Refused
from vistel.space.commands.asked import Answer, Asked, changed, exchanged, on_its_foot, performs
from vistel.space.dynamics.dynamics import ASLEEP, FIXED
from vistel.space.hands import grasp as hands
from vistel.space.history import History, PlacedThing
from vistel.space.holding import holding, ownership
from vistel.space.state import State

NEAR = 0.03
"""A hand that is asked to take hold is no further off than this [m]."""


@performs(ask.Select)
def select(asked: Asked, action: ask.Select) -> Answer:
    ids = () if action.nothing else tuple(asked.state.things[n].id for n in asked.rows(action.which))
    chosen = dict(asked.state.selected) | {asked.who: ids}
    return replace(asked.state, selected=tuple(sorted((who, some) for who, some in chosen.items() if some))), ids


@performs(ask.Hide)
def hide(asked: Asked, action: ask.Hide) -> Answer:
    rows = asked.mine(action.which, tracked=True)
    seen = [n for n in rows if not asked.state.things[n].hidden]
    if not seen:
        raise Refused(f"the {asked.state.things[rows[0]].name} is hidden already")
    return _veiled(asked, seen, True)


@performs(ask.Show)
def show(asked: Asked, action: ask.Show) -> Answer:
    """\"This" is all that is hidden: nobody can point at it."""
    if not any(t.hidden for t in asked.state.things):
        raise Refused("nothing is hidden")
    if action.which.is_this:
        return _veiled(asked, [n for n, t in enumerate(asked.state.things) if t.hidden], False)
    return _veiled(asked, asked.rows(action.which, hidden=True), False)


def _veiled(asked: Asked, rows: Sequence[int], hidden: bool) -> Answer:
    after = [replace(asked.stood(n), thing=replace(asked.state.things[n], hidden=hidden), dents=asked.dents(n)) for n in rows]
    return changed(asked, rows, after), tuple(x.thing.id for x in after)


@performs(ask.Grip)
def grip(asked: Asked, action: ask.Grip) -> Answer:
    n = asked.one(action.which)
    thing, posed, s = asked.state.things[n], asked.speaker.posed, asked.solids
    asked.check_mine(n, held=action.force)
    if asked.who in holding.holders(asked.state, thing.id):
        return ownership.forced(asked.state, asked.who, thing.id), (thing.id,)
    busy = {g.right for g in asked.state.grasps if g.participant == asked.who}
    found: list[tuple[bool, hands.Reach]] = []
    if posed is not None:
        m = asked.state.motions
        near = find_contacts(posed.primitives, s.part(n).moved(matrix_from_quaternion(m.rotation[n]), m.position[n]), margin=NEAR)
        owner = np.full(len(s.part(n)), n, np.int64)
        found = [(right, r) for right in (False, True) if right not in busy for r in hands.reaches(posed, near, owner, right)]
    if not found or posed is None:
        raise Refused(f"none of your free hands is at the {thing.name}; bring it nearer than {1e2 * NEAR:.0f} cm")
    right, reach = min(found, key=lambda f: (f[1].nearest, f[0]))
    reach = reach if any(reach.engaged) else replace(reach, engaged=(True,) * 4)
    return holding.grasped(ownership.forced(asked.state, asked.who, thing.id), s, posed, right, reach), (thing.id,)


@performs(ask.Release)
def release(asked: Asked, action: ask.Release) -> Answer:
    which = replace(action.which, shown=ask.Shown.HELD, every=True) if action.which.is_this else action.which
    ids = [asked.state.things[n].id for n in asked.rows(which)]
    for thing in ids:
        if asked.who not in holding.holders(asked.state, thing):
            raise Refused(f"{asked.who} does not hold the {asked.state.things[asked.state.rows[thing]].name}")
    return holding.drop(asked.state, lambda g: g.thing in ids and g.participant == asked.who), tuple(ids)


@performs(ask.Undo)
def undo(asked: Asked, action: ask.Undo) -> Answer:
    change = asked.state.history.last(asked.who)
    if change is None:
        raise Refused("you have done nothing that can be taken back")
    state = _reverted(asked, change.after, change.before)
    return replace(state, history=asked.state.history.taken_back(change)), tuple(x.thing.id for x in change.before)


@performs(ask.Redo)
def redo(asked: Asked, action: ask.Redo) -> Answer:
    change = asked.state.history.last(asked.who, undone=True)
    if change is None:
        raise Refused("you have taken nothing back since you last did something")
    state = _reverted(asked, change.before, change.after)
    return replace(state, history=asked.state.history.done_again(change)), tuple(x.thing.id for x in change.after)


def _reverted(asked: Asked, there: Sequence[PlacedThing], instead: Sequence[PlacedThing]) -> State:
    """`instead` in the place of `there`, which must still be as they were made."""
    rows: list[int] = []
    for x in there:
        n = asked.state.rows.get(x.thing.id)
        if n is None or asked.state.things[n] is not x.thing:
            raise Refused(f"the {x.thing.name} has been changed since")
        asked.check_mine(n)
        rows.append(n)
    known = {x.thing.id: x for x in there}
    after: list[PlacedThing] = []
    for x in instead:
        old = known.get(x.thing.id)
        if old is None and x.thing.id in asked.state.rows:
            raise Refused(f"there is another {x.thing.name} by now")
        reshaped = old is not None and old.thing is not x.thing and len(there) == len(instead)
        # What was only reshaped stays where it is now; what was moved, taken out or joined goes back.
        here = on_its_foot(asked.stood(asked.state.rows[x.thing.id]), x.thing) if reshaped else x
        after.append(replace(here, dents=x.dents))
    return exchanged(asked.state, asked.solids, rows, after)


@performs(ask.Stop)
def stop(asked: Asked, action: ask.Stop) -> Answer:
    mine = [g for g in asked.state.glides if g.participant == asked.who]
    return holding.glides_ended(asked.state, {g.thing for g in mine}), tuple(g.thing for g in mine)


@performs(ask.Reset)
def reset(asked: Asked, action: ask.Reset) -> Answer:
    state = holding.drop(asked.state, lambda g: True)
    before = range(len(state.things))
    now = replace(asked, state=state)
    after = [PlacedThing(t, t.position, t.rotation) for t in asked.room.things]
    out = exchanged(state, now.solids, before, after)
    out = replace(out, dents=(), bonds=(), glides=(), selected=(), history=History())
    return _asleep(out), ()


def _asleep(state: State) -> State:
    """The room as it begins: everything asleep where it stands."""
    m = state.motions.copy()
    for n, thing in enumerate(state.things):
        m.mode[n] = FIXED if thing.fixed else ASLEEP
    return replace(state, motions=m)
