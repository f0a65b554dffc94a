"""A hand laid on a thing: the palm at its surface, the fingers closed until they touch it and no further (Singh §6.6).

Singh draws fingers on by constraints and keeps them out by collisions. Here both act on the joints: a finger that must
hold is bent until it touches (constraint). A finger that would enter the thing is kept back (collision), joint by joint
from the knuckle outwards. The result is kept while the hand holds the thing.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.figure.body import Body, pose_body
from vistel.figure.posture.limits import FINGER_LIMITS
from vistel.figure.posture.posture import pose_hand
from vistel.figure.skeleton import JOINT_INDEX, finger_joints
from vistel.implicit.contacts.contact import find_contacts
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.people import DIGITS, MOST_BUILDS, PALM, SIDES, THUMB, Build

PRESS = 0.0004
"""How far a finger's undeformed surface goes into what it touches [m]."""
MARGIN = 0.03
"""Distance up to which a finger's distance from a thing is computed [m]."""
STEPS = 16
"""Steps in which a finger is closed from the open hand to how the real hand has it."""
FURTHER_STEPS = 8
"""Steps in which it is then closed further, until it touches."""
FURTHER = 0.6
"""How much further than it was bent a finger is drawn to the thing, each joint [rad]."""
HALVINGS = 6
TRIES = 6
"""Number of times that a thing is moved out of the way of a bone that cannot move."""
MOST_SHIFT = 0.045
"""A thing is brought out of the palm, or to it, by no more than this [m]."""

_DIGIT = np.repeat(np.arange(5), 4)
_LEVEL = np.tile([0, 0, 1, 2], 5)
"""The first bone of the digit that each angle moves."""
_BEND = np.array([4, 6, 7, 8, 10, 11, 12, 14, 15, 16, 18, 19])
"""Angles that bend the four fingers."""
_OPEN_THUMBS = np.radians(
    [
        [35.0, 45.0, -10.0, -10.0],
        [70.0, 55.0, -20.0, -20.0],
        [0.0, 55.0, -20.0, -20.0],
        [-20.0, 30.0, -20.0, -20.0],
        [100.0, 45.0, -20.0, -20.0],
        [100.0, 0.0, -20.0, -20.0],
    ]
)
_OPEN_FINGER = np.radians([-15.0, 0.0, 0.0])


@dataclass(frozen=True)
class GraspFit:
    """How a hand holds a thing: fingers (20,) angles [rad], shift (3,) of the thing in the hand's frame [m], depth: the
    deepest that any part of the hand still goes into it [m]."""

    fingers: F64
    shift: F64
    depth: float


@dataclass(frozen=True, eq=False)
class HandPrimitives:
    """The primitives of one hand: rows (H,) of the body, digit (H,) 0 to 5, level (H,) of each bone in its digit, joint
    (H,); palm primitives have level -1."""

    build: Build
    right: bool
    rows: I64
    digit: I64
    level: I64

    @cached_property
    def _body(self) -> Body:
        b, rows = self.build.body, self.rows
        names = tuple(b.names[int(k)] for k in rows.tolist())
        return Body(names, b.joint[rows], b.a[rows], b.b[rows], b.radius_a[rows], b.radius_b[rows])

    def placed(self, fingers: F64) -> PrimitiveSet:
        """The hand with its fingers at (20,) angles, in the hand joint's frame."""
        posed = pose_body(self._body, pose_hand(self.build.skeleton, self.right, fingers))
        return PrimitiveSet.of_cone_spheres(posed.a, posed.b, posed.radius_a, posed.radius_b)

    def depths(self, fingers: F64, thing: PrimitiveSet) -> tuple[F64, F64]:
        """(H,) how deep each primitive is in the thing, -MARGIN for far off ones [m], and (H, 3) the way out of the hand."""
        found = find_contacts(self.placed(fingers), thing, margin=MARGIN)
        depth, normal = np.full(len(self.rows), -MARGIN), np.zeros((len(self.rows), 3))
        for k in np.argsort(found.depth, kind="stable"):
            depth[found.a[k]], normal[found.a[k]] = found.depth[k], found.normal[k]
        return depth, normal


@lru_cache(maxsize=2 * MOST_BUILDS)
def hand_of(build: Build, right: bool) -> HandPrimitives:
    """One hand of a body."""
    rows = np.flatnonzero((build.digit >= 0) & (build.digit // DIGITS == int(right)))
    joints = [JOINT_INDEX[name] for name in finger_joints(SIDES[int(right)])]
    level = [joints.index(j) % 3 if j in joints else -1 for j in build.body.joint[rows].tolist()]
    return HandPrimitives(build, right, rows, build.digit[rows] % DIGITS, np.array(level))


def fit(build: Build, right: bool, fingers: F64, engaged: tuple[bool, ...], thing: PrimitiveSet, *, to_palm: bool) -> GraspFit:
    """How the hand, its fingers at (20,) angles, holds a thing that lies in the hand joint's frame as `thing` does.

    engaged: which of the four fingers are to touch it, as the thumb is; to_palm: the palm is to touch it too. When a bone
    cannot move out of the way, the thing moves in the hand. A hand that cannot move the thing moves the other way itself.
    """
    hand = hand_of(build, right)
    start = fingers.copy()
    start[_BEND] = np.minimum(start[_BEND], np.tile(_OPEN_FINGER, 4))
    shift = _out_of_palm(hand, start, thing, np.zeros(3))
    if to_palm:
        shift = _out_of_palm(hand, start, thing, shift + _to_palm(hand, start, thing, shift))
    best: GraspFit | None = None
    for attempt in range(TRIES):
        lying = thing.moved(np.eye(3), shift)
        start[:4] = min(_OPEN_THUMBS, key=lambda t, lying=lying: _thumb_depth(hand, start, t, lying))
        closed = _closed(hand, start, fingers, np.array((True, *engaged)), lying)
        depth, normal = hand.depths(closed, lying)
        k = int(np.argmax(depth))
        if best is None or depth[k] < best.depth:
            best = GraspFit(closed, shift, float(depth[k]))
        if depth[k] <= 2.0 * PRESS:
            break
        # Some bone cannot get out of the way: the thing does; if that leads it in between others, away from the palm.
        way = normal[k] if attempt < TRIES // 2 else np.array([0.0, -1.0, 0.0])
        shift = _out_of_palm(hand, start, thing, _bounded(shift + way * depth[k], MOST_SHIFT))
    assert best is not None
    return best


def _out_of_palm(hand: HandPrimitives, opened: F64, thing: PrimitiveSet, shift: F64) -> F64:
    """The shift of the thing with which palm and straight fingers are outside it."""
    for _ in range(6):
        depth, normal = hand.depths(opened, thing.moved(np.eye(3), shift))
        depth = np.where(hand.digit == THUMB, -MARGIN, depth)
        k = int(np.argmax(depth))
        if depth[k] <= PRESS:
            break
        shift = _bounded(shift + normal[k] * (depth[k] - 0.5 * PRESS), MOST_SHIFT)
    return shift


def _to_palm(hand: HandPrimitives, opened: F64, thing: PrimitiveSet, shift: F64) -> F64:
    """(3,) shift of the thing to the palm [m]."""
    depth, normal = hand.depths(opened, thing.moved(np.eye(3), shift))
    depth = np.where(hand.digit == PALM, depth, -MARGIN)
    k = int(np.argmax(depth))
    return normal[k] * depth[k] if -MARGIN < depth[k] < 0.0 else np.zeros(3)


def _thumb_depth(hand: HandPrimitives, opened: F64, thumb: F64, thing: PrimitiveSet) -> float:
    depth, _ = hand.depths(np.concatenate([thumb, opened[4:]]), thing)
    return max(0.0, float(depth[hand.digit == THUMB].max(initial=0.0)))


def _closed(hand: HandPrimitives, start: F64, fingers: F64, engaged: NDArray[np.bool_], thing: PrimitiveSet) -> F64:
    """The fingers on their way from `start` to how they are, each bone as far as it goes; those that hold go on until
    they touch."""
    further = fingers.copy()
    further[_BEND] += FURTHER * engaged[_DIGIT[_BEND]]
    further[2:4] += FURTHER
    further = np.clip(further, FINGER_LIMITS[:, 0], np.maximum(FINGER_LIMITS[:, 1], fingers))
    path = [start + (fingers - start) * (k + 1) / STEPS for k in range(STEPS)]
    path += [fingers + (further - fingers) * (k + 1) / FURTHER_STEPS for k in range(FURTHER_STEPS)]
    at, free = start.copy(), np.ones((5, 3), np.bool_)
    ahead = np.zeros(20)  # what a bone would have gone on when it was stopped
    for k, way in enumerate(path):
        untouched = np.logical_and.reduce(free, axis=1)
        moves = np.asarray(free[_DIGIT, _LEVEL] & (untouched[_DIGIT] | (k < STEPS)))  # what touches is not drawn on
        if not moves.any():
            break
        new = np.where(moves, way, at)
        depth, _ = hand.depths(new, thing)
        stopped = np.zeros((5, 3), np.bool_)
        for digit in range(5):
            touching = hand.level[(hand.digit == digit) & (depth > PRESS)]
            if len(touching):
                stopped[digit, : int(touching.max()) + 1] = True
        stopped &= free
        halted = np.logical_or.reduce(stopped, axis=1)
        ahead = np.where(stopped[_DIGIT, _LEVEL], new - at, ahead)
        at = np.where(halted[_DIGIT], at, new)
        free &= ~stopped
    return _touching(hand, at, ahead, free, thing)


def _touching(hand: HandPrimitives, at: F64, ahead: F64, free: NDArray[np.bool_], thing: PrimitiveSet) -> F64:
    """Every bone that was stopped goes on, from the knuckle outwards, until it or what is beyond it just touches."""
    for level in range(3):
        low, high = np.zeros(5), np.where(free[:, level], 0.0, 1.0)
        onward = np.where(np.equal(_LEVEL, level), ahead, 0.0)
        for _ in range(HALVINGS):
            share = 0.5 * (low + high)
            depth, _ = hand.depths(at + share[_DIGIT] * onward, thing)
            for digit in range(5):
                beyond = (hand.digit == digit) & (hand.level >= level)
                inside = bool((depth[beyond] > PRESS).any())
                low[digit], high[digit] = (low[digit], share[digit]) if inside else (share[digit], high[digit])
        at = at + low[_DIGIT] * onward
    return at


def _bounded(v: F64, most: float) -> F64:
    length = float(np.sqrt(v @ v))
    return v * (most / length) if length > most else v
