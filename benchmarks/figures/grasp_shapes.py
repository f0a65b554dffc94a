"""Hands laid on things of many shapes: how deep they are in them, by points on every bone (`grasp_depth`)."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.figures.grasp_depth import deepest
from vistel.arrays import F64
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix
from vistel.space.dynamics.solids import solids
from vistel.space.hands.fitting import fit, hand_of
from vistel.space.hands.grasp import align
from vistel.space.people import build_of
from vistel.space.things.tessellate import tessellate_thing
from vistel.space.things.things import Thing, ThingPrimitive

HEIGHTS = (1.49, 2.01)
"""Of people whose hands are 85 % and 115 % of the average [m]."""


@dataclass(frozen=True)
class Laid:
    """One hand on one thing: kind of shape; before, after: its deepest point in it as it came and as it is laid on it [m];
    touching: digits that touch it; gives: how far the hand or the thing moves for that [m]."""

    kind: str
    before: float
    after: float
    touching: int
    gives: float


def shapes(rng: np.random.Generator, each: int) -> Iterator[tuple[str, Thing]]:
    """`each` things of every kind of primitive, and of several primitives, all of a size that a hand can hold."""
    for _ in range(each):
        yield "ball", _thing(ThingPrimitive("sphere", (rng.uniform(0.012, 0.045),)))
        long = rng.uniform(0.03, 0.12)
        ends = -long, 0.0, 0.0, long, 0.0, 0.0
        yield "cone-sphere", _thing(ThingPrimitive("cone_sphere", (*ends, *rng.uniform(0.008, 0.035, 2).tolist())))
        half, e = rng.uniform(0.012, 0.045, 3), rng.uniform(0.15, 1.5, 2)
        half[int(rng.integers(3))] *= rng.uniform(1.0, 2.0)
        yield "superellipsoid", _thing(ThingPrimitive("superellipsoid", (*half.tolist(), *e.tolist())))
        tube = rng.uniform(0.006, 0.014)
        ring = tube, tube, tube * rng.uniform(0.7, 1.5), rng.uniform(2.5, 5.0), *rng.uniform(0.5, 1.2, 2).tolist()
        yield "supertoroid", _thing(ThingPrimitive("supertoroid", ring))
        yield "polygon", _thing(_polygon(rng))
        yield "several", _several(rng)


def _polygon(rng: np.random.Generator) -> ThingPrimitive:
    count, across = int(rng.integers(3, 7)), rng.uniform(0.02, 0.05)
    turns = 2.0 * np.pi * np.arange(count) / count
    corners = across * np.stack([np.cos(turns), np.sin(turns), np.zeros(count)], 1)
    return ThingPrimitive("rounded_polygon", (float(rng.uniform(0.004, 0.012)), *corners.ravel().tolist()))


def _several(rng: np.random.Generator) -> Thing:
    """A cup, a hammer or a molecule: what a graph of primitives is."""
    which = int(rng.integers(3))
    if which == 0:
        r, high = rng.uniform(0.025, 0.04), rng.uniform(0.035, 0.06)
        body = ThingPrimitive("superellipsoid", (r, r, high, 0.3, 1.0))
        turned = quaternion_from_matrix(matrix_from_rotvec(np.array([0.5 * np.pi, 0.0, 0.0])))
        handle = ThingPrimitive("supertoroid", (0.006, 0.006, 0.006, 4.0, 1.0, 1.0), np.array([r + 0.012, 0.0, 0.0]), turned)
        return _thing(body, handle)
    if which == 1:
        shaft = ThingPrimitive("cone_sphere", (-0.09, 0.0, 0.0, 0.09, 0.0, 0.0, *rng.uniform(0.009, 0.016, 2).tolist()))
        head = ThingPrimitive("superellipsoid", (0.02, 0.05, 0.02, 0.3, 0.3), np.array([0.09, 0.0, 0.0]))
        return _thing(shaft, head)
    balls = [ThingPrimitive("sphere", (float(rng.uniform(0.012, 0.022)),), rng.uniform(-0.025, 0.025, 3)) for _ in range(4)]
    bars = [ThingPrimitive("cone_sphere", (*balls[0].position.tolist(), *b.position.tolist(), 0.006, 0.006)) for b in balls[1:]]
    return _thing(*balls, *bars)


def _thing(*primitives: ThingPrimitive) -> Thing:
    return Thing("it", "it", "it", primitives, 0.1, 0.0, 0, np.zeros(3))


def laid(hands: F64, rng: np.random.Generator, each: int, *, free: bool) -> Iterator[Laid]:
    """Closed hands (n, 20) on things of every kind, of people of several sizes.

    free: the thing may be turned and moved into the hand; else it stays where it is, up to a centimetre within hand or
    fingers, and the hand gives way.
    """
    builds = [build_of(h, g) for h in HEIGHTS for g in (0.9, 1.1)]
    for kind, thing in shapes(rng, each):
        build = builds[int(rng.integers(len(builds)))]
        fingers = hands[int(rng.integers(len(hands)))] + rng.normal(0.0, 0.03, 20)
        part = solids((thing,)).part(0)
        turn = matrix_from_rotvec(rng.uniform(-np.pi, np.pi, 3))
        off = rng.uniform(-1.0, 1.0, 3) * np.array([0.015, 0.006, 0.02])
        lie = build.palm[1] - np.array([0.0, _reach(thing, turn), 0.0]) + off
        pose = Pose(lie, quaternion_from_matrix(np.ascontiguousarray(turn)))
        if free:
            pose = align(thing, pose, build.palm[1])
        r = pose.matrix
        lying = part.moved(r, pose.position)
        found = fit(build, True, fingers, (True,) * 4, lying, to_palm=free)
        hand = hand_of(build, True)
        before, _ = deepest(hand.placed(fingers), hand.digit, thing, lie, turn)
        after, touching = deepest(hand.placed(found.fingers), hand.digit, thing, pose[0] + found.shift, r)
        yield Laid(kind, before, after, touching, float(np.linalg.norm(found.shift)))


def _reach(thing: Thing, turn: F64) -> float:
    """How far a thing, turned, reaches above its middle [m]."""
    return max(float((s.vertices @ turn.T)[:, 1].max()) for s in tessellate_thing(thing))
