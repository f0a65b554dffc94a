"""Axes a hand can close around: those a thing was given, or those its shape has (Singh §6.6; mathematics M8.8)."""

import math

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.things.things import GraspAxis, Thing, ThingPrimitive

MOST = 24
"""Axes looked at for one thing."""
WIDEST = 0.075
"""Half of what a hand can close around [m]."""
ROUND_RING = 8
"""Axes along a ring's tube."""


def axes_of(thing: Thing, across: F64) -> tuple[GraspAxis, ...]:
    """The axes of a thing. across: unit vector (3,) along the hand's palm in the thing's frame, for shapes that are the
    same from every side: their axis is the one that needs no turn."""
    if thing.axes:
        return thing.axes
    out: list[GraspAxis] = []
    for p in thing.primitives:
        r = matrix_from_quaternion(p.rotation)
        out += [GraspAxis(p.position + r @ a.point, r @ a.direction, a.radius) for a in _own(p, r.T @ across)]
    return tuple(a for a in out[:MOST] if a.radius <= WIDEST)


def _own(p: ThingPrimitive, across: F64) -> list[GraspAxis]:
    """Of a primitive, in its frame."""
    q, middle = p.params, np.zeros(3)
    if p.kind == "sphere":
        return [GraspAxis(middle, across, q[0])]
    if p.kind == "cone_sphere":
        a, b = np.array(q[:3]), np.array(q[3:6])
        length = math.dist(q[:3], q[3:6])
        if length < 0.2 * max(q[6:]):
            return [GraspAxis(0.5 * (a + b), across, max(q[6:]))]
        return [GraspAxis(0.5 * (a + b), (b - a) / length, 0.5 * (q[6] + q[7]))]
    if p.kind == "superellipsoid":
        return _of_box(np.array(q[:3]))
    if p.kind == "supertoroid":
        turns = [2.0 * math.pi * k / ROUND_RING for k in range(ROUND_RING)]
        tube = 0.5 * (q[0] + q[2])
        return [
            GraspAxis(
                np.array([q[0] * q[3] * math.cos(t), q[1] * q[3] * math.sin(t), 0.0]),
                _unit(np.array([-q[0] * math.sin(t), q[1] * math.cos(t), 0.0])),
                tube,
            )
            for t in turns
        ]
    corners = np.array(q[1:]).reshape(-1, 3)
    edges = np.roll(corners, -1, axis=0) - corners
    return [GraspAxis(c + 0.5 * e, _unit(e), q[0]) for c, e in zip(corners, edges, strict=True)]  # a plate is taken by its rim


def _of_box(half: F64) -> list[GraspAxis]:
    """One along each side; the radius is that of the narrower of the other two, by which a hand spans it."""
    return [GraspAxis(np.zeros(3), np.eye(3)[k], float(min(half[(k + 1) % 3], half[(k + 2) % 3]))) for k in range(3)]


def _unit(v: F64) -> F64:
    return v / max(1e-12, math.sqrt(float(v @ v)))
