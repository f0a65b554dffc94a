"""Commands for taking and letting go, selecting, hiding, undoing and stopping."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.contacts.contact import find_contacts
from vistel.space import actions as ask
from vistel.space.actions import Refused
from vistel.space.arguments import Shown
from vistel.space.commands.context import Answer, Context, changed, exchanged, on_its_foot, performs
from vistel.space.dynamics.dynamics import ASLEEP, FIXED
from vistel.space.hands import grasp as hands
from vistel.space.hands.reach_kernels import PAIRS
from vistel.space.history import Change, History, PlacedThing
from vistel.space.holding import holding, ownership
from vistel.space.ink import reverted
from vistel.space.state import State

NEAR = 0.03
"""Greatest distance from which a hand can be asked to take hold [m]."""


@performs(ask.Select)
def select(context: Context, action: ask.Select) -> Answer:
    """From now on "this" means these things for the speaker, or nothing."""
    ids = () if action.nothing else tuple(context.state.things[n].id for n in context.rows(action.which))
    chosen = dict(context.state.selected) | {context.who: ids}
    return replace(context.state, selected=tuple(sorted((who, some) for who, some in chosen.items() if some))), ids


@performs(ask.Hide)
def hide(context: Context, action: ask.Hide) -> Answer:
    """Draw things no more."""
    rows = context.mine(action.which, tracked=True)
    seen = [n for n in rows if not context.state.things[n].hidden]
    if not seen:
        raise Refused(f"the {context.state.things[rows[0]].name} is hidden already")
    return _veiled(context, seen, True)


@performs(ask.Show)
def show(context: Context, action: ask.Show) -> Answer:
    """\"This" is all that is hidden: nobody can point at it."""
    if not any(t.hidden for t in context.state.things):
        raise Refused("nothing is hidden")
    if action.which.is_this:
        return _veiled(context, [n for n, t in enumerate(context.state.things) if t.hidden], False)
    return _veiled(context, context.rows(action.which, hidden=True), False)


def _veiled(context: Context, rows: Sequence[int], hidden: bool) -> Answer:
    after = [
        replace(context.placed(n), thing=replace(context.state.things[n], hidden=hidden), dents=context.dents(n)) for n in rows
    ]
    return changed(context, rows, after), tuple(x.thing.id for x in after)


@performs(ask.Grip)
def grip(context: Context, action: ask.Grip) -> Answer:
    """Put a free hand of the speaker round a thing that it reaches, even if it is open."""
    n = context.one(action.which)
    thing, posed, s = context.state.things[n], context.speaker.posed, context.solids
    context.check_mine(n, held=action.force)
    if context.who in holding.holders(context.state, thing.id):
        return ownership.forced(context.state, context.who, thing.id), (thing.id,)
    busy = {g.right for g in context.state.grasps if g.participant == context.who}
    found: list[tuple[bool, hands.Reach]] = []
    if posed is not None:
        m = context.state.motions
        near = find_contacts(posed.primitives, s.part(n).moved(matrix_from_quaternion(m.rotation[n]), m.position[n]), margin=NEAR)
        owner = np.full(len(s.part(n)), n, np.int64)
        found = [(right, r) for right in (False, True) if right not in busy for r in hands.reaches(posed, near, owner, right)]
    if not found or posed is None:
        raise Refused(f"none of your free hands is at the {thing.name}; bring it nearer than {1e2 * NEAR:.0f} cm")
    right, reach = min(found, key=lambda f: (f[1].nearest, f[0]))
    free = ownership.forced(context.state, context.who, thing.id)
    return holding.grasped(free, s, posed, right, reach, np.zeros(PAIRS, np.bool_)), (thing.id,)


@performs(ask.Release)
def release(context: Context, action: ask.Release) -> Answer:
    """Take things out of the speaker's hands."""
    which = replace(action.which, shown=Shown.HELD, every=True) if action.which.is_this else action.which
    ids = [context.state.things[n].id for n in context.rows(which)]
    for thing in ids:
        if context.who not in holding.holders(context.state, thing):
            raise Refused(f"{context.who} does not hold the {context.state.things[context.state.rows[thing]].name}")
    return holding.drop(context.state, lambda g: g.thing in ids and g.participant == context.who), tuple(ids)


@performs(ask.Undo)
def undo(context: Context, action: ask.Undo) -> Answer:
    """Take back the speaker's last change."""
    change = context.state.history.last(context.who)
    if change is None:
        raise Refused("you have done nothing that can be taken back")
    state = _reverted(context, change.after, change.before)
    state = reverted(state, change.drawn, change.rubbed, context.state.history.taken_back(change))
    return state, _ids(change)


@performs(ask.Redo)
def redo(context: Context, action: ask.Redo) -> Answer:
    """Do again what the speaker took back last."""
    change = context.state.history.last(context.who, undone=True)
    if change is None:
        raise Refused("you have taken nothing back since you last did something")
    state = _reverted(context, change.before, change.after)
    state = reverted(state, change.rubbed, change.drawn, context.state.history.done_again(change))
    return state, _ids(change, again=True)


def _ids(change: Change, again: bool = False) -> tuple[str, ...]:
    """Ids of the things that a change was taken back of, or was done to again, and of the boards of its strokes."""
    first, second = (change.after, change.before) if again else (change.before, change.after)
    if first or second:
        return tuple(x.thing.id for x in first or second)
    return tuple(dict.fromkeys(k.board for k in (*change.drawn, *change.rubbed)))


def _reverted(context: Context, there: Sequence[PlacedThing], instead: Sequence[PlacedThing]) -> State:
    """`instead` in the place of `there`, which must still be as they were made."""
    rows: list[int] = []
    for x in there:
        n = context.state.rows.get(x.thing.id)
        if n is None or context.state.things[n] is not x.thing:
            raise Refused(f"the {x.thing.name} has been changed since")
        context.check_mine(n)
        rows.append(n)
    known = {x.thing.id: x for x in there}
    after: list[PlacedThing] = []
    for x in instead:
        old = known.get(x.thing.id)
        if old is None and x.thing.id in context.state.rows:
            raise Refused(f"there is another {x.thing.name} by now")
        reshaped = old is not None and old.thing is not x.thing and len(there) == len(instead)
        # What was only reshaped stays where it is now; what was moved, taken out or joined goes back.
        here = on_its_foot(context.placed(context.state.rows[x.thing.id]), x.thing) if reshaped else x
        after.append(replace(here, dents=x.dents))
    return exchanged(context.state, context.solids, rows, after)


@performs(ask.Stop)
def stop(context: Context, action: ask.Stop) -> Answer:
    """End the glides that the speaker's commands have begun."""
    mine = [g for g in context.state.glides if g.participant == context.who]
    return holding.glides_ended(context.state, {g.thing for g in mine}), tuple(g.thing for g in mine)


@performs(ask.Reset)
def reset(context: Context, action: ask.Reset) -> Answer:
    """Everything as the room began; histories, dents, strokes and selections are gone."""
    state = holding.drop(context.state, lambda g: True)
    before = range(len(state.things))
    now = replace(context, state=state)
    after = [PlacedThing(t, t.position, t.rotation) for t in context.room.things]
    out = exchanged(state, now.solids, before, after)
    out = replace(out, dents=(), bonds=(), glides=(), selected=(), history=History(), strokes=(), pens=())
    return _asleep(out), ()


def _asleep(state: State) -> State:
    """The room as it begins: everything asleep where it stands."""
    m = state.motions.copy()
    for n, thing in enumerate(state.things):
        m.mode[n] = FIXED if thing.fixed else ASLEEP
    return state.but(motions=m)
