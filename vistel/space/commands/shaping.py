"""Commands that say what things are, and which there are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.implicit.contacts.contact import find_contacts
from vistel.space import actions as ask
from vistel.space.actions import Refused, Which
from vistel.space.commands import create as makes
from vistel.space.commands import reshape
from vistel.space.commands.asked import Answer, Asked, changed, exchanged, lowest, on_its_foot, performs
from vistel.space.commands.placing import axis_in_room, free_spot, place_meant
from vistel.space.dynamics.dynamics import HELD
from vistel.space.hands import grasp as hands
from vistel.space.history import Change, PlacedThing
from vistel.space.holding import holding
from vistel.space.things.things import Thing

MOST_THINGS = 600
NEAR = 0.03
"""Things that are attached lie no further apart than this [m]."""


def edited(asked: Asked, which: Which, edit: Callable[[int], Thing]) -> Answer:
    """Things changed one by one, each standing where it stood."""
    rows = asked.mine(which)
    after = [on_its_foot(asked.stood(n), edit(n)) for n in rows]
    return changed(asked, rows, after), tuple(x.thing.id for x in after)


@performs(ask.Scale)
def scale(asked: Asked, action: ask.Scale) -> Answer:
    if not 0.01 <= action.factor <= 100.0:
        raise Refused(f"things can be made 0.01 to 100 times as large, not {action.factor:g} times")
    if action.along is None:
        return edited(asked, action.which, lambda n: reshape.scaled(asked.state.things[n], action.factor))
    along = action.along

    def longer(n: int) -> Thing:
        if along is ask.Along.GIRTH:
            thing = asked.state.things[n]
            for k in {0, 1, 2} - {reshape.longest_axis(thing)}:
                thing = reshape.stretched(thing, action.factor, np.eye(3)[k])
            return thing
        r = matrix_from_quaternion(asked.state.motions.rotation[n])
        axis = r.T @ axis_in_room(asked, n, along)
        nearest = int(np.argmax(np.abs(axis)))  # along one of its own axes, so that a box stays a box
        return reshape.stretched(asked.state.things[n], action.factor, np.eye(3)[nearest])

    return edited(asked, action.which, longer)


@performs(ask.Bend)
def bend(asked: Asked, action: ask.Bend) -> Answer:
    def bent(n: int) -> Thing:
        thing = asked.state.things[n]
        side = matrix_from_quaternion(asked.state.motions.rotation[n]).T @ np.array([0.0, 1.0, 0.0])
        if thing.curve is None:
            return reshape.curved(thing, action.angle, 0.0, side)
        return reshape.curved(thing.curve.straight, action.angle, thing.curve.arc.twist, thing.curve.arc.side)

    return edited(asked, action.which, bent)


@performs(ask.Twist)
def twist(asked: Asked, action: ask.Twist) -> Answer:
    def twisted(n: int) -> Thing:
        thing = asked.state.things[n]
        if thing.curve is None:
            return reshape.curved(thing, 0.0, action.angle, np.array([0.0, 1.0, 0.0]))
        return reshape.curved(thing.curve.straight, thing.curve.arc.bend, action.angle, thing.curve.arc.side)

    return edited(asked, action.which, twisted)


@performs(ask.Paint)
def paint(asked: Asked, action: ask.Paint) -> Answer:
    return edited(asked, action.which, lambda n: reshape.painted(asked.state.things[n], action.colour))


@performs(ask.Harden)
def harden(asked: Asked, action: ask.Harden) -> Answer:
    if not 0.0 <= action.rigidity <= 1.0:
        raise Refused(f"rigidity is 0 (as soft as flesh) to 1 (rigid), not {action.rigidity:g}")
    return edited(asked, action.which, lambda n: reshape.hardened(asked.state.things[n], action.rigidity))


def _added(asked: Asked, things: Sequence[PlacedThing]) -> Answer:
    if len(asked.state.things) + len(things) > MOST_THINGS:
        raise Refused(f"the room is full: it holds {MOST_THINGS} things")
    return changed(asked, (), things), tuple(x.thing.id for x in things)


@performs(ask.Copy)
def copy(asked: Asked, action: ask.Copy) -> Answer:
    n = asked.one(action.which)
    x = asked.stood(n)
    if x.thing.fixed:
        raise Refused(f"the {x.thing.name} is fixed to the room")
    number = makes.unused(x.thing.id.rstrip("0123456789-") or x.thing.id, asked.ids())
    name = f"{x.thing.name.rstrip('0123456789 ')} {number.rpartition('-')[2]}"
    thing = replace(x.thing, id=number, name=name, parts=())
    foot = x.position + 2.0 * float(asked.solids.radius[n]) * asked.speaker.right
    foot[1] = lowest(x.thing, x.position, x.rotation)
    spot = free_spot(asked, thing, foot, x.rotation)
    return _added(asked, [PlacedThing(replace(thing, position=spot, rotation=x.rotation), spot, x.rotation)])


@performs(ask.Create)
def create(asked: Asked, action: ask.Create) -> Answer:
    thing = makes.created(action.shape, action.size, action.colour, asked.ids())
    spot = free_spot(asked, thing, place_meant(asked, action.where), thing.rotation)
    return _added(asked, [PlacedThing(replace(thing, position=spot), spot, thing.rotation)])


@performs(ask.Delete)
def delete(asked: Asked, action: ask.Delete) -> Answer:
    rows = asked.mine(action.which, tracked=True)
    gone = tuple(asked.state.things[n].id for n in rows)
    return changed(asked, rows, ()), gone


@performs(ask.Attach)
def attach(asked: Asked, action: ask.Attach) -> Answer:
    a, b = asked.one(action.which), asked.one(action.to)
    if a == b:
        raise Refused("a thing cannot be attached to itself; say what to")
    for n in (a, b):
        asked.check_mine(n)
    x, y = asked.stood(a), asked.stood(b)
    one, other = (asked.solids.part(n).moved(matrix_from_quaternion(z.rotation), z.position) for n, z in ((a, x), (b, y)))
    if len(find_contacts(one, other, margin=NEAR)) == 0:
        raise Refused(f"the {x.thing.name} and the {y.thing.name} are apart; bring them together first")
    whole, centre = reshape.joined(x.thing, (x.position, x.rotation), y.thing, (y.position, y.rotation))
    state, posed = asked.state, asked.speaker.posed
    if posed is not None:  # who holds one of them now holds both
        pose = Pose(centre, x.rotation)
        state = replace(
            state,
            grasps=tuple(
                hands.renamed(g, posed, whole.id, pose) if g.thing in (x.thing.id, y.thing.id) else g for g in state.grasps
            ),
        )
    after = PlacedThing(whole, centre, x.rotation)
    out = exchanged(state, asked.solids, (a, b), (after,))
    m = out.motions.copy()
    n = out.rows[whole.id]
    m.position[n], m.rotation[n] = centre, x.rotation
    if holding.holders(out, whole.id):
        m.mode[n], m.still[n] = HELD, 0
    out = replace(out, motions=m, history=out.history.with_change(Change(asked.who, (x, y), (after,))))
    return out, (x.thing.id, y.thing.id)


@performs(ask.Detach)
def detach(asked: Asked, action: ask.Detach) -> Answer:
    rows = asked.loose(action.which)
    after: list[PlacedThing] = []
    for n in rows:
        x = asked.stood(n)
        if not x.thing.parts:
            raise Refused(f"the {x.thing.name} is in one piece")
        r = matrix_from_quaternion(x.rotation)
        for part in x.thing.parts:
            turned = np.ascontiguousarray(r @ matrix_from_quaternion(part.rotation))
            after.append(PlacedThing(part.thing, x.position + r @ part.position, quaternion_from_matrix(turned)))
    return changed(asked, rows, after), tuple(x.thing.id for x in after)
