"""Things that are to stand in a row."""

import math
from collections.abc import Sequence

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space import actions as ask
from vistel.space.actions import Refused
from vistel.space.arguments import Which
from vistel.space.commands.context import Answer, Context, performs
from vistel.space.commands.placing import GAP, glide, is_free, table_edge
from vistel.space.dynamics.solids import outline
from vistel.space.holding import holding
from vistel.space.room import ROOM_RADIUS, TABLE_HEIGHT

LEAST_GAP = 2.0 * GAP
_ASIDE = (0.0, *(sign * k * 0.03 for k in range(1, 9) for sign in (1.0, -1.0)))
"""How far the row is moved to where nothing else stands, the least that will do [m]."""
_SUNK = 0.004
"""What lies on a table is in it by no more [m]."""


@performs(ask.Align)
def align(context: Context, action: ask.Align) -> Answer:
    """In their order along the row, as far apart as they were or as there is room, each as it is turned."""
    rows = _at_rest(context, action.which) if action.which.every else context.loose(action.which)
    if len(rows) < 2:
        raise Refused("one thing alone stands in no row; select several, or say all of them")
    position = context.state.motions.position[rows]
    right, ahead = context.speaker.right, context.speaker.ahead
    across = float(np.ptp(position @ right)) >= float(np.ptp(position @ ahead))
    along, aside = (right, ahead) if across else (ahead, right)
    order = np.argsort(position @ along, kind="stable")
    rows = [rows[int(k)] for k in order]
    position = position[order]
    low, high = _reach(context, rows, along)
    width = high - low
    edge = table_edge(context)
    on_table = bool((position[:, 1] > TABLE_HEIGHT).all() and (np.hypot(position[:, 0], position[:, 2]) < edge).all())
    for shift in _ASIDE:
        beside = float((position @ aside).mean()) + shift
        half = math.sqrt(max(0.0, (edge if on_table else ROOM_RADIUS) ** 2 - beside**2))
        place = _row(position @ along, width, -low, half)
        if place is None:
            continue
        shifts = (place - position @ along)[:, None] * along + (beside - position @ aside)[:, None] * aside
        if _free(context, rows, position + shifts):
            return _sent(context, rows, shifts)
    raise Refused(f"there is no room for a row of {len(rows)} things")


def _sent(context: Context, rows: Sequence[int], shifts: F64) -> Answer:
    way = dict(zip(rows, shifts, strict=True))
    return glide(context, rows, lambda n: (way[n], np.zeros(3)))


def _at_rest(context: Context, which: Which) -> list[int]:
    """Of all that are meant those that nothing leads: what is in somebody's hand or on a joint is left there."""
    led = {g.thing for g in context.state.grasps} | holding.tracked_things(context.state)
    led |= context.solids.joined.of_thing.keys()
    rows = [n for n in context.rows(which) if context.state.things[n].id not in led]
    for n in rows:
        context.check_mine(n)
    return rows


def _reach(context: Context, rows: Sequence[int], along: F64) -> tuple[F64, F64]:
    """(n,) how far each thing reaches from its middle along an axis of the room, to both sides [m]."""
    low, high = np.zeros(len(rows)), np.zeros(len(rows))
    for k, n in enumerate(rows):
        one = outline(context.state.things[n])
        at = one.contact_point @ (matrix_from_quaternion(context.state.motions.rotation[n]).T @ along)
        low[k], high[k] = (at - one.contact_point_radius).min(), (at + one.contact_point_radius).max()
    return low, high


def _row(at: F64, width: F64, before: F64, half: float) -> F64 | None:
    """(n,) where the middles stand on a line from -half to half; None where they do not fit. at: where they are; width of
    each, and how much of it lies before its middle [m]."""
    gaps = len(at) - 1
    begin, end = float((at - before).min()), float((at - before + width).max())
    room = min(max(end - begin, float(width.sum()) + gaps * LEAST_GAP), 2.0 * half)
    gap = (room - float(width.sum())) / gaps
    if gap < LEAST_GAP - 1e-9:
        return None
    first = min(max(0.5 * (begin + end) - 0.5 * room, -half), half - room)
    return first + np.concatenate([[0.0], np.cumsum(width[:-1] + gap)]) + before


def _free(context: Context, rows: Sequence[int], spots: F64) -> bool:
    """Nothing but themselves stands where they would stand, not even furniture."""
    others = [n for n in range(len(context.state.things)) if n not in set(rows)]
    for n, spot in zip(rows, spots + np.array([0.0, _SUNK, 0.0]), strict=True):
        turned = matrix_from_quaternion(context.state.motions.rotation[n])
        shape = context.solids.part(n).moved(turned, spot)
        if not is_free(context, shape, spot, float(context.solids.radius[n]), others):
            return False
    return True
