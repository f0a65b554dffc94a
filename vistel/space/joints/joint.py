"""Joints: how a thing may move against another one, or against the room. A hinge turns about an axis, a slider slides along it.

They are those of UsdPhysics (PhysicsRevoluteJoint, PhysicsPrismaticJoint, DriveAPI): the axis is the X axis of a frame that lies in
both bodies, and the coordinate of a joint is the angle [rad] or the way [m] of the moved thing's frame from the base's.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.things.things import Thing, identity

MOST_DETENTS = 4
"""Places of one joint that can hold fast."""
FURTHEST_TURN = math.pi
"""A hinge's limits lie within half a turn on either side: its angle is read from poses [rad]."""
_LONGEST = 10.0
"""A slider's limits lie within so much [m]."""


class JointKind(Enum):
    """The way a joint lets its thing go."""

    HINGE = "hinge"
    SLIDER = "slider"


@dataclass(frozen=True)
class Drive:
    """A spring and a brake along a joint: force = stiffness * (target - coordinate) - damping * speed, at most `most`.

    stiffness: [N/m] or [N m/rad], target: [m] or [rad], damping: [N s/m] or [N m s/rad], most: [N] or [N m]. Without stiffness, and
    with a `most` that its damping soon reaches, it is friction. Raises ValueError for numbers that make none.
    """

    stiffness: float = 0.0
    damping: float = 0.0
    target: float = 0.0
    most: float = math.inf

    def __post_init__(self) -> None:
        if not (0.0 <= self.stiffness < 1e7 and 0.0 <= self.damping < 1e7):
            raise ValueError("drive: expected stiffness and damping of 0 to 10,000,000")
        if not (self.most >= 0.0 and math.isfinite(self.target)):
            raise ValueError("drive: expected a finite target, and a greatest force of 0 or more")


@dataclass(frozen=True)
class Detent:
    """A place that draws a joint near it: within `reach` of `at` [m or rad], with `force` [N or N m] at the edge of that and less
    towards the middle. Raises ValueError for numbers that make none."""

    at: float
    reach: float
    force: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.at) and 0.0 < self.reach < 10.0 and 0.0 < self.force < 1e4):
            raise ValueError("detent: expected a finite place, a reach above 0 and a force above 0")


@dataclass(frozen=True)
class Button:
    """A joint that is a button: pressed when its coordinate falls below `press`, released when it rises above `release`. The two
    differ, so that a trembling finger presses once. lights: id of a thing whose colour each press changes to `lit` and back
    (0xRRGGBBAA); empty: none. Raises ValueError for a `release` that is not above `press`."""

    press: float
    release: float
    lights: str = ""
    lit: int = 0xFFD75EFF

    def __post_init__(self) -> None:
        if not (math.isfinite(self.press) and math.isfinite(self.release) and self.press < self.release):
            raise ValueError(f"button: expected a press below its release, got {self.press:g} and {self.release:g}")


@dataclass(frozen=True, eq=False)
class JointFrame:
    """Where a joint is on one of its bodies: point (3,) [m] and rotation (4,) quaternion (x, y, z, w), joint to body. X: its
    axis."""

    point: F64 = field(default_factory=lambda: np.zeros(3))
    rotation: F64 = field(default_factory=identity)

    @property
    def matrix(self) -> F64:
        """(3, 3) joint to body."""
        return matrix_from_quaternion(self.rotation)


@dataclass(frozen=True, eq=False)
class Joint:
    """`thing` hangs on `base`, another thing, or on the room where that is empty.

    id: unique in the room; on_base, on_thing: the joint's frame on each body (the room's own frame for the room); lower, upper:
    limits of the coordinate [m or rad], infinite for none; collides: whether the two also touch each other. Raises ValueError.
    """

    id: str
    kind: JointKind
    thing: str
    base: str = ""
    on_base: JointFrame = field(default_factory=JointFrame)
    on_thing: JointFrame = field(default_factory=JointFrame)
    lower: float = -math.inf
    upper: float = math.inf
    drive: Drive = field(default_factory=Drive)
    detents: tuple[Detent, ...] = ()
    button: Button | None = None
    collides: bool = False

    def __post_init__(self) -> None:
        if self.thing == self.base:
            raise ValueError(f"joins {self.thing} to itself; name two bodies")
        for frame in (self.on_base, self.on_thing):
            sound = bool(np.isfinite(frame.point).all() and np.isfinite(frame.rotation).all())
            if not sound or abs(float(np.sqrt(frame.rotation @ frame.rotation)) - 1.0) > 1e-3:
                raise ValueError("expected finite places and rotations of length 1")
        if not self.lower <= self.upper:
            raise ValueError(f"limits: expected the lower one below the upper one, got {self.lower:g} and {self.upper:g}")
        most = FURTHEST_TURN if self.kind is JointKind.HINGE else _LONGEST
        unit = "180 degrees" if self.kind is JointKind.HINGE else f"{_LONGEST:g} m"
        if any(math.isfinite(limit) and abs(limit) > most + 1e-9 for limit in (self.lower, self.upper)):
            raise ValueError(f"limits: expected at most {unit} on either side")
        if len(self.detents) > MOST_DETENTS:
            raise ValueError(f"{len(self.detents)} detents, expected at most {MOST_DETENTS}")

    @property
    def open_at(self) -> float:
        """The coordinate at which it is open, or a button out: the limit further from 0 [m or rad]. Infinite without limits."""
        return self.upper if abs(self.upper) >= abs(self.lower) else self.lower

    @property
    def closed_at(self) -> float:
        """The other limit [m or rad]."""
        return self.lower if abs(self.upper) >= abs(self.lower) else self.upper

    def within(self, coordinate: float) -> float:
        """The coordinate brought within the limits."""
        return min(self.upper, max(self.lower, coordinate))


def check_joints(joints: Sequence[Joint], things: Sequence[Thing]) -> None:
    """Raises ValueError, one line that begins with the joint's id, for joints that do not fit the things of a room.

    Each thing hangs on one joint at most, and no thing hangs on itself through others: joints make trees.
    """
    known = {t.id: t for t in things}
    joint_of: dict[str, Joint] = {}
    seen: set[str] = set()
    for j in joints:
        if j.id in seen:
            raise ValueError(f"{j.id}: two joints have this id; give one of them another")
        seen.add(j.id)
        named = [j.thing, *([j.base] if j.base else []), *([j.button.lights] if j.button and j.button.lights else [])]
        for body in named:
            if body not in known:
                raise ValueError(f"{j.id}: there is no thing {body!r} in the room")
        if known[j.thing].fixed:
            raise ValueError(f"{j.id}: {j.thing} is fixed to the room and cannot move on a joint; give it a mass")
        if j.thing in joint_of:
            raise ValueError(
                f"{j.id}: {j.thing} hangs on another joint already, {joint_of[j.thing].id}; each thing may hang on one"
            )
        joint_of[j.thing] = j
    for j in joints:
        at, chain = j.thing, {j.thing}
        while at in joint_of and (at := joint_of[at].base):
            if at in chain:
                raise ValueError(f"{j.id}: {j.thing} hangs on itself through other joints")
            chain.add(at)


def hanging_on(joints: Sequence[Joint], base: str) -> frozenset[str]:
    """Ids of all things that hang on a thing, themselves or through others."""
    out: set[str] = set()
    for j in in_order(joints):
        if j.base == base or j.base in out:
            out.add(j.thing)
    return frozenset(out)


def in_order(joints: Sequence[Joint]) -> tuple[Joint, ...]:
    """The joints, each after the one that its base hangs on."""
    of_thing = {j.thing: j for j in joints}

    def depth(j: Joint) -> int:
        return 1 + depth(of_thing[j.base]) if j.base in of_thing else 0

    return tuple(sorted(joints, key=lambda j: (depth(j), j.id)))
