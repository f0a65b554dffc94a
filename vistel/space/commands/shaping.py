"""Commands that change the shape or material of things, and create, copy, join and remove things."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.implicit.contacts.contact import find_contacts
from vistel.space import actions as ask
from vistel.space.actions import Refused
from vistel.space.arguments import Along, Which
from vistel.space.commands import create as makes
from vistel.space.commands import reshape
from vistel.space.commands.context import Answer, Context, changed, exchanged, lowest, on_its_foot, performs
from vistel.space.commands.noting import id_of_new
from vistel.space.commands.placing import axis_in_room, free_spot, place_meant
from vistel.space.dynamics.dynamics import HELD
from vistel.space.hands import grasp as hands
from vistel.space.history import Change, PlacedThing
from vistel.space.holding import holding
from vistel.space.notes.note import SHAPE as NOTE
from vistel.space.things.things import Thing

MOST_THINGS = 600
NEAR = 0.03
"""Things that are attached lie no further apart than this [m]."""


def edited(context: Context, which: Which, edit: Callable[[int], Thing]) -> Answer:
    """Things changed one by one, each standing where it stood."""
    rows = context.mine(which)
    after = [on_its_foot(context.placed(n), edit(n)) for n in rows]
    return changed(context, rows, after), tuple(x.thing.id for x in after)


@performs(ask.Scale)
def scale(context: Context, action: ask.Scale) -> Answer:
    """Make things larger or smaller; in one direction along the nearest of their own axes."""
    if not 0.01 <= action.factor <= 100.0:
        raise Refused(f"things can be made 0.01 to 100 times as large, not {action.factor:g} times")
    if action.along is None:
        return edited(context, action.which, lambda n: reshape.scaled(context.state.things[n], action.factor))
    along = action.along

    def longer(n: int) -> Thing:
        if along is Along.GIRTH:
            thing = context.state.things[n]
            for k in {0, 1, 2} - {reshape.longest_axis(thing)}:
                thing = reshape.stretched(thing, action.factor, np.eye(3)[k])
            return thing
        r = matrix_from_quaternion(context.state.motions.rotation[n])
        axis = r.T @ axis_in_room(context, n, along)
        nearest = int(np.argmax(np.abs(axis)))  # along one of its own axes, so that a box stays a box
        return reshape.stretched(context.state.things[n], action.factor, np.eye(3)[nearest])

    return edited(context, action.which, longer)


@performs(ask.Bend)
def bend(context: Context, action: ask.Bend) -> Answer:
    """Bend things upwards, from the shape that they have when straight."""

    def bent(n: int) -> Thing:
        thing = context.state.things[n]
        side = matrix_from_quaternion(context.state.motions.rotation[n]).T @ np.array([0.0, 1.0, 0.0])
        if thing.curve is None:
            return reshape.curved(thing, action.angle, 0.0, side)
        return reshape.curved(thing.curve.straight, action.angle, thing.curve.arc.twist, thing.curve.arc.side)

    return edited(context, action.which, bent)


@performs(ask.Twist)
def twist(context: Context, action: ask.Twist) -> Answer:
    """Twist things, from the shape that they have when straight."""

    def twisted(n: int) -> Thing:
        thing = context.state.things[n]
        if thing.curve is None:
            return reshape.curved(thing, 0.0, action.angle, np.array([0.0, 1.0, 0.0]))
        return reshape.curved(thing.curve.straight, thing.curve.arc.bend, action.angle, thing.curve.arc.side)

    return edited(context, action.which, twisted)


@performs(ask.Paint)
def paint(context: Context, action: ask.Paint) -> Answer:
    """Give things a colour."""
    return edited(context, action.which, lambda n: reshape.painted(context.state.things[n], action.colour))


@performs(ask.Harden)
def harden(context: Context, action: ask.Harden) -> Answer:
    """Give things a rigidity."""
    if not 0.0 <= action.rigidity <= 1.0:
        raise Refused(f"rigidity is 0 (as soft as flesh) to 1 (rigid), not {action.rigidity:g}")
    return edited(context, action.which, lambda n: reshape.hardened(context.state.things[n], action.rigidity))


def _added(context: Context, things: Sequence[PlacedThing]) -> Answer:
    if len(context.state.things) + len(things) > MOST_THINGS:
        raise Refused(f"the room is full: it holds {MOST_THINGS} things")
    return changed(context, (), things), tuple(x.thing.id for x in things)


@performs(ask.Copy)
def copy(context: Context, action: ask.Copy) -> Answer:
    """Put a copy of a thing to the speaker's right of it."""
    n = context.one(action.which)
    x = context.placed(n)
    if x.thing.fixed:
        raise Refused(f"the {x.thing.name} is fixed to the room")
    if x.thing.shape == NOTE:
        number, name = id_of_new(context), x.thing.name
    else:
        number = makes.unused(x.thing.id.rstrip("0123456789-") or x.thing.id, context.ids())
        name = f"{x.thing.name.rstrip('0123456789 ')} {number.rpartition('-')[2]}"
    thing = replace(x.thing, id=number, name=name, parts=())
    foot = x.position + 2.0 * float(context.solids.radius[n]) * context.speaker.right
    foot[1] = lowest(x.thing, x.position, x.rotation)
    spot = free_spot(context, thing, foot, x.rotation)
    return _added(context, [PlacedThing(replace(thing, position=spot, rotation=x.rotation), spot, x.rotation)])


@performs(ask.Create)
def create(context: Context, action: ask.Create) -> Answer:
    """Put a new thing at a free spot near the place that is meant."""
    thing = makes.created(action.shape, action.size, action.colour, context.ids())
    spot = free_spot(context, thing, place_meant(context, action.where), thing.rotation)
    return _added(context, [PlacedThing(replace(thing, position=spot), spot, thing.rotation)])


@performs(ask.Delete)
def delete(context: Context, action: ask.Delete) -> Answer:
    """Take things out of the room."""
    rows = context.mine(action.which, tracked=True)
    gone = tuple(context.state.things[n].id for n in rows)
    return changed(context, rows, ()), gone


@performs(ask.Attach)
def attach(context: Context, action: ask.Attach) -> Answer:
    """Make one thing of two that touch; whoever holds one of them holds both."""
    a, b = context.one(action.which), context.one(action.to)
    if a == b:
        raise Refused("a thing cannot be attached to itself; say what to")
    for n in (a, b):
        context.check_mine(n)
        context.check_free(n)
    x, y = context.placed(a), context.placed(b)
    one, other = (context.solids.part(n).moved(matrix_from_quaternion(z.rotation), z.position) for n, z in ((a, x), (b, y)))
    if len(find_contacts(one, other, margin=NEAR)) == 0:
        raise Refused(f"the {x.thing.name} and the {y.thing.name} are apart; bring them together first")
    whole, centre = reshape.joined(x.thing, (x.position, x.rotation), y.thing, (y.position, y.rotation))
    state, posed = context.state, context.speaker.posed
    if posed is not None:  # who holds one of them now holds both
        pose = Pose(centre, x.rotation)
        state = replace(
            state,
            grasps=tuple(
                hands.renamed(g, posed, whole.id, pose) if g.thing in (x.thing.id, y.thing.id) else g for g in state.grasps
            ),
        )
    after = PlacedThing(whole, centre, x.rotation)
    out = exchanged(state, context.solids, (a, b), (after,))
    m = out.motions.copy()
    n = out.rows[whole.id]
    m.position[n], m.rotation[n] = centre, x.rotation
    if holding.holders(out, whole.id):
        m.mode[n], m.still[n] = HELD, 0
    out = replace(out, motions=m, history=out.history.with_change(Change(context.who, (x, y), (after,))))
    return out, (x.thing.id, y.thing.id)


@performs(ask.Detach)
def detach(context: Context, action: ask.Detach) -> Answer:
    """Take things apart into what they were attached of."""
    rows = context.loose(action.which)
    after: list[PlacedThing] = []
    for n in rows:
        x = context.placed(n)
        if not x.thing.parts:
            raise Refused(f"the {x.thing.name} is in one piece")
        r = matrix_from_quaternion(x.rotation)
        for part in x.thing.parts:
            turned = np.ascontiguousarray(r @ matrix_from_quaternion(part.rotation))
            after.append(PlacedThing(part.thing, x.position + r @ part.position, quaternion_from_matrix(turned)))
    return changed(context, rows, after), tuple(x.thing.id for x in after)
