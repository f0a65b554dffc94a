"""Edges and tips of things made sharper or rounder.

A superellipsoid or a ring has exponents for that: those below 1 are edges, which go to 0.1, those from 1 on are round, and
grow points on their way to 1.9; both become rounder towards 1. A bar or a cone has two ends, of which the thinner one is the
tip; it becomes rounder until it is as thick as the other. Length and mass of a thing stay.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vistel.space import actions as ask
from vistel.space.actions import Refused
from vistel.space.commands.context import Answer, Context, performs
from vistel.space.commands.reshape import THINNEST, curved, sound
from vistel.space.commands.shaping import edited
from vistel.space.things.things import Thing, ThingPrimitive

SHARPEST = 0.1
"""Exponent of the sharpest edge."""
ROUND = 1.0
"""Exponent of an ellipsoid."""
POINTED = 1.9
"""Exponent of the sharpest points."""
_LEAST = 0.01
"""An exponent this near to its limit counts as at the limit."""


@performs(ask.Sharpen)
def sharpen(context: Context, action: ask.Sharpen) -> Answer:
    """Do it."""
    if not 0.0 < abs(action.by) <= 1.0:
        raise Refused(f"things are made sharper or rounder by a share of up to 1, not by {action.by:g}")
    return edited(context, action.which, lambda n: sharpened(context.state.things[n], action.by))


def sharpened(thing: Thing, by: float) -> Thing:
    """The thing with sharper edges and tips, by a share of the way, or rounder ones for by < 0. Raises Refused."""
    wish = "sharp" if by > 0.0 else "round"
    if thing.parts:
        raise Refused(f"the {thing.name} is put together; take it apart first")
    if thing.looks:
        raise Refused(f"the {thing.name} has its shape from a file; it cannot be made {wish}er")
    if thing.curve:
        arc = thing.curve.arc
        return curved(sharpened(thing.curve.straight, by), arc.bend, arc.twist, arc.side)
    able = [p.kind in _HOW for p in thing.primitives]
    if not any(able):
        raise Refused(f"the {thing.name} cannot be made {wish}er")
    after = tuple(_HOW[p.kind](p, by) if can else p for p, can in zip(thing.primitives, able, strict=True))
    if all(a is b for a, b in zip(after, thing.primitives, strict=True)):
        raise Refused(f"the {thing.name} is as {wish} as it can be")
    return sound(replace(thing, primitives=after, inertia=None))


def _ball(p: ThingPrimitive, by: float) -> ThingPrimitive:
    r = p.params[0]
    round_one = replace(p, kind="superellipsoid", params=(r, r, r, ROUND, ROUND))
    after = _superquadric(round_one, by)
    return p if after is round_one else after


def _superquadric(p: ThingPrimitive, by: float) -> ThingPrimitive:
    e = tuple(_exponent(v, by) for v in p.params[-2:])
    return p if e == p.params[-2:] else replace(p, params=(*p.params[:-2], *e))


def _exponent(e: float, by: float) -> float:
    end = ROUND if by < 0.0 else SHARPEST if e < ROUND - _LEAST else POINTED
    if abs(e - end) < _LEAST:
        return e
    return min(POINTED, max(SHARPEST, e * (end / e) ** abs(by)))


def _tip(p: ThingPrimitive, by: float) -> ThingPrimitive:
    """The thinner end of a bar, which stays where it ends; of equals the second."""
    ends = np.array(p.params[:3]), np.array(p.params[3:6])
    radii = p.params[6], p.params[7]
    tip = 0 if radii[0] < radii[1] else 1
    thin, thick = radii[tip], radii[1 - tip]
    new = thin * (THINNEST / thin) ** by if by > 0.0 else thin + (thick - thin) * -by
    way = ends[tip] - ends[1 - tip]
    length = float(np.sqrt(way @ way))
    if abs(new - thin) < _LEAST * thick or length < 1e-9:
        return p
    reach = max(1e-4, length + thin - new)
    moved = (ends[1 - tip] + way * (reach / length)).tolist()
    a, b = (moved, ends[1].tolist()) if tip == 0 else (ends[0].tolist(), moved)
    ra, rb = (new, thick) if tip == 0 else (thick, new)
    return replace(p, params=(*a, *b, ra, rb))


_HOW: dict[str, Callable[[ThingPrimitive, float], ThingPrimitive]] = {
    "sphere": _ball,
    "superellipsoid": _superquadric,
    "supertoroid": _superquadric,
    "cone_sphere": _tip,
}
