"""How a true hand takes a thing: where the thing lies in it, how it opens and closes, and when each digit touches."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.grasping.things import Things
from vistel.arrays import F64
from vistel.figure.posture.limits import FINGER_LIMITS
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.dynamics.solids import solids
from vistel.space.hands.fitting import HandPrimitives
from vistel.space.people import HAND_JOINT, PALM
from vistel.space.things.things import Thing

KINDS = ("power", "pinch", "tripod", "lateral", "scissor", "two hands")
FINGERS = ("index", "middle", "ring", "little")
ENGAGED = {"power": (0, 1, 2, 3, 4), "pinch": (0, 1), "tripod": (0, 1, 2), "lateral": (0,), "scissor": (1, 2)}
"""The digits that close, 0: the thumb."""
OPPOSITE = -0.5
"""Cosine between the sides from which two digits truly hold a thing, at most."""
FURTHEST = 1.4
"""How far a digit may close: 1 is where it would be without the thing."""
TRIES = 150
"""So many hands and things are drawn until one can take the other."""
_DIGIT = np.repeat(np.arange(5), 4)


@dataclass(frozen=True)
class Grip:
    """A true hand at a thing: fingers open, (20,) and closed without the thing, where the thing lies in the hand joint's frame, how
    far each digit closes until it touches, (5,), nan: never."""

    hand: HandPrimitives
    thing: Thing
    rotation: F64
    place: F64
    opened: F64
    closed: F64
    touch: F64


def grip_of(things: Things, kind: str, turn: F64, hand: HandPrimitives, rng: np.random.Generator, most_ready: float) -> Grip:
    """A thing that the hand can take, and how. most_ready: share of the way that it has closed before it comes, at most."""
    makers = {"power": things.whole, "pinch": things.small, "tripod": things.small, "lateral": things.flat, "scissor": things.rods}
    for _ in range(TRIES):
        thing = makers[kind][int(rng.integers(len(makers[kind])))](rng)
        part = solids((thing,)).part(0)
        rotation = turn.T @ matrix_from_quaternion(thing.rotation)
        opened, closed = _ways(kind, hand, rng)
        place = _place(kind, hand, opened, closed, part, rotation, rng)
        if place is None:
            continue
        touch = _touches(hand, opened, closed, part.moved(rotation, place))
        digits = ENGAGED[kind]
        needed = [digits[0], digits[1]] if kind in ("pinch", "scissor") else [0]
        fingers = np.isfinite(touch[1:]).sum()
        enough = fingers >= {"power": 3, "tripod": 2}.get(kind, 1) or kind == "lateral"
        if not np.isfinite(touch[needed]).all() or not enough or np.nanmin(touch[list(digits)]) <= 0.12:
            continue
        if _opposing(hand, bent(opened, closed, np.nan_to_num(touch, nan=0.3)), part.moved(rotation, place)):
            # People open a hand a little wider than what they take: some of the way is done before they come.
            ready = float(rng.uniform(0.0, most_ready)) * float(np.nanmin(touch[list(digits)]))
            shaped = bent(opened, closed, np.where(np.isin(np.arange(5), digits), ready, 0.0))
            return Grip(hand, thing, rotation, place, shaped, closed, (touch - ready) / (1.0 - ready))
    raise RuntimeError(f"no {kind} grasp was found in {TRIES} tries")


def _ways(kind: str, hand: HandPrimitives, rng: np.random.Generator) -> tuple[F64, F64]:
    """(20,) angles of the open hand, and of the hand closed round nothing [rad]."""
    deg = np.radians
    closed = np.zeros(20)
    base, mid = rng.uniform(30.0, 50.0), rng.uniform(35.0, 60.0)
    spread = np.array([4.0, 0.0, -4.0, -9.0])
    for f in range(4):
        closed[4 + 4 * f : 8 + 4 * f] = deg([base + 3 * f, spread[f], mid + 3 * f, 0.6 * mid])
    closed[:4] = deg([62.0, 35.0, 15.0, 15.0])
    opened = closed.copy()
    opened[4::4] *= rng.uniform(0.2, 0.5)
    opened[6::4] *= rng.uniform(0.2, 0.5)
    opened[7::4] *= 0.3
    opened[:4] = deg([rng.uniform(45.0, 65.0), rng.uniform(45.0, 58.0), -15.0, -10.0])
    if kind == "power":
        for f in range(4):
            closed[4 + 4 * f : 8 + 4 * f] = deg([75.0 + 2 * f, spread[f], 90.0, 55.0])
            opened[4 + 4 * f : 8 + 4 * f] = deg([rng.uniform(-8.0, 8.0), 1.5 * spread[f], rng.uniform(2.0, 20.0), 4.0])
        closed[:4] = deg([75.0, 20.0, 40.0, 45.0])
        opened[:4] = deg([rng.uniform(60.0, 80.0), rng.uniform(48.0, 58.0), -15.0, -15.0])
    elif kind == "pinch":
        for f in (1, 2, 3):  # the others stay out of the way, straight or curled
            closed[4 + 4 * f : 8 + 4 * f] = opened[4 + 4 * f : 8 + 4 * f] = deg(
                [rng.uniform(0.0, 20.0), spread[f], rng.uniform(5.0, 25.0), 5.0]
            )
        closed[:4] = _thumb_to(hand, closed, [_tip(hand, closed, "index")])
    elif kind == "tripod":
        for f in (2, 3):
            opened[4 + 4 * f : 8 + 4 * f] = closed[4 + 4 * f : 8 + 4 * f] = deg([rng.uniform(10.0, 30.0), spread[f], 25.0, 10.0])
        closed[:4] = _thumb_to(hand, closed, [_tip(hand, closed, "index"), _tip(hand, closed, "middle")])
    elif kind == "lateral":
        for f in range(4):
            bent = deg([rng.uniform(30.0, 45.0) + 10 * f, spread[f], rng.uniform(45.0, 65.0), 30.0])
            closed[4 + 4 * f : 8 + 4 * f] = opened[4 + 4 * f : 8 + 4 * f] = bent
        at, aside = _side(hand, closed, "index", 0.8)
        closed[:4] = _thumb_to(hand, closed, [at])
        opened[:4] = _thumb_to(hand, closed, [at + rng.uniform(0.045, 0.06) * aside + np.array([0.01, -0.012, 0.0])])
    elif kind == "scissor":
        bend, mid = rng.uniform(5.0, 20.0), rng.uniform(5.0, 20.0)
        for f in range(4):
            closed[4 + 4 * f : 8 + 4 * f] = deg([bend, (-8.0, 8.0, -2.0, -6.0)[f], mid, 5.0])
            opened[4 + 4 * f : 8 + 4 * f] = deg([bend, (24.0, -10.0, -14.0, -20.0)[f], mid, 5.0])
        closed[:4] = opened[:4]
    low, high = FINGER_LIMITS.T
    return np.clip(opened, low, high), np.clip(closed, low, high)


def _joints(hand: HandPrimitives, fingers: F64) -> tuple[F64, F64]:
    """Rotations and positions of the right hand's joints, in the hand joint's frame."""
    hands = np.zeros((2, 20))
    hands[1] = fingers
    pose, j = pose_joints(hand.build.skeleton, Posture(hands=hands)), HAND_JOINT[1]
    base = pose.rotation[j]
    return base.T @ pose.rotation, (pose.position - pose.position[j]) @ base


def _tip(hand: HandPrimitives, fingers: F64, digit: str) -> F64:
    """(3,) in the hand joint's frame [m]."""
    rotation, position = _joints(hand, fingers)
    j = JOINT_INDEX[f"right_{digit}_distal"]
    return position[j] + rotation[j] @ hand.build.skeleton.tip[j]


def _side(hand: HandPrimitives, fingers: F64, digit: str, along: float) -> tuple[F64, F64]:
    """A point within the middle bone of a finger (3,), and the way to its thumb's side (3,)."""
    rotation, position = _joints(hand, fingers)
    j = JOINT_INDEX[f"right_{digit}_intermediate"]
    return position[j] + along * (rotation[j] @ hand.build.skeleton.tip[j]), rotation[j][:, 2]


def _thumb_to(hand: HandPrimitives, fingers: F64, targets: Sequence[F64]) -> F64:
    """(4,) thumb angles with its tip at the middle of some points: damped least squares."""
    goal, angles = sum(targets, np.zeros(3)) / len(targets), np.radians([60.0, 30.0, 15.0, 15.0])
    rest = angles.copy()
    low, high = FINGER_LIMITS[:4].T

    def miss(a: F64) -> F64:
        return np.concatenate([_tip(hand, np.concatenate([a, fingers[4:]]), "thumb") - goal, 0.003 * (a - rest)])

    for _ in range(25):
        here = miss(angles)
        jacobian = np.stack([(miss(angles + d) - here) / 1e-4 for d in 1e-4 * np.eye(4)], 1)
        step = np.linalg.solve(jacobian.T @ jacobian + 1e-6 * np.eye(4), -jacobian.T @ here)
        angles = np.asarray(np.clip(angles + np.clip(step, -0.2, 0.2), low, high), np.float64)
    return angles


def _place(
    kind: str, hand: HandPrimitives, opened: F64, closed: F64, part: PrimitiveSet, rotation: F64, rng: np.random.Generator
) -> F64 | None:
    """(3,) where the thing lies in the hand joint's frame [m]; None: it does not fit in."""
    off = rng.normal(0.0, 0.003, 3)
    if kind in ("pinch", "tripod"):
        tips = [_tip(hand, closed, FINGERS[d - 1]) for d in ENGAGED[kind] if d]
        at = 0.5 * (sum(tips, np.zeros(3)) / len(tips) + _tip(hand, closed, "thumb")) + off
        return at if float(hand.depths(opened, part.moved(rotation, at))[0].max()) < -0.002 else None
    if kind == "power":
        below, start = np.array([0.0, -1.0, 0.0]), hand.build.palm[1] + np.array([off[0], 0.0, off[2]])
        gap = float(rng.uniform(0.0, 0.006))
        return until(hand, opened, part, rotation, start, below, gap, hand.digit != 0)
    if kind == "lateral":
        at, aside = _side(hand, closed, "index", 0.8)
        return until(hand, opened, part, rotation, at, aside, 0.0, hand.digit == 1)
    at = 0.5 * (_side(hand, closed, "index", 0.5)[0] + _side(hand, closed, "middle", 0.2)[0]) + np.array([off[0], 0.0, 0.0])
    return at if float(hand.depths(opened, part.moved(rotation, at))[0].max()) < -0.001 else None


def until(
    hand: HandPrimitives, opened: F64, part: PrimitiveSet, rotation: F64, start: F64, way: F64, gap: float, keep: NDArray[np.bool_]
) -> F64 | None:
    """Where the thing is when it comes along -way to `start` until it is `gap` from the kept primitives of the open hand; None: it
    would be in others."""
    low, high = 0.0, 0.25
    for _ in range(16):
        middle = 0.5 * (low + high)
        deep = float(hand.depths(opened, part.moved(rotation, start + middle * way))[0][keep].max()) > -gap
        low, high = (middle, high) if deep else (low, middle)
    at = start + high * way
    return at if float(hand.depths(opened, part.moved(rotation, at))[0].max()) < 0.001 else None


def _touches(hand: HandPrimitives, opened: F64, closed: F64, lying: PrimitiveSet) -> F64:
    """(5,) how far each digit closes until it touches the thing; nan where it never does."""
    steps = np.linspace(0.0, FURTHEST, 57)
    depth = np.array([_by_digit(hand, bent(opened, closed, np.full(5, u)), lying) for u in steps])
    out = np.full(5, np.nan)
    for d in range(5):
        inside = np.flatnonzero(depth[:, d] >= 0.0)
        moves = bool(np.abs((closed - opened)[d == _DIGIT]).max() > 1e-6)
        if len(inside) and (moves or inside[0] == 0):
            out[d] = steps[inside[0]]
    return out


def _opposing(hand: HandPrimitives, fingers: F64, lying: PrimitiveSet) -> bool:
    """Whether two of the digits that touch the thing do so from opposite sides."""
    depth, normal = hand.depths(fingers, lying)
    touching = np.flatnonzero((depth > -0.0015) & (hand.digit != PALM))
    return bool((normal[touching] @ normal[touching].T < OPPOSITE).any())


def _by_digit(hand: HandPrimitives, fingers: F64, lying: PrimitiveSet) -> F64:
    depth = hand.depths(fingers, lying)[0]
    return np.array([depth[hand.digit == d].max() for d in range(5)])


def bent(opened: F64, closed: F64, u: F64) -> F64:
    return np.clip(opened + u[_DIGIT] * (closed - opened), FINGER_LIMITS[:, 0], FINGER_LIMITS[:, 1])
