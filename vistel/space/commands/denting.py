"""A dent that is asked for: as a ball would leave it that was pressed into the side that the speaker sees."""

from dataclasses import replace

import numpy as np

from vistel.arrays import F64
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.contacts.contact import find_contacts
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space import actions as ask
from vistel.space.actions import Refused
from vistel.space.commands.context import Answer, Context, changed, performs
from vistel.space.commands.reshape import extent
from vistel.space.dynamics.solids import outline
from vistel.space.history import PlacedThing
from vistel.space.memory.dents import MOST, DentRecord, deepest, imprints
from vistel.space.things.things import PhysicsMaterial, ThingPrimitive

SOFT = 0.15
"""Compliance from which a thing can be dented."""
WIDE = 0.6
"""Radius of the ball, in half of the thing's smallest extent."""
_HALVINGS = 24


@performs(ask.Dent)
def dent(context: Context, action: ask.Dent) -> Answer:
    """Do it. What springs back is plastic from then on."""
    if not 0.0 < action.depth <= 1.0:
        raise Refused(f"a dent is above 0 and up to 1 times half of a thing's smallest extent deep, not {action.depth:g}")
    rows = context.rows(action.which)
    after: list[PlacedThing] = []
    number = context.state.marks
    for n in rows:
        thing = context.state.things[n]
        if thing.fixed:
            raise Refused(f"the {thing.name} is fixed to the room and cannot be dented")
        context.check_mine(n)
        if thing.compliance < SOFT:
            raise Refused(f"the {thing.name} is too hard to be dented; make it softer first")
        at = context.placed(n)
        shape, depth = _pressed(context, at, action.depth)
        material = thing.material if thing.material.elasticity != "elastic" else _plastic(thing.material)
        new = DentRecord(
            number, thing.id, "", 0, shape, depth, left_ns=max(1, context.state.t_ns), fade_ns=round(material.recovery * 1e9)
        )
        number += 1
        after.append(replace(at, thing=replace(thing, material=material), dents=deepest((*context.dents(n), new), MOST)))
    state = changed(context, rows, after)
    return state.but(marks=number), tuple(x.thing.id for x in after)


def _plastic(material: PhysicsMaterial) -> PhysicsMaterial:
    return replace(material, elasticity="plastic", recovery=0.0)


def _pressed(context: Context, at: PlacedThing, share: float) -> tuple[ThingPrimitive, float]:
    """The ball in the thing's frame, and how far its field reaches into the thing's."""
    one = outline(at.thing)
    body = one.part(0)
    half = 0.5 * float(np.ptp(extent(one), axis=0).min())
    radius, deep = WIDE * half, share * half
    towards = matrix_from_quaternion(at.rotation).T @ _side_seen(context, at.position)
    inside, outside = 0.0, float(one.radius[0]) + radius
    for _ in range(_HALVINGS):
        middle = 0.5 * (inside + outside)
        if _overlap(body, radius, middle * towards)[0] >= deep:
            inside = middle
        else:
            outside = middle
    depth = _overlap(body, radius, outside * towards)[1]
    if depth <= 0.0:
        raise Refused(f"the {at.thing.name} has nothing there that could be dented")
    return ThingPrimitive("sphere", (radius,), outside * towards), depth


def _side_seen(context: Context, position: F64) -> F64:
    """(3,) unit vector in the room from a thing to the speaker's eyes; upwards where nobody knows of them."""
    posed = context.speaker.posed
    if posed is None:
        return np.array([0.0, 1.0, 0.0])
    eyes = posed.joints.position[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]].mean(axis=0)
    way = eyes - position
    return way / max(1e-9, float(np.sqrt(way @ way)))


def _overlap(body: PrimitiveSet, radius: float, centre: F64) -> tuple[float, float]:
    """How deep a ball is in a thing, in its frame: of the surfaces [m], of the fields."""
    found = find_contacts(imprints([ThingPrimitive("sphere", (radius,), centre)]), body)
    if not len(found):
        return 0.0, 0.0
    return float(found.depth.max()), float(found.field_depth.max())
