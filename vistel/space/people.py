"""People in the world: their posed primitives, how fast these move, and which of them are digits and palms."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from vistel.figure.body import Body, PosedBody, pose_body, standard_body
from vistel.figure.posture import JointPose, Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, Skeleton, finger_joints, standard_skeleton
from vistel.implicit.contact_set import PrimitiveSet
from vistel.space.inputs import MotionInput, Person

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

SIDES = ("left", "right")
THUMB, PALM = 0, 5
DIGITS = 6
"""Per hand: thumb, index, middle, ring, little finger, palm."""
HAND_JOINT = tuple(JOINT_INDEX[f"{side}_hand"] for side in SIDES)

FASTEST = 4.0
"""Speed above which a limb's motion is a tracker's jump, not a push [m/s]."""
SILENT_NS = 100_000_000
"""Without a new motion for so long, a limb counts as still."""
OPENING_LEAK = 0.3
"""How fast the memory of an open hand fades [rad/s]: who keeps a fist does not close it."""


@dataclass(frozen=True)
class Build:
    """Joint chain and primitives of somebody, and for each primitive its digit: 6 * side + digit, or -1."""

    skeleton: Skeleton
    body: Body
    digit: I64

    @cached_property
    def hands(self) -> I64:
        """Which primitives belong to the hands."""
        return np.flatnonzero(self.digit >= 0)


@lru_cache(maxsize=64)
def build_of(height: float, girth: float) -> Build:
    """The body of somebody `height` metres tall."""
    skeleton = standard_skeleton(min(2.6, max(0.5, height)))
    body = standard_body(skeleton, min(2.0, max(0.5, girth)))
    digit = np.full(len(body), -1, np.int64)
    for row, side in enumerate(SIDES):
        for i, name in enumerate(finger_joints(side)):
            digit[body.names.index(name)] = DIGITS * row + i // 3
        for name in (f"{side}_palm", f"{side}_knuckles"):
            digit[body.names.index(name)] = DIGITS * row + PALM
    return Build(skeleton, body, digit)


@dataclass(frozen=True)
class Figure:
    """Somebody in the room. posture is None until the first motion; before: the posture before that, if usable for
    speeds; opened: (2, 4) recent least flexion of each finger [rad]."""

    person: Person
    posture: Posture | None = None
    before: Posture | None = None
    seq: int = 0
    t_ns: int = 0
    before_t_ns: int = 0
    opened: F64 = field(default_factory=lambda: np.full((2, 4), 10.0))

    @property
    def name(self) -> str:
        return self.person.participant

    def moved(self, motion: MotionInput) -> Figure:
        """After `motion`."""
        new = motion.seq != self.seq or motion.t_ns != self.t_ns
        if not new:
            return self
        return replace(
            self, posture=motion.posture, before=self.posture, seq=motion.seq, t_ns=motion.t_ns,
            before_t_ns=self.t_ns,
        )  # fmt: skip

    def with_opening(self, dt: float) -> Figure:
        """The memory of the open hand, one step on."""
        if self.posture is None:
            return self
        return replace(self, opened=np.minimum(flexion(self.posture), self.opened + OPENING_LEAK * dt))

    def opened_now(self, hands: tuple[bool, ...]) -> Figure:
        """The memory of the open hand begins anew for the chosen `hands` (left, right)."""
        if self.posture is None or not any(hands):
            return self
        return replace(self, opened=np.where(np.array(hands)[:, None], flexion(self.posture), self.opened))


def flexion(posture: Posture) -> F64:
    """(2, 4) total flexion of index, middle, ring and little finger of both hands [rad]."""
    h = posture.hands
    return h[:, 4::4] + h[:, 6::4] + h[:, 7::4]


@dataclass(frozen=True)
class Posed:
    """A figure in the room at one step: joints, primitives, and the primitives' velocity (P, 3) [m/s]."""

    figure: Figure
    build: Build
    joints: JointPose
    body: PosedBody
    primitives: PrimitiveSet
    velocity: F64

    @property
    def name(self) -> str:
        return self.figure.name


def pose_figure(figure: Figure, t_ns: int, last: Posed | None = None) -> Posed | None:
    """The figure's primitives at step time `t_ns`; None before its first motion.

    last: what this gave a step ago, to save computing the same again.
    """
    if figure.posture is None:
        return None
    build = build_of(figure.person.height, figure.person.build)
    usable = last if last is not None and last.build is build else None
    if usable is not None and usable.figure.posture is figure.posture:
        joints, body, primitives = usable.joints, usable.body, usable.primitives
    else:
        joints = pose_joints(build.skeleton, figure.posture)
        body = pose_body(build.body, joints)
        primitives = PrimitiveSet.of_cone_spheres(body.a, body.b, body.radius_a, body.radius_b)
    velocity = np.zeros((len(build.body), 3))
    gap_ns = figure.t_ns - figure.before_t_ns
    if figure.before is not None and 0 < gap_ns < SILENT_NS and t_ns - figure.t_ns < SILENT_NS:
        if usable is not None and usable.figure.posture is figure.before:
            old = usable.body
        else:
            old = pose_body(build.body, pose_joints(build.skeleton, figure.before))
        velocity = (0.5 * (body.a + body.b) - 0.5 * (old.a + old.b)) / max(gap_ns * 1e-9, 0.004)
        velocity[np.sqrt((velocity**2).sum(axis=1)) > FASTEST] = 0.0
    return Posed(figure, build, joints, body, primitives, velocity)
