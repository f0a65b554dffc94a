"""Commands that move things: they glide to their places as if carried by an invisible hand."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix
from vistel.implicit.contacts.contact import find_contacts
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space import actions as ask
from vistel.space.actions import Refused
from vistel.space.arguments import Along, Where
from vistel.space.commands import moving_on_joint, reshape
from vistel.space.commands.context import Answer, Context, changed, lowest, performs
from vistel.space.dynamics.solids import outline
from vistel.space.history import Change, PlacedThing
from vistel.space.holding import holding
from vistel.space.room import ROOM_RADIUS, TABLE_HEIGHT
from vistel.space.things.glide import Glide, on_way
from vistel.space.things.things import Thing

HIGHEST = 3.0
"""Things are put no higher above the floor [m]."""
GAP = 0.01
"""Between a thing and what stands beside it, where a place is looked for [m]."""
REACH = 0.38, 0.48, 0.58, 0.68
"""How far before somebody their "here" is looked for [m]."""
LIFTS = 0.0, 0.06, 0.12, 0.2, 0.3
"""How far a thing is raised over what is in its way, the least that will do [m]."""
IN_THE_WAY = 0.015
"""A thing is not sent this deep into furniture, nor past it [m]."""


def _inside(position: F64) -> None:
    x, y, z = position.tolist()
    if math.hypot(x, z) > ROOM_RADIUS or not 0.0 <= y <= HIGHEST:
        raise Refused(f"the place is outside the room ({ROOM_RADIUS:.0f} m round the table, 0 to {HIGHEST:.0f} m high)")


@performs(ask.Move)
def move(context: Context, action: ask.Move) -> Answer:
    """Put a thing at a pose at once, at rest."""
    rows = context.loose(action.which)
    if len(rows) > 1:
        raise Refused("only one thing can be put in a place")
    _inside(action.position)
    length = float(np.sqrt(action.rotation @ action.rotation))
    rotation = action.rotation / length if length > 1e-6 else np.array([0.0, 0.0, 0.0, 1.0])
    after = [PlacedThing(context.state.things[n], action.position, rotation) for n in rows]
    state = changed(context, rows, after)
    return holding.woken_round(state, context.solids, rows[0]), tuple(x.thing.id for x in after)


def glide(context: Context, rows: Sequence[int], way: Callable[[int], tuple[F64, F64]]) -> Answer:
    """Start glides of things; way: shift (3,) and turn (3,) of a row."""
    state, after, glides = context.state, list[PlacedThing](), list[Glide]()
    for n in rows:
        x = context.placed(n)
        shift, turn = way(n)
        end = quaternion_from_matrix(
            np.ascontiguousarray(matrix_from_rotvec(np.ascontiguousarray(turn)) @ matrix_from_quaternion(x.rotation))
        )
        shift = shift + holding.out_of_furniture(context.solids, n, x.position + shift, end)
        _inside(x.position + shift)
        lift = 0.0 if turn.any() else _lift_over(context, n, x, shift, end)
        after.append(PlacedThing(x.thing, x.position + shift, end))
        glides.append(Glide(context.who, x.thing.id, x.position, x.rotation, shift, turn, state.step, lift))
        state = holding.woken_round(state, context.solids, n)
    moved = {g.thing for g in glides}
    change = Change(context.who, tuple(context.placed(n) for n in rows), tuple(after))
    state = replace(
        state,
        glides=tuple(g for g in state.glides if g.thing not in moved) + tuple(glides),
        history=state.history.with_change(change),
    )
    return state, tuple(x.thing.id for x in after)


def _lift_over(context: Context, n: int, x: PlacedThing, shift: F64, end: F64) -> float:
    """How much thing n has to be raised halfway to get past the furniture. Raises Refused where it does not."""
    blocking = -1
    for lift in LIFTS:
        blocking = _blocking(context, n, x, shift, end, lift)
        if blocking < 0:
            return lift
    raise Refused(f"the {context.solids.things[blocking].name} is in the way")


def _blocking(context: Context, n: int, x: PlacedThing, shift: F64, end: F64, lift: float) -> int:
    """The thing of the furniture that is in the way, or -1."""
    s = context.solids
    fixed, own = s.fixed, s.part(n)
    steps = math.ceil((float(np.sqrt(shift @ shift)) + 2.0 * lift) / IN_THE_WAY)
    for k in range(1, steps + 1):
        turned = matrix_from_quaternion(end if 2 * k > steps else x.rotation)
        found = find_contacts(own.moved(turned, on_way(x.position, shift, lift, k / steps)), fixed)
        if len(found) and float(found.depth.max()) > IN_THE_WAY:
            return int(s.owner[s.fixed_rows[int(found.b[int(found.depth.argmax())])]])
    return -1


@performs(ask.MoveBy)
def move_by(context: Context, action: ask.MoveBy) -> Answer:
    """Let things glide by a distance in a direction of the speaker."""
    rows = context.loose(action.which, on_joints=True)
    if not 0.0 < action.distance <= 2.0 * ROOM_RADIUS:
        raise Refused(f"a thing can be moved by more than 0 and at most {2 * ROOM_RADIUS:.0f} m, not {action.distance:g}")
    shift = action.distance * context.speaker.direction(action.towards)
    if any(context.state.things[n].id in context.solids.joined.of_thing for n in rows):
        return moving_on_joint.pushed(context, rows, shift)
    return glide(context, rows, lambda n: (shift, np.zeros(3)))


@performs(ask.Place)
def place(context: Context, action: ask.Place) -> Answer:
    """Let a thing glide to a free spot near the place that is meant."""
    rows = context.loose(action.which)
    if len(rows) > 1:
        raise Refused("only one thing can be put in a place")
    n = rows[0]
    x = context.placed(n)
    spot = free_spot(context, x.thing, place_meant(context, action.where), x.rotation, apart_from=n)
    return glide(context, rows, lambda n: (spot - x.position, np.zeros(3)))


@performs(ask.Turn)
def turn(context: Context, action: ask.Turn) -> Answer:
    """Let things turn about an axis through each one's origin; none sinks into the table."""
    rows = context.loose(action.which)
    if not 0.0 < abs(action.angle) <= 4.0 * math.pi:
        raise Refused("a thing can be turned by up to two turns, not by that much")
    if action.about is Along.GIRTH:
        raise Refused("a thing is turned about one axis")

    def way(n: int) -> tuple[F64, F64]:
        x = context.placed(n)
        turn = action.angle * axis_in_room(context, n, action.about)
        end = matrix_from_rotvec(np.ascontiguousarray(turn)) @ matrix_from_quaternion(x.rotation)
        rise = lowest(x.thing, x.position, x.rotation) - lowest(
            x.thing, x.position, quaternion_from_matrix(np.ascontiguousarray(end))
        )
        return np.array([0.0, rise, 0.0]), turn

    return glide(context, rows, way)


def axis_in_room(context: Context, n: int, along: Along) -> F64:
    """(3,) unit vector in the room: an axis of the speaker, or the longest one of thing n."""
    if along is Along.LONGEST:
        r = matrix_from_quaternion(context.state.motions.rotation[n])
        return r[:, reshape.longest_axis(context.state.things[n])].copy()
    return context.speaker.axis(along)


def place_meant(context: Context, where: Where) -> F64:
    """(3,) on the table's top or on the floor. Here is on the table, if that is within reach."""
    edge = table_edge(context)
    pointed = where is Where.POINTED
    spots = [context.speaker.pointed_place()] if pointed else [context.speaker.before(d) for d in REACH]
    spot = next((x for x in spots if math.hypot(x[0], x[2]) < edge), None)
    height = 0.0 if spot is None else TABLE_HEIGHT
    spot = spots[0] if spot is None else spot
    return np.array([spot[0], height, spot[2]])


def table_edge(context: Context) -> float:
    """How far from the room's middle things still stand on its table [m]; 0: there is none."""
    table = next((t for t in context.room.things if t.shape == "table"), None)
    return table.primitives[0].params[0] - 0.03 if table else 0.0


def free_spot(context: Context, thing: Thing, foot: F64, rotation: F64, apart_from: int = -1) -> F64:
    """(3,) where a thing can stand, its lowest point on the height of `foot`: there, or in rings round it."""
    one = outline(thing)
    r = float(one.radius[0])
    height = foot[1] - lowest(thing, np.zeros(3), rotation) + 0.002
    others = [n for n in range(len(context.state.things)) if n != apart_from]
    turned = matrix_from_quaternion(rotation)
    for ring in range(5):
        for k in range(max(1, 8 * ring)):
            angle = 2.0 * math.pi * k / max(1, 8 * ring)
            away = ring * (r + GAP)
            spot = np.array([foot[0] + away * math.cos(angle), height, foot[2] + away * math.sin(angle)])
            if math.hypot(spot[0], spot[2]) < ROOM_RADIUS and is_free(context, one.part(0).moved(turned, spot), spot, r, others):
                return spot
    raise Refused(f"there is no room for the {thing.name}")


def is_free(context: Context, shape: PrimitiveSet, spot: F64, radius: float, others: Sequence[int]) -> bool:
    """Nothing stands where a shape would stand."""
    m, s = context.state.motions, context.solids
    for n in others:
        off = m.position[n] - spot
        if float(off @ off) > (radius + float(s.radius[n])) ** 2:
            continue
        other = s.part(n).moved(matrix_from_quaternion(m.rotation[n]), m.position[n])
        found = find_contacts(shape, other)
        if len(found) and float(found.depth.max()) > 0.0:
            return False
    return True
