"""Constraints: a point or an area of one body held to one of another by local deformation (Singh §2.2; mathematics M4).

Both bodies bulge along the axis P_a P_b within a half-infinite sphylinder each and meet at Q, where y_a = kappa y_b.
Several constraints of one pair share one ghost (mathematics M4.6), graphs of any form need no iteration, and where the gap is too
wide the bulges fall short: the bodies break away gradually.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from vistel.arrays import F64
from vistel.implicit.blend import QUARTIC
from vistel.implicit.checks import ShapeError, Vec3, positive, vector, within
from vistel.implicit.constants import GHOST_CAP
from vistel.implicit.constants import THRESHOLD as T
from vistel.implicit.ghosts.deformable import Deformable
from vistel.implicit.ghosts.ghost_kind import CONTACT, Ghost
from vistel.implicit.graph.combine import Sum, union
from vistel.implicit.graph.ghost_nodes import Plateau
from vistel.implicit.graph.ghost_terms import constraint_field, decay_quartic, hold_level
from vistel.implicit.graph.shape import Shape
from vistel.implicit.primitives.offset import Sphylinder

SAMPLES = 33
"""Points of the axis at which crossings are looked for."""
REACH = 0.4
"""Reach by default, in surface radii of the body."""
KAPPA = (0.02, 50.0)
"""Least and largest quotient of two bodies' compliances in a ghost."""
Deficits = Callable[[F64], F64]


@dataclass(frozen=True)
class ConstraintGhost(Ghost):
    """One side of a constraint: the owner pulls the target's surface out round an axis.

    origin (3,) [m] and unit direction (3,) of the half-line, from the owner's point towards the target's, room frame;
    radius: how far from the axis it acts [m]; plateau: share of the radius with full effect; hold: y' [field];
    strength: 1, or less while it breaks.
    """

    origin: Vec3 = (0.0, 0.0, 0.0)
    direction: Vec3 = (1.0, 0.0, 0.0)
    radius: float = 0.1
    plateau: float = 0.0
    hold: float = 0.4
    strength: float = 1.0
    priority: int = field(default=CONTACT, kw_only=True)


def strongest(pulls: Sequence[ConstraintGhost], target: Shape) -> Shape:
    """s(P) over a target's realm: the largest of the sphylinders' fields."""
    low, high = target.bounds
    parts: list[Shape] = []
    for pull in pulls:
        start = np.array(pull.origin)
        far = float(np.linalg.norm(high - low) + np.linalg.norm((low + high) / 2 - start)) + pull.radius
        x, y, z = start + far * np.array(pull.direction)
        weight = 1.0 if pull.plateau > 0 else pull.strength
        part: Shape = Sphylinder(pull.origin, (float(x), float(y), float(z)), pull.radius, weight=weight)
        if pull.plateau > 0:
            part = Sum((Plateau((part,), pull.plateau),), (pull.strength,))
        parts.append(part)
    return parts[0] if len(parts) == 1 else union(*parts)


@dataclass(frozen=True)
class ConstraintAxis:
    """start, end (3,): the points held together [m]; along (3,): unit direction of the pulls from a to b;
    origin_a, origin_b (3,): where the sphylinders begin; overlapping: the bodies overlap between the points."""

    start: F64
    end: F64
    along: F64
    origin_a: F64
    origin_b: F64
    overlapping: bool


@dataclass(frozen=True)
class ConstraintState:
    """How a constraint fares. gap: between the surfaces along the axis [m]; point (3,): Q [m]; kappa: c_a / c_b;
    met: both surfaces reach Q; connected: and are one piece with their bodies on the way; torn: it broke for good."""

    gap: float
    point: F64
    kappa: float
    met: bool
    connected: bool
    torn: bool

    @property
    def out_of_reach(self) -> bool:
        """The bodies are too far apart: their bulges fall short of each other."""
        return not (self.met and self.connected)


@dataclass(frozen=True)
class Constraint:
    """Holds `point_a` of body a to `point_b` of body b, each (3,) in its body's frame [m], on or in the body.

    reach_a, reach_b: radius of the deformed region of each body [m], None: 0.4 of its surface radius; plateau: share
    of the reach with full effect, 0 for points, about 0.5 for areas (the contact is a disc of plateau * least reach);
    hold: t' in (t, 1), the distance ratio up to which it holds exactly; tears: gap [m] beyond which it breaks for
    good; fade: seconds it takes to let go then.
    """

    a: str
    b: str
    point_a: Vec3
    point_b: Vec3
    reach_a: float | None = None
    reach_b: float | None = None
    plateau: float = 0.0
    hold: float = 0.9
    tears: float = math.inf
    fade: float = 0.2
    torn_at: float | None = None
    since: float = -math.inf
    until: float = math.inf
    priority: int = CONTACT

    def __post_init__(self) -> None:
        name = f"Constraint {self.a}-{self.b}"
        for point in ("point_a", "point_b"):
            object.__setattr__(self, point, vector(name, point, getattr(self, point)))
        for reach in ("reach_a", "reach_b"):
            if (value := getattr(self, reach)) is not None:
                positive(name, reach, value)
        within(name, "plateau", self.plateau, 0.0, 0.95)
        within(name, "hold", self.hold, float(QUARTIC.inverse(T)) + 1e-6, 0.999)
        if not self.tears >= 0:
            raise ShapeError(f"{name}: tears is {self.tears}, expected 0 or more")
        if self.a == self.b:
            raise ShapeError(f"{name}: holds a body to itself, expected two bodies")

    def reaches(self, a: Deformable, b: Deformable) -> tuple[float, float]:
        """Reach on a and on b [m]."""
        return _reach(self.reach_a, a.shape), _reach(self.reach_b, b.shape)

    def strength(self, time: float) -> float:
        """1 until it tears, 0 from `fade` seconds later on."""
        return 1.0 if self.torn_at is None else decay_quartic(time - self.torn_at, self.fade)

    def pulls(self, a: Deformable, b: Deformable, time: float = 0.0) -> tuple[ConstraintGhost, ...]:
        """What each body does to the other at `time`; nothing once it is torn, or for a rigid body."""
        strength = self.strength(time)
        if strength <= 0:
            return ()
        axis = self.axis(a, b)
        reach_a, reach_b = self.reaches(a, b)
        whole_a, whole_b = self._in_one_piece(axis, a, b)
        sides = ((b, a, axis.origin_b, -axis.along, reach_a, whole_a), (a, b, axis.origin_a, axis.along, reach_b, whole_b))
        return tuple(
            ConstraintGhost(
                owner.name,
                target.name,
                _three(origin),
                _three(along),
                reach,
                self.plateau,
                hold_level(self.hold),
                strength * whole,
                since=self.since,
                until=self.until,
                priority=self.priority,
            )
            for owner, target, origin, along, reach, whole in sides
            if target.compliance > 0
        )

    def _in_one_piece(self, axis: ConstraintAxis, a: Deformable, b: Deformable) -> tuple[float, float]:
        """Strengths at which the bulges of a and of b are not torn off their bodies (mathematics M4.7): 1 as far as they hold.

        Beyond that the neck pinches off: what would float between the bodies is drawn back into them.
        """
        if axis.overlapping:
            return 1.0, 1.0
        kappa, hold = _kappa(a.compliance, b.compliance), hold_level(self.hold)
        where = np.linspace(0, 1, 4 * SAMPLES)
        y_a, y_b = (np.maximum(_deficit(body.placed, axis.start, axis.end, where), 0.0) for body in (a, b))
        onto_a, onto_b = kappa * constraint_field(y_b, hold), constraint_field(y_a, hold) / kappa
        return _largest_share(y_a, onto_a), _largest_share(y_b[::-1], onto_b[::-1])

    def axis(self, a: Deformable, b: Deformable) -> ConstraintAxis:
        """Where it acts. Points inside a body move to where the axis leaves it for the last time.

        The direction turns smoothly into the surfaces' own normals as bodies come to overlap, so that sticking bodies
        that touch look the same from both sides of the moment.
        """
        start, end = a.to_room(self.point_a), b.to_room(self.point_b)
        line = start + np.linspace(0, 1, SAMPLES)[:, None] * (end - start)
        in_a, in_b = a.placed.field(line) >= T, b.placed.field(line) >= T
        overlapping = bool(
            (in_a & in_b).any() or (in_a.any() and in_b.any() and np.flatnonzero(in_a).max() > np.flatnonzero(in_b).min())
        )
        if not overlapping and np.linalg.norm(end - start) > 0:
            leaving = np.flatnonzero(in_a[:-1] & ~in_a[1:])
            entering = np.flatnonzero(~in_b[:-1] & in_b[1:])
            if len(leaving):
                start = _edge(a.placed, line[leaving[-1]], line[leaving[-1] + 1])
            if len(entering):
                end = _edge(b.placed, line[entering[0] + 1], line[entering[0]])
        normal = _unit(_normal(a.placed, start) - _normal(b.placed, end), _unit(end - start, np.array([0.0, 1.0, 0.0])))
        apart = float((end - start) @ normal)
        soft = 0.1 * min(self.reaches(a, b))
        along = _unit(end - start + max(0.0, soft - apart) * normal, normal)
        back = min(0.0, apart) / 2 * normal
        return ConstraintAxis(start, end, along, start + back, end - back, overlapping or apart <= 0)

    def held(self, a: Deformable, b: Deformable) -> ConstraintState:
        """Whether the bodies reach each other, with the fields they have at rest."""
        kappa = _kappa(a.compliance, b.compliance)
        axis = self.axis(a, b)
        torn = self.torn_at is not None
        if axis.overlapping:
            return ConstraintState(0.0, (axis.start + axis.end) / 2, kappa, not torn, not torn, torn)
        of_a: Deficits = partial(_deficit, a.placed, axis.start, axis.end)
        of_b: Deficits = partial(_deficit, b.placed, axis.start, axis.end)
        where = _crossing(of_a, of_b, kappa)
        hold = hold_level(self.hold)
        l_a, l_b = np.linspace(0, where, SAMPLES), np.linspace(where, 1, SAMPLES)
        y_a, y_b = float(of_a(np.array([where]))[0]), float(of_b(np.array([where]))[0])
        met = y_a <= hold + 1e-9 and y_b <= hold + 1e-9 and kappa * y_b <= GHOST_CAP * T and y_a / kappa <= GHOST_CAP * T
        cap = GHOST_CAP * T
        whole_a = of_a(l_a) <= np.minimum(kappa * constraint_field(of_b(l_a), hold), cap) + 1e-6
        whole_b = of_b(l_b) <= np.minimum(constraint_field(of_a(l_b), hold) / kappa, cap) + 1e-6
        gap = float(np.linalg.norm(axis.end - axis.start))
        q = axis.start + where * (axis.end - axis.start)
        connected = bool(whole_a.all() and whole_b.all())
        return ConstraintState(gap, q, kappa, bool(met) and not torn, connected and not torn, torn)


def tear(constraints: Iterable[Constraint], bodies: Mapping[str, Deformable], time: float) -> tuple[Constraint, ...]:
    """The constraints at `time`: those stretched beyond what they bear have `torn_at`, those that let go are gone."""
    kept: list[Constraint] = []
    for c in constraints:
        if c.torn_at is None and math.isfinite(c.tears):
            axis = c.axis(bodies[c.a], bodies[c.b])
            gap = 0.0 if axis.overlapping else float(np.linalg.norm(axis.end - axis.start))
            kept.append(replace(c, torn_at=time) if gap > c.tears else c)
        elif c.strength(time) > 0:
            kept.append(c)
    return tuple(kept)


def _largest_share(y: F64, ghost: F64) -> float:
    """The largest share of a ghost along an axis, in [0, 1], under which what it adds hangs together with the body."""
    needed = y / np.maximum(ghost, 1e-9)
    torn = np.flatnonzero(y > np.minimum(ghost, GHOST_CAP * T))
    if not len(torn) or not (needed[torn[0] :] < 1.0).any():
        return 1.0
    peak = int(torn[0])
    while peak + 1 < len(needed) and needed[peak + 1] >= needed[peak]:
        peak += 1
    return 0.98 * min(1.0, float(needed[peak:].min()))


def _kappa(c_a: float, c_b: float) -> float:
    if c_a == 0 or c_b == 0:
        return 1.0 if c_a == c_b else KAPPA[0] if c_a == 0 else KAPPA[1]
    return min(max(c_a / c_b, KAPPA[0]), KAPPA[1])


def _reach(given: float | None, shape: Shape) -> float:
    return given if given is not None else REACH * float(QUARTIC.inverse(T)) * float(np.ptp(shape.bounds, axis=0).min()) / 2


def _edge(shape: Shape, inside: F64, outside: F64) -> F64:
    """Where the surface is crossed between a point inside and one outside."""
    for _ in range(40):
        middle = (inside + outside) / 2
        if float(shape.field(middle[None])[0]) >= T:
            inside = middle
        else:
            outside = middle
    return (inside + outside) / 2


def _deficit(shape: Shape, start: F64, end: F64, where: F64) -> F64:
    return T - shape.field(start + where[:, None] * (end - start))


def _crossing(y_a: Deficits, y_b: Deficits, kappa: float) -> float:
    """Fraction of the axis at which y_a = kappa y_b: y_a rises and y_b falls along it."""
    steps = np.linspace(0, 1, SAMPLES)
    over = np.flatnonzero(y_a(steps) - kappa * y_b(steps) > 0)
    if not len(over) or over[0] == 0:
        return 1.0 if not len(over) else 0.0
    low, high = float(steps[over[0] - 1]), float(steps[over[0]])
    for _ in range(50):
        middle = np.array([(low + high) / 2])
        low, high = (float(middle[0]), high) if float((y_a(middle) - kappa * y_b(middle))[0]) <= 0 else (low, float(middle[0]))
    return (low + high) / 2


def _normal(shape: Shape, point: F64) -> F64:
    return shape.normal(point[None])[0]


def _unit(v: F64, otherwise: F64) -> F64:
    length = float(np.linalg.norm(v))
    return v / length if length > 1e-9 else otherwise


def _three(v: F64) -> Vec3:
    return float(v[0]), float(v[1]), float(v[2])
