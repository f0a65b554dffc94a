"""Bonds between a sticky thing and a body that touched it, held by constraints until they tear (Singh §2.2).

A bond is made where a limb or another thing touches, moves along while it slides in touch, and is drawn out when they part:
skin and thing bulge towards each other, as `vistel.implicit.ghosts.constraint` has it. It draws both together with a force that
grows with the gap, and at the force it bears it tears for good and its bulges fade.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F64
from vistel.space.things.things import Thing

MOST = 8
"""Bonds that one thing keeps at a time with one body."""
MOST_IN_ALL = 16
"""Bonds that one thing keeps at a time with all bodies."""
SLID = 0.004
"""A bond in touch is made anew where the limb is when it has slid so far [m]."""
FADE_NS = 200_000_000
"""Time in which the bulges of a torn bond fade."""
NEAR = 0.001
"""A limb this near sticks [m]: contact forces keep bodies slightly apart."""
FLESH = 30e3
"""Young's modulus of a thing as soft as flesh [Pa]: skin over fat is measured at 10 to 60 kPa."""


@dataclass(frozen=True)
class Glue:
    """How a place of a thing sticks. stiffness [N/m]: of glue and thing in a row; bears [N]: at which it tears; longest [m]:
    gap at which it tears at any speed; flows_s: time constant with which the bond's rest length grows, 0: never."""

    stiffness: float
    bears: float
    longest: float
    flows_s: float

    def force(self, gap: float, rest: float) -> float:
        """Force with which a bond draws across a gap, less its rest length `rest` [N]."""
        return self.stiffness * max(0.0, gap - rest)


def glue_of(thing: Thing, size: float, reach: float) -> Glue:
    """The glue of a thing of radius `size`, where `reach` round the bond deforms [m].

    A soft thing is drawn out as well: like a column of its material as wide as the bond and as long as it is thick.
    """
    m = thing.material
    give = m.sticky / m.bears + thing.compliance * size / (FLESH * math.pi * reach * reach)
    return Glue(1.0 / give, m.bears, give * m.bears, m.recovery if m.elasticity == "viscoelastic" else 0.0)


@dataclass(frozen=True, eq=False)
class StickyTouch:
    """A limb or a thing's primitive, `primitive` of `body`, touches a sticky thing at `point` (3,) [m, room]; reach: radius of
    what deforms round it [m]."""

    body: str
    primitive: int
    point: F64
    reach: float


@dataclass(frozen=True, eq=False)
class Bond:
    """Holds point_thing (3,), in the thing's frame, to point_body (3,), in the frame of the joint that carries primitive
    `primitive` of `body`, or of the thing `body` [m]. reach: radius of what deforms round it [m]; torn_ns: when it tore, 0
    while it holds, with torn_force [N]; rest: rest length [m]."""

    number: int
    thing: str
    body: str
    primitive: int
    point_thing: F64
    point_body: F64
    reach: float
    torn_ns: int = 0
    torn_force: float = 0.0
    rest: float = 0.0

    @property
    def key(self) -> tuple[str, int]:
        """The body and the primitive of it that are bonded."""
        return self.body, self.primitive


@dataclass(frozen=True)
class Torn:
    """A bond that has torn: at `point` (3,) of the thing [m, room], with `force` [N], drawn out by `gap` [m]."""

    number: int
    thing: str
    body: str
    primitive: int
    point: F64
    force: float
    gap: float


Frame = tuple[F64, F64]
"""rotation (3, 3) and position (3,) [m], to the room."""


@dataclass(frozen=True)
class Stuck:
    """The bonds of one thing, the next free number, and the bonds torn in this step."""

    bonds: tuple[Bond, ...]
    next_number: int
    torn: tuple[Torn, ...]


def stick(
    old: Sequence[Bond],
    thing: str,
    glue: Callable[[Bond], Glue],
    frame: Frame,
    touches: Iterable[StickyTouch],
    frame_of: Callable[[str, int], Frame | None],
    next_number: int,
    t_ns: int,
    dt: float,
) -> Stuck:
    """The bonds of one thing at `t_ns`, `dt` [s] after the last time. glue: of each; frame: the thing's; frame_of: that of the
    joint of a body's primitive or of a thing, None when the body has gone."""
    now = {(g.body, g.primitive): g for g in touches}
    kept: list[Bond] = []
    torn: list[Torn] = []
    for b in old:
        if b.torn_ns:
            if t_ns - b.torn_ns < FADE_NS:
                kept.append(b)
            continue
        other = frame_of(b.body, b.primitive)
        if other is None:
            continue
        touching = now.pop(b.key, None)
        at_thing, at_body = ends(b, frame, other)
        if touching is not None:
            slid = max(_far(touching.point, at_thing), _far(touching.point, at_body)) > SLID
            kept.append(_at(b, touching.point, frame, other) if slid else b)
            continue
        how, gap = glue(b), _far(at_thing, at_body)
        force = min(how.bears, how.force(gap, b.rest))  # beyond that it tore on the way here
        if gap > how.longest or force >= how.bears:
            kept.append(replace(b, torn_ns=t_ns, torn_force=force))
            torn.append(Torn(b.number, thing, b.body, b.primitive, at_thing, force, gap))
        elif how.flows_s > 0.0:
            kept.append(replace(b, rest=b.rest + (gap - b.rest) * (1.0 - math.exp(-dt / how.flows_s))))
        else:
            kept.append(b)
    for key, g in now.items():
        other = frame_of(*key)
        held = [b for b in kept if b.torn_ns == 0]
        if other is None or len(held) >= MOST_IN_ALL or sum(b.body == g.body for b in held) >= MOST:
            continue
        new = Bond(next_number, thing, *key, np.zeros(3), np.zeros(3), g.reach)
        kept.append(_at(new, g.point, frame, other))
        next_number += 1
    return Stuck(tuple(kept), next_number, tuple(torn))


def ends(b: Bond, frame: Frame, other: Frame) -> tuple[F64, F64]:
    """Where a bond holds the thing and the other body (3,) [m, room]; frame, other: theirs."""
    return frame[0] @ b.point_thing + frame[1], other[0] @ b.point_body + other[1]


def published_alike(a: Bond, b: Bond) -> bool:
    """Whether two states of a bond are published alike: its rest length is not published."""
    return a.point_thing is b.point_thing and a.point_body is b.point_body and a.torn_ns == b.torn_ns


def _at(b: Bond, point: F64, frame: Frame, other: Frame) -> Bond:
    at_thing, at_body = frame[0].T @ (point - frame[1]), other[0].T @ (point - other[1])
    return replace(b, point_thing=at_thing, point_body=at_body, rest=0.0)


def _far(a: F64, b: F64) -> float:
    d = a - b
    return math.sqrt(float(d @ d))
