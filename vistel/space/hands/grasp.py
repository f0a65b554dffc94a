"""Grasps: when a closing hand takes hold of a thing, how the thing lies in it, and when it lets go (Singh §6.6).

A hand takes a thing when fingers touch it from one side and thumb or palm from the other while the fingers close; it
lets go when the fingers open again. Where the thing lies is aligned to the hand: the thing's axis that needs the
least change turns to lie across the palm (mathematics M8.8), and the fingers are laid on it (`vistel.space.hands.fitting`).
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vistel.arrays import F64, I64
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix
from vistel.geometry.smoothstep import ease
from vistel.implicit.contacts.contact import ContactArray
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.hands.axes import axes_of
from vistel.space.hands.fitting import fit
from vistel.space.hands.reach_kernels import REACHED, reached  # pyright: ignore[reportUnknownVariableType]
from vistel.space.people import DIGITS, HAND_JOINT, PALM, THUMB, Posed, flexion, flexion_of
from vistel.space.things.things import Thing

MARGIN = 0.030
"""How far from a thing digits are watched [m]."""
TOUCH = 0.006
"""A digit this near touches: the uncertainty of trackers and gloves [m]."""
NEARLY = 0.006
"""Fingers that have closed twice as far as they must to take hold count as touching from this far [m]: gloves are wrong by some
degrees, and no real thing stops the hand."""
NEARLY_OPPOSED = 0.012
"""The same for what opposes those fingers [m]."""
OPPOSED = -0.2
"""Cosine between the normals of a finger and of what opposes it, at most."""
VOLAR = -0.3
"""Cosine between where a digit touches and where its inner side faces, at least: backs of hands hold nothing."""
ASIDE = 0.5
"""The same cosine from which on fingers and what opposes them are on different sides of a thing, touched or not."""
AROUND = 0.1
"""Fingers that have closed by so much with a thing between them and what opposes them are about to take it [rad]..."""
CLOSING = 0.4
"""Fingers must have closed by so much, each on average, to take hold [rad]."""
OPENING = 0.35
"""Fingers open by so much from their tightest let go [rad]..."""
BACK = 0.5
"""... and, where they have closed further than the thing lets them, by this share of the way back to where they lie on it:
nothing stops fingers at a thing that is not there, and a fist that eases a little still holds."""
BENT = 0.3
"""Fingers flexed by less lie on a thing and do not hold it [rad]."""
SLIP_STEPS = 6
"""A further holder whose hand is off the thing for so many steps has lost it."""
PROP_SLIP_STEPS = 30
"""The same for whoever holds a tracked thing: its tracker may be ahead of theirs."""
CLOSED = 1.5
"""Fingers flexed by so much, each on average, are closed round what they touch [rad]."""
SETTLE_NS = 150_000_000
"""Time in which the thing is brought into line with the hand."""
MOST_TURN = math.radians(35.0)
"""Alignment turns a thing no further than this [rad]."""
MOST_SHIFT = 0.012
"""Alignment shifts a thing no further than this [m]."""
REFIT = 0.010
"""Fingers are laid anew on a thing that has moved so far in the hand by itself [m]."""
REFIT_TURN = 0.2
"""Fingers are laid anew on a thing that has turned so far in the hand by itself [rad]."""
ALONG = 0.1
"""Length that counts as much as a radian when axes are compared [m] (mathematics M8.8)."""


@dataclass(frozen=True)
class Grasp:
    """A hand holds a thing. start, aim: where it lay in the hand joint's frame and where it is brought to.

    engaged: which of the four fingers hold it; tightest: (4,) their greatest flexion [rad]; fingers: (20,) angles with which the
    hand touches it and does not go into it, when it lies in the displayed hand at `laid`; shift (3,): from its place in the real
    hand to that one [m]; off: steps the hand has been off the thing; strained: steps it has borne more than it can.
    """

    participant: str
    right: bool
    thing: str
    start: Pose
    aim: Pose
    since_ns: int
    engaged: tuple[bool, ...]
    tightest: F64
    fingers: F64
    laid: Pose
    shift: F64
    off: int = 0
    strained: int = 0

    @property
    def key(self) -> tuple[str, bool]:
        """The participant, and whether it is their right hand: a hand has one grasp."""
        return self.participant, self.right

    def settled(self, t_ns: int) -> float:
        """How far thing and fingers have come to where they are brought: 0 to 1."""
        u = min(1.0, max(0.0, (t_ns - self.since_ns) / SETTLE_NS))
        return ease(u)

    def lie(self, t_ns: int) -> Pose:
        """The pose of the thing that the hand wants, in the hand joint's frame at `t_ns`."""
        return self.start.interpolate(self.aim, self.settled(t_ns))

    def seen(self, t_ns: int) -> Pose:
        """The pose of the thing in the displayed hand's frame. That hand stays at a thing that it cannot move."""
        return self.start.interpolate(self.laid, self.settled(t_ns))


@dataclass(frozen=True)
class Reach:
    """One hand near one thing: fingers that touch it, and whether they are opposed by thumb or palm; around: it lies
    between fingers and what opposes them, touched or not."""

    thing: int
    engaged: tuple[bool, ...]
    opposed: bool
    palm: bool
    nearest: float
    around: bool


def reaches(posed: Posed, near: ContactArray, owner: I64, right: bool) -> list[Reach]:
    """The things near one hand, in order. near: the figure's contacts with all primitives of things."""
    if len(near) == 0:
        return []
    build, out = posed.build, np.empty((len(near), REACHED))
    a, b, normal, depth = (np.ascontiguousarray(x) for x in (near.a, near.b, near.normal, near.depth))
    count: Any = reached(
        a,
        b,
        normal,
        depth,
        owner,
        build.digit,
        build.body.joint,
        posed.joints.rotation,
        DIGITS if right else 0,
        _touching(posed, right),
        OPPOSED,
        ASIDE,
        VOLAR,
        out,
    )
    return [
        Reach(int(thing), (one > 0, two > 0, three > 0, four > 0), opposed > 0, palm > 0, nearest, around > 0)
        for thing, one, two, three, four, opposed, palm, nearest, around in out[:count].tolist()
    ]


def _touching(posed: Posed, right: bool) -> F64:
    """(6,) how near each digit of a hand must be to a thing to touch it [m]: the further the fingers have closed, the less."""
    out = np.full(DIGITS, TOUCH)
    if posed.figure.posture is not None:
        further = np.clip((flexion(posed.figure.posture) - posed.figure.opened)[int(right)] / CLOSING - 1.0, 0.0, 1.0)
        out[1:5] += NEARLY * further
        out[[THUMB, PALM]] += NEARLY_OPPOSED * float(further.max())
    return out


def closes(posed: Posed, right: bool, reach: Reach) -> bool:
    """The hand takes hold of what it reaches."""
    if not reach.opposed or posed.figure.posture is None:
        return False
    row = int(right)
    closed = (flexion(posed.figure.posture) - posed.figure.opened)[row]
    return float(closed[np.array(reach.engaged)].mean()) > CLOSING


def closes_round(posed: Posed, right: bool, reach: Reach) -> bool:
    """The hand is about to take what lies between its fingers, and so does not push it."""
    if not reach.around or posed.figure.posture is None:
        return False
    closed = (flexion(posed.figure.posture) - posed.figure.opened)[int(right)]
    return float(closed.max()) > AROUND


def encloses(posed: Posed, right: bool, reach: Reach) -> bool:
    """The hand is closed round the thing, without a closing motion. So a prop is held: it is in the real hand before the world
    knows of it."""
    if not reach.opposed or posed.figure.posture is None:
        return False
    return float(flexion(posed.figure.posture)[int(right)][np.array(reach.engaged)].mean()) > CLOSED


def take(posed: Posed, right: bool, thing: Thing, part: PrimitiveSet, pose: Pose, reach: Reach, t_ns: int, led: bool) -> Grasp:
    """The grasp by which the hand holds `thing`, now at `pose` (room). part: its primitives, in its frame; led: the hand
    leads it, and so brings it into line."""
    assert posed.figure.posture is not None
    lie = into_hand(posed, right, pose)
    tightest = flexion(posed.figure.posture)[int(right)]
    bent = tuple(touches and bool(far > BENT) for touches, far in zip(reach.engaged, tightest, strict=True))
    engaged = bent if any(bent) else reach.engaged
    new = Grasp(posed.name, right, thing.id, lie, lie, t_ns, engaged, tightest, np.zeros(20), lie, np.zeros(3))
    return _fitted(new, posed, thing, part, whole=reach.palm and sum(reach.engaged) >= 3, led=led)


def _fitted(grasp: Grasp, posed: Posed, thing: Thing, part: PrimitiveSet, *, whole: bool, led: bool) -> Grasp:
    """The grasp with thing and fingers laid on each other. whole: the palm holds too; led: the thing may be moved for that, else
    the hand is."""
    assert posed.figure.posture is not None
    row, lie = int(grasp.right), grasp.aim
    if whole and led:
        lie = align(thing, lie, posed.build.palm[row])
    lying = part.moved(lie.matrix, lie.position)
    found = fit(posed.build, grasp.right, posed.figure.posture.hands[row], grasp.engaged, lying, to_palm=whole and led)
    laid = Pose(lie.position + found.shift, lie.rotation)
    return replace(grasp, aim=laid if led else grasp.aim, fingers=found.fingers, laid=laid, shift=found.shift)


def follow(grasp: Grasp, posed: Posed, near: bool) -> Grasp:
    """The grasp one step on; near: the hand still is at the thing."""
    assert posed.figure.posture is not None
    now = flexion(posed.figure.posture)[int(grasp.right)]
    return replace(grasp, tightest=np.maximum(grasp.tightest, now), off=0 if near else grasp.off + 1)


def opens(grasp: Grasp, posed: Posed) -> bool:
    """The hand lets go."""
    assert posed.figure.posture is not None
    engaged = np.array(grasp.engaged)
    now = flexion(posed.figure.posture)[int(grasp.right)]
    opened = float((grasp.tightest - now)[engaged].mean())
    further = float((grasp.tightest - flexion_of(grasp.fingers))[engaged].mean())
    return opened > max(OPENING, BACK * further)


def lies(grasp: Grasp, posed: Posed, pose: Pose) -> Grasp:
    """The grasp of a thing that moves by itself, with the thing's present pose in the hand."""
    lie = into_hand(posed, grasp.right, pose)
    return replace(grasp, start=lie, aim=lie)


def renamed(grasp: Grasp, posed: Posed, thing: str, pose: Pose) -> Grasp:
    """The grasp of what is now part of `thing`, at `pose` (room): fingers and hand stay as they are."""
    lie = into_hand(posed, grasp.right, pose)
    return replace(grasp, thing=thing, start=lie, aim=lie, laid=Pose(lie.position + grasp.shift, lie.rotation))


def refitted(grasp: Grasp, posed: Posed, thing: Thing, part: PrimitiveSet) -> Grasp:
    """The same with the fingers laid on anew, if the thing has gone far enough in the hand for that to be seen."""
    off = grasp.aim.position + grasp.shift - grasp.laid.position
    near = abs(float(grasp.aim.rotation @ grasp.laid.rotation)) >= math.cos(0.5 * REFIT_TURN)
    if near and float(off @ off) <= REFIT**2:
        return grasp
    return _fitted(grasp, posed, thing, part, whole=False, led=False)


def restart(grasp: Grasp, posed: Posed, thing: Thing, part: PrimitiveSet, pose: Pose, t_ns: int, alone: bool) -> Grasp:
    """The grasp of a hand that still holds after others have let go: from the thing's present pose, without a jump. alone: it
    leads the thing now and aligns it."""
    lie = into_hand(posed, grasp.right, pose)
    grasp = replace(grasp, start=lie, since_ns=t_ns, strained=0)
    if not alone:
        return grasp
    return _fitted(replace(grasp, aim=lie), posed, thing, part, whole=sum(grasp.engaged) >= 3, led=True)


def hand_frame(posed: Posed, right: bool) -> tuple[F64, F64]:
    """Rotation (3, 3) and position (3,) [m] of a hand joint in the room."""
    j = HAND_JOINT[int(right)]
    return posed.joints.rotation[j], posed.joints.position[j]


def into_hand(posed: Posed, right: bool, pose: Pose) -> Pose:
    """A pose of the room in the hand joint's frame."""
    return pose.relative_to(*hand_frame(posed, right))


def out_of_hand(posed: Posed, right: bool, lie: Pose) -> Pose:
    """A pose of the hand joint's frame in the room."""
    return lie.moved(*hand_frame(posed, right))


def align(thing: Thing, lie: Pose, palm: F64) -> Pose:
    """Where the thing should lie in the hand: the axis that needs the least change turned across the palm, its
    surface at `palm` (3,) in the hand's frame (mathematics M8.8). Unchanged when that is further than MOST_TURN."""
    across = np.array([0.0, 0.0, 1.0])
    position, rotation = lie.position, lie.matrix
    best: tuple[float, F64, F64] | None = None
    for axis in axes_of(thing, rotation.T @ across):
        u = rotation @ axis.direction
        if u @ across < 0.0:
            u = -u
        turn = np.cross(u, across)
        sine = float(np.sqrt(turn @ turn))
        angle = math.atan2(sine, float(u @ across))
        if angle > MOST_TURN:
            continue
        r = matrix_from_rotvec(turn * (angle / sine)) if sine > 1e-9 else np.eye(3)
        foot = position + rotation @ axis.point
        foot = foot + ((palm - foot) @ u) * u  # of the palm's centre on the axis: it stays where it is along the axis
        shift = palm - np.array([0.0, axis.radius, 0.0]) - foot
        length = float(np.sqrt(shift @ shift))
        cost = (length / ALONG) ** 2 + angle**2
        if best is None or cost < best[0]:
            shift = shift * min(1.0, MOST_SHIFT / max(length, 1e-9))
            best = cost, foot + r @ (position - foot) + shift, r @ rotation
    if best is None:
        return lie
    return Pose(best[1], quaternion_from_matrix(np.ascontiguousarray(best[2])))
