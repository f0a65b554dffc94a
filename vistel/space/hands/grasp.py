"""Grasps: when a closing hand takes hold of a thing, how the thing lies in it, and when it lets go (Singh §6.6).

A hand takes a thing when two digits on opposite sides of it have closed until it has hardly any play between them
(`vistel.space.hands.approach`); it lets go when they open again. Where the thing lies is aligned to the hand: the thing's axis
that needs the least change turns to lie across the palm (mathematics M8.8), and the fingers are laid on it
(`vistel.space.hands.fitting`).
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix
from vistel.geometry.smoothstep import ease
from vistel.implicit.contacts.contact import ContactArray
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.hands.approach import Approach, apertures, smoothed, tips
from vistel.space.hands.axes import axes_of
from vistel.space.hands.fitting import fit
from vistel.space.hands.reach_kernels import (
    BESIDE,
    FAR,
    FIRST,
    HANDS,
    PALM_PAIRS,
    REACHED,
    SECOND,
    THUMB_PAIRS,
    reached,  # pyright: ignore[reportUnknownVariableType]
)
from vistel.space.people import DIGITS, HAND_JOINT, PALM, THUMB, Posed, flexion
from vistel.space.things.things import Thing

MARGIN = 0.030
"""How far from a thing digits are watched [m]."""
OPPOSED = -0.35
"""Cosine between the normals of two digits that hold a thing between them, at most."""
FLAT = -0.6
"""The same for a hand and the other hand."""
VOLAR = -0.3
"""Cosine between where a digit touches and where its inner side faces, at least: backs of hands hold nothing."""
TOUCH = 0.006
"""A digit this near touches: the uncertainty of trackers and gloves [m]."""
CLOSING = 0.008
"""Two digits must have closed round a thing by so much to take it [m]..."""
BESIDE_CLOSING = 0.005
"""... two fingers beside each other by so much..."""
HANDS_CLOSING = 0.015
"""... and two hands by so much [m]."""
PLAY = 0.010
"""A thing with so little play between two digits is held by them [m]: each may be wrong by TOUCH."""
STOPPED = 0.3
"""Digits that have slowed down to this share of their quickest have found what they closed round..."""
QUICK = 0.06
"""... if that was at least so quick [m/s]..."""
STOPPED_PLAY = 0.016
"""... with no more play than this [m]: what a glove of 3 degrees and a hand of another size make of a touch."""
LYING = 0.012
"""A hand whose palm is so near lies on the thing [m]: it takes it when its fingers bend, not when only its thumb moves..."""
BENDING = 0.008
"""... which brings their tips nearer to the palm by so much [m]."""
OPENING = 0.016
"""Digits that are wider open than at their tightest by so much let go [m]..."""
BESIDE_OPENING = 0.006
"""... fingers beside each other by so much..."""
HANDS_OPENING = 0.02
"""... and two hands by so much [m]..."""
BACK = 0.5
"""... and, where they have closed further than the thing lets them, by this share of the way back to where they lie on it:
nothing stops fingers at a thing that is not there, and a fist that eases a little still holds."""
SLIP_STEPS = 6
"""A further holder whose hand is off the thing for so many steps has lost it."""
PROP_SLIP_STEPS = 30
"""The same for whoever holds a tracked thing: its tracker may be ahead of theirs."""
CLOSED = 1.5
"""Fingers flexed by so much, each on average, are closed round what they touch [rad]."""
BENT = 0.3
"""Fingers flexed by less lie on a thing and do not hold it [rad]."""
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
_CLOSING = np.array([CLOSING] * BESIDE + [BESIDE_CLOSING] * (HANDS - BESIDE) + [HANDS_CLOSING])
_OPENING = np.array([OPENING] * BESIDE + [BESIDE_OPENING] * (HANDS - BESIDE) + [HANDS_OPENING])
JOINING_NS = 750_000_000
"""Within this time further digits join a grasp."""
STILL_CLOSES = 0.0005
"""Fingers whose tips come nearer to the palm by so much still close [m], though they may pass the thumb."""


@dataclass(frozen=True)
class Grasp:
    """A hand holds a thing. start, aim: where it lay in the hand joint's frame and where it is brought to.

    engaged: which of the four fingers hold it; pairs: (PAIRS,) which pairs of digits do; aperture: (PAIRS,) how far apart they
    are, smoothed, tightest: (PAIRS,) the least of that, touched: (PAIRS,) at which they just touch [m]; fingers: (20,) angles
    with which the hand touches it and does not go into it, when it lies in the displayed hand at `laid`; shift (3,): from its
    place in the real hand to that one [m]; off: steps the hand has been off the thing; strained: steps it has borne more than it
    can.
    """

    participant: str
    right: bool
    thing: str
    start: Pose
    aim: Pose
    since_ns: int
    engaged: tuple[bool, ...]
    pairs: tuple[bool, ...]
    aperture: F64
    tightest: F64
    touched: F64
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
    """One hand near one thing. gap: (6,) how far each digit is [m], 1e300: not near; play: (PAIRS,) how much the thing has
    between the digits of each pair, without regard to where the hand is exactly [m], 1e300: it is not between them; around:
    another digit, or the other hand, is on its other side: a hand that comes to take it does not push it."""

    thing: int
    nearest: float
    gap: F64
    play: F64
    around: bool

    @property
    def engaged(self) -> tuple[bool, ...]:
        """Which of the four fingers touch it."""
        return tuple(bool(g < TOUCH) for g in self.gap[1:PALM])

    @property
    def palm(self) -> bool:
        """Whether the palm touches it."""
        return bool(self.gap[PALM] < TOUCH)


def reaches(posed: Posed, near: ContactArray, owner: I64, right: bool) -> list[Reach]:
    """The things near one hand, in order. near: the figure's contacts with all primitives of things."""
    if len(near) == 0:
        return []
    build, out = posed.build, np.empty((len(near), REACHED))
    a, b, point, normal, depth = (np.ascontiguousarray(x) for x in (near.a, near.b, near.point, near.normal, near.depth))
    count: Any = reached(
        a,
        b,
        point,
        normal,
        depth,
        owner,
        build.digit,
        build.body.joint,
        posed.joints.rotation,
        DIGITS if right else 0,
        tips(posed, right),
        OPPOSED,
        FLAT,
        VOLAR,
        out,
    )
    return [Reach(int(row[0]), float(row[1]), row[2:8], row[9:], bool(row[8] > 0.0)) for row in out[:count]]


def closing_pairs(reach: Reach, approach: Approach) -> NDArray[np.bool_]:
    """(PAIRS,) the pairs of digits that have closed round the thing until it has hardly any play between them, or until they
    stop."""
    stopped = (approach.speed < STOPPED * approach.quickest) & (approach.quickest > QUICK)
    play = np.where(stopped, STOPPED_PLAY, PLAY)
    pairs = (approach.closed > _CLOSING) & (reach.play < play)
    if reach.gap[PALM] < LYING:
        pairs[THUMB_PAIRS] &= approach.bent > BENDING
    return pairs


def closes(reach: Reach, approach: Approach) -> bool:
    """The hand takes hold of what it reaches: thumb or side of a finger, or the palm and two fingers."""
    pairs = closing_pairs(reach, approach)
    return bool(pairs[THUMB_PAIRS].any() or pairs[BESIDE:].any() or pairs[PALM_PAIRS].sum() >= 2)


def encloses(posed: Posed, right: bool, reach: Reach) -> bool:
    """The hand is closed round the thing, without a closing motion. So a prop is held: it is in the real hand before the world
    knows of it."""
    touching = np.array(reach.engaged)
    if posed.figure.posture is None or not touching.any() or not (reach.play[:BESIDE] < 2.0 * TOUCH).any():
        return False
    return float(flexion(posed.figure.posture)[int(right)][touching].mean()) > CLOSED


def take(
    posed: Posed,
    right: bool,
    thing: Thing,
    part: PrimitiveSet,
    pose: Pose,
    reach: Reach,
    pairs: NDArray[np.bool_],
    t_ns: int,
    led: bool,
) -> Grasp:
    """The grasp by which the hand holds `thing`, now at `pose` (room). part: its primitives, in its frame; pairs: (PAIRS,) of
    digits that hold it; led: the hand leads it, and so brings it into line."""
    assert posed.figure.posture is not None
    lie = into_hand(posed, right, pose)
    now = apertures(posed, right)
    flat = flexion(posed.figure.posture)[int(right)]
    touching = np.array(reach.engaged)
    for pair in np.flatnonzero(pairs[:HANDS]):
        touching[[d - 1 for d in (FIRST[pair], SECOND[pair]) if THUMB < d < PALM]] = True
    bent = touching & (flat > BENT)
    engaged = tuple(bool(e) for e in (bent if bent.any() else touching))
    touched = now - np.where(reach.play < FAR, reach.play, 0.0)
    new = Grasp(
        posed.name,
        right,
        thing.id,
        lie,
        lie,
        t_ns,
        engaged,
        tuple(bool(p) for p in pairs),
        now,
        now,
        touched,
        np.zeros(20),
        lie,
        np.zeros(3),
    )
    if not pairs[:BESIDE].any():  # held by the sides of fingers or between two hands: no finger bends to hold it
        return replace(new, fingers=posed.figure.posture.hands[int(right)])
    return _fitted(new, posed, thing, part, whole=reach.palm and sum(engaged) >= 3, led=led)


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


def follow(grasp: Grasp, posed: Posed, near: bool, dt: float, joining: Reach | None) -> Grasp:
    """The grasp one step of `dt` [s] on; near: the hand still is at the thing; joining: how it lies in the hand while further
    digits may come to it, as all do in a grasp that one of them began."""
    now = smoothed(grasp.aperture, apertures(posed, grasp.right), dt)
    tightest = np.minimum(grasp.tightest, now)
    closes = now[PALM_PAIRS] < grasp.tightest[PALM_PAIRS] - STILL_CLOSES
    tightest[THUMB_PAIRS] = np.where(closes, now[THUMB_PAIRS], tightest[THUMB_PAIRS])
    pairs, touched = np.array(grasp.pairs), grasp.touched
    if joining is not None:
        new = ~pairs & (joining.play < PLAY)
        new[BESIDE:] = False
        pairs, touched = pairs | new, np.where(new, now - joining.play, touched)
    held = tuple(bool(p) for p in pairs)
    return replace(grasp, pairs=held, aperture=now, tightest=tightest, touched=touched, off=0 if near else grasp.off + 1)


def opens(grasp: Grasp) -> bool:
    """The hand lets go: the pairs that hold have opened, on average."""
    pairs = np.array(grasp.pairs)
    further = BACK * (grasp.touched - grasp.tightest)
    return float((grasp.aperture - grasp.tightest - np.maximum(_OPENING, further))[pairs].mean()) > 0.0


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
