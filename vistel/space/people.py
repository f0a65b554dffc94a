"""People in the world: their posed primitives, their velocities, and the primitives of digits and palms."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I32, I64
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.body import Body, PosedBody, limb_velocities, pose_body, standard_body
from vistel.figure.posture.posture import JointPose, Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, REFERENCE_HEIGHT, Skeleton, finger_joints, standard_skeleton
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.inputs import MotionInput, ParticipantBody

SIDES = ("left", "right")
DIGITS = 6
"""Per hand: thumb, index, middle, ring, little finger, palm."""
THUMB = 0
"""Place of the thumb among the digits."""
PALM = 5
"""Place of the palm among the digits."""
HAND_JOINT = tuple(JOINT_INDEX[f"{side}_hand"] for side in SIDES)

PALM_CENTRE = np.array([0.088, -0.0135, 0.0])
"""Where a bar across the palm touches it, in the left hand's frame of a person of REFERENCE_HEIGHT."""
_MIRRORED = np.array([[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]])
PALM_GIVE = 0.002
"""How far below the knuckles' surface a bar lies in the palm [m]."""
FASTEST = 4.0
"""Speed above which a limb's motion is a tracker's jump, not a push [m/s]."""
MOST_BUILDS = 1024
"""Bodies of different people that are kept, some kB each. More people than that in a room build some of them in every step."""
SILENT_NS = 100_000_000
"""Without a new motion for so long, a limb counts as still."""


@dataclass(frozen=True, eq=False)
class Build:
    """Joint chain and primitives of a person; equal only to itself. digit: (P,) of each primitive, 6 * side + digit, or -1; palm:
    (2, 3) point at which a bar across the left and the right palm touches, in the hand's frame [m]."""

    skeleton: Skeleton
    body: Body
    digit: I64
    palm: F64

    @cached_property
    def hands(self) -> I64:
        """Which primitives belong to the hands."""
        return np.flatnonzero(self.digit >= 0)

    @cached_property
    def of_hand(self) -> NDArray[np.bool_]:
        """(P,) whether each primitive belongs to a hand."""
        return self.digit >= 0

    @cached_property
    def radius(self) -> list[float]:
        """The mean radius of each primitive [m]."""
        return (0.5 * (self.body.radius_a + self.body.radius_b)).tolist()

    @cached_property
    def _of_primitive(self) -> list[int]:
        return self.digit.tolist()

    def digits_of(self, primitives: I32) -> list[int]:
        """`digit` of some primitives."""
        numbers: list[int] = primitives.tolist()
        return [self._of_primitive[i] for i in numbers]


@lru_cache(maxsize=MOST_BUILDS)
def build_of(height: float, girth: float) -> Build:
    """The standard body for a standing height [m] and girth (1 = average)."""
    skeleton = standard_skeleton(min(2.6, max(0.5, height)))
    body = standard_body(skeleton, min(2.0, max(0.5, girth)))
    scale = skeleton.height / REFERENCE_HEIGHT
    return Build(skeleton, body, _digits(body), PALM_CENTRE * _MIRRORED * scale)


@lru_cache(maxsize=MOST_BUILDS)
def build_like(proportions: Proportions) -> Build:
    """The body of an avatar."""
    skeleton, body = proportions.skeleton, proportions.body
    palm = np.array([_palm(skeleton, body, row) for row in range(2)])
    return Build(skeleton, body, _digits(body), palm)


def _palm(skeleton: Skeleton, body: Body, row: int) -> F64:
    """(3,) palm of an avatar's hand [m]: that of an average hand of its length, moved to just below this hand's surface."""
    hand, finger = HAND_JOINT[row], JOINT_INDEX[f"{SIDES[row]}_middle_proximal"]
    average = standard_skeleton().rest
    scale = float(np.linalg.norm(skeleton.rest[finger] - skeleton.rest[hand]))
    scale /= float(np.linalg.norm(average[finger] - average[hand]))
    at = PALM_CENTRE * _MIRRORED[row] * min(2.0, max(0.4, scale))
    low = np.inf
    for i in np.flatnonzero(body.joint == hand):
        for t in np.linspace(0.0, 1.0, 33):
            ball, radius = (1.0 - t) * body.a[i] + t * body.b[i], (1.0 - t) * body.radius_a[i] + t * body.radius_b[i]
            under = radius**2 - (ball[0] - at[0]) ** 2 - (ball[2] - at[2]) ** 2
            if under > 0.0:
                low = min(low, float(ball[1] - np.sqrt(under)))
    if np.isfinite(low):
        at[1] = min(0.4 * at[1], max(2.5 * at[1], low - PALM_GIVE))
    return at


def _digits(body: Body) -> I64:
    """(P,) digit of each primitive by its joint; a hand in one piece is all palm."""
    of_joint = dict.fromkeys(range(len(JOINT_INDEX)), -1)
    for row, side in enumerate(SIDES):
        of_joint[HAND_JOINT[row]] = DIGITS * row + PALM
        for i, name in enumerate(finger_joints(side)):
            of_joint[JOINT_INDEX[name]] = DIGITS * row + i // 3
    return np.array([of_joint[j] for j in body.joint.tolist()], np.int64)


@dataclass(frozen=True)
class PersonState:
    """A person in the room. posture is None until the first motion; before: the posture before that, if usable for
    speeds; appeared: the step of the first motion."""

    person: ParticipantBody
    posture: Posture | None = None
    before: Posture | None = None
    seq: int = 0
    t_ns: int = 0
    before_t_ns: int = 0
    appeared: int = 0

    @property
    def name(self) -> str:
        """The participant."""
        return self.person.participant

    def moved(self, motion: MotionInput, step: int) -> "PersonState":
        """The figure after `motion`, received at a step of the world."""
        new = motion.seq != self.seq or motion.t_ns != self.t_ns
        if not new:
            return self
        appeared = step if self.posture is None else self.appeared
        return PersonState(self.person, motion.posture, self.posture, motion.seq, motion.t_ns, self.t_ns, appeared)


def flexion(posture: Posture) -> F64:
    """(2, 4) total flexion of index, middle, ring and little finger of both hands [rad]."""
    return flexion_of(posture.hands)


def flexion_of(angles: F64) -> F64:
    """(..., 4) total flexion for hands' angles (..., 20) [rad]."""
    return angles[..., 4::4] + angles[..., 6::4] + angles[..., 7::4]


@dataclass(frozen=True)
class Posed:
    """A figure in the room at one step: joints, primitives, and the primitives' velocity (P, 3) [m/s]."""

    figure: PersonState
    build: Build
    joints: JointPose
    body: PosedBody
    primitives: PrimitiveSet
    velocity: F64

    @property
    def name(self) -> str:
        """The participant."""
        return self.figure.name

    @property
    def cones(self) -> F64:
        """(P, 8) the primitives: ends and radii [m, room]."""
        return _cones(self.primitives)

    @cached_property
    def kept(self) -> dict[object, F64]:
        """What others have computed from this, by whom and of what; it saves time and is no state."""
        return {}


def _limbs(body: PosedBody) -> PrimitiveSet:
    return PrimitiveSet.of_cone_spheres(body.a, body.b, body.radius_a, body.radius_b)


def _cones(primitives: PrimitiveSet) -> F64:
    return primitives.params.reshape(-1, 8)


def pose_figure(figure: PersonState, t_ns: int, last: Posed | None = None) -> Posed | None:
    """The figure's primitives at step time `t_ns`; None before its first motion.

    last: the result of a step ago; its unchanged parts are used again.
    """
    if figure.posture is None:
        return None
    person = figure.person
    build = build_of(person.height, person.build) if person.proportions is None else build_like(person.proportions)
    usable = last if last is not None and last.build is build else None
    if usable is not None and usable.figure.posture is figure.posture:
        joints, body, primitives = usable.joints, usable.body, usable.primitives
    else:
        joints = pose_joints(build.skeleton, figure.posture)
        body = pose_body(build.body, joints)
        primitives = _limbs(body)
    velocity = np.zeros((len(build.body), 3))
    gap_ns = figure.t_ns - figure.before_t_ns
    if figure.before is not None and 0 < gap_ns < SILENT_NS and t_ns - figure.t_ns < SILENT_NS:
        if usable is not None and usable.figure is figure:
            return usable
        if usable is not None and usable.figure.posture is figure.posture and usable.figure.t_ns == figure.t_ns:
            return Posed(figure, build, joints, body, primitives, usable.velocity)
        if usable is not None and usable.figure.posture is figure.before:
            old = usable.primitives
        else:
            old = _limbs(pose_body(build.body, pose_joints(build.skeleton, figure.before)))
        velocity = limb_velocities(_cones(primitives), _cones(old), max(gap_ns * 1e-9, 0.004), FASTEST)
    return Posed(figure, build, joints, body, primitives, velocity)
