"""Commands to what hangs on joints: it opens, closes, and is pushed as far as its joint goes."""

import math
from collections.abc import Sequence

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, rotvec_from_matrix
from vistel.space import actions as ask
from vistel.space.actions import Refused
from vistel.space.commands.context import Answer, Context, performs
from vistel.space.history import Change, PlacedThing
from vistel.space.things.glide import Glide

LEAST = 1e-3
"""What is pushed must go this share of the push along its joint; else it does not move that way."""
NEAR = 1e-3
"""A small step along a joint, by which its direction in the room is found [m or rad]."""
UNLIMITED = 0.5 * math.pi, 0.3
"""How far a hinge and a slider without limits open [rad, m]."""


@performs(ask.Open)
def open_or_close(context: Context, action: ask.Open) -> Answer:
    """Let what hangs on joints glide to a share of its way."""
    if not 0.0 <= action.share <= 1.0:
        raise Refused(f"a thing is opened by a share of 0 to 1 of its way, not by {action.share:g}")
    ways: list[tuple[int, float]] = []
    for n in context.rows(action.which):
        k = _joint_of(context, n)
        joint = context.solids.joined.joints[k]
        closed = joint.closed_at if math.isfinite(joint.closed_at) else 0.0
        opened = joint.open_at if math.isfinite(joint.open_at) else closed + UNLIMITED[int(context.solids.joined.slides(k))]
        ways.append((k, closed + action.share * (opened - closed)))
    return _sent(context, ways)


def pushed(context: Context, rows: Sequence[int], shift: F64) -> Answer:
    """Let things on joints glide as a push by `shift` (3,) [m] moves their middles; a button is pressed, whatever the way."""
    joined, m = context.solids.joined, context.state.motions
    ways: list[tuple[int, float]] = []
    for n in rows:
        thing = context.state.things[n]
        if thing.id not in joined.of_thing:
            raise Refused(f"the {thing.name} hangs on no joint; say one thing at a time")
        k = joined.of_thing[thing.id]
        joint, now = joined.joints[k], joined.coordinate(k, m.position, m.rotation)
        if joint.button is not None:
            ways.append((k, joint.lower))
            continue
        along = (joined.posed(k, now + NEAR, m.position, m.rotation)[0] - m.position[n]) / NEAR
        by = float(shift @ along) / max(1e-9, float(along @ along))
        to = joint.within(now + by)
        if abs(by) * float(np.sqrt(along @ along)) < LEAST * float(np.sqrt(shift @ shift)) or abs(to - now) < 1e-6:
            raise Refused(f"the {thing.name} does not go that way")
        ways.append((k, to))
    return _sent(context, ways)


def _joint_of(context: Context, n: int) -> int:
    """The joint that is meant by thing n: its own, or that of the one thing that hangs on it. Raises Refused."""
    joined, thing = context.solids.joined, context.state.things[n]
    if thing.id in joined.of_thing:
        return joined.of_thing[thing.id]
    on_it = [k for k, joint in enumerate(joined.joints) if joint.base == thing.id and joint.button is None]
    if len(on_it) == 1:
        return on_it[0]
    if not on_it:
        raise Refused(f"the {thing.name} does not open")
    names = ", ".join(f"the {context.state.things[int(joined.ends[k, 1])].name}" for k in on_it)
    raise Refused(f"several things on the {thing.name} can be opened ({names}); say which")


def _sent(context: Context, ways: Sequence[tuple[int, float]]) -> Answer:
    """Glides along joints, to coordinates."""
    joined, state = context.solids.joined, context.state
    before: list[PlacedThing] = []
    after: list[PlacedThing] = []
    glides: list[Glide] = []
    for k, to in ways:
        n = int(joined.ends[k, 1])
        context.check_mine(n)
        x = context.placed(n)
        if any(g.thing == x.thing.id for g in state.grasps):
            raise Refused(f"the {x.thing.name} is in your own hand; let go of it first")
        position, rotation = joined.posed(k, to, state.motions.position, state.motions.rotation)
        turn = rotvec_from_matrix(np.ascontiguousarray(matrix_from_quaternion(rotation) @ matrix_from_quaternion(x.rotation).T))
        glides.append(Glide(context.who, x.thing.id, x.position, x.rotation, position - x.position, turn, state.step))
        before.append(x)
        after.append(PlacedThing(x.thing, position, rotation))
    moved = {g.thing for g in glides}
    kept = tuple(g for g in state.glides if g.thing not in moved)
    history = state.history.with_change(Change(context.who, tuple(before), tuple(after)))
    return state.but(glides=(*kept, *glides), history=history), tuple(x.thing.id for x in after)
