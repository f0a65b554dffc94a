"""How deep a hand is in a thing, by points on its surface: nothing of what lays the fingers on is used here."""

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.things.things import Thing, ThingPrimitive

AROUND, ALONG = 24, 13
"""Points round a bone and along it; as many on each of its round ends."""
TOUCHES = 0.0015
"""A digit nearer than this touches [m]."""
MOST_M = 0.06
"""The greatest depth that is told from greater ones [m]."""
STEP_M = 0.001
"""Between two looks for the surface on the way out [m]."""


def deepest(hand: PrimitiveSet, digit: NDArray[np.int64], thing: Thing, position: F64, rotation: F64) -> tuple[float, int]:
    """The deepest point of the hand in the thing [m] (negative: the nearest one's distance, at most 2 cm), and how many
    digits touch. hand: cone-spheres; digit: of each; position (3,), rotation (3, 3): the thing in the hand's frame."""
    cones = hand.params.reshape(-1, 8)
    depth = np.array([_bone(c, thing, position, rotation) for c in cones])
    near = {int(d) for d in digit[depth > -TOUCHES]}
    return float(depth.max()), len(near)


def _bone(cone: F64, thing: Thing, position: F64, rotation: F64) -> float:
    points = (_surface(cone) - position) @ rotation
    best = -0.02
    for p in thing.primitives:
        own = (points - p.position) @ matrix_from_quaternion(p.rotation)
        best = max(best, float(_depths(p, own).max()))
    return best


def _surface(cone: F64) -> F64:
    """(N, 3) points on a cone-sphere."""
    a, b, ra, rb = cone[:3], cone[3:6], float(cone[6]), float(cone[7])
    axis = (b - a) / max(1e-9, float(np.linalg.norm(b - a)))
    side = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.8 else (0.0, 1.0, 0.0))
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    turns = 2.0 * np.pi * np.arange(AROUND) / AROUND
    ring = np.outer(np.cos(turns), side) + np.outer(np.sin(turns), other)
    out: list[F64] = []
    for t in np.linspace(0.0, 1.0, ALONG):
        out.append(a + t * (b - a) + (ra + t * (rb - ra)) * ring)
    for rise in np.linspace(0.0, 0.5 * np.pi, 6)[1:]:
        out.append(a + ra * (np.cos(rise) * ring - np.sin(rise) * axis))
        out.append(b + rb * (np.cos(rise) * ring + np.sin(rise) * axis))
    return np.concatenate(out)


def _depths(p: ThingPrimitive, points: F64) -> F64:
    """(N,) how deep points lie under the surface of a primitive, along the way out [m]; up to 2 cm off, negative."""
    h = 1e-6
    slope = np.stack([(_ratio(p, points + h * e) - _ratio(p, points - h * e)) / (2 * h) for e in np.eye(3)], 1)
    steep = np.linalg.norm(slope, axis=1)
    out = slope / np.maximum(steep, 1e-9)[:, None]
    inside = _ratio(p, points) < 1.0
    # The first surface on the line through the point along the slope, by millimetres and then by halving; from outside the line
    # goes inwards. Farther on there may be another one: the way out of a ring leads through its hole.
    way = np.where(inside[:, None], out, -out)
    low, crosses = np.zeros(len(points)), np.zeros(len(points), dtype=bool)
    for k in range(1, round(MOST_M / STEP_M) + 1):
        crosses |= (_ratio(p, points + k * STEP_M * way) < 1.0) != inside
        low = np.where(crosses, low, k * STEP_M)
    high = low + STEP_M
    for _ in range(30):
        middle = 0.5 * (low + high)
        same = (_ratio(p, points + middle[:, None] * way) < 1.0) == inside
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    distance = np.where(inside, low, -low)
    return np.where(crosses, np.maximum(distance, -0.02), np.where(inside, MOST_M, -0.02))


def _ratio(p: ThingPrimitive, x: F64) -> F64:
    """(N,) 1 on the surface, less inside (mathematics M1.5)."""
    q = p.params
    if p.kind == "sphere":
        return np.linalg.norm(x, axis=1) / q[0]
    if p.kind == "cone_sphere":
        a, b = np.array(q[:3]), np.array(q[3:6])
        length = float(np.linalg.norm(b - a))
        along, widens = (x - a) @ (b - a) / length, (q[7] - q[6]) / length
        square = np.maximum(0.0, ((x - a) ** 2).sum(axis=1) - along**2)
        wide = np.maximum(1e-9, q[6] + widens * along)
        t = np.clip(along + widens * square / wide, 0.0, length)
        return np.sqrt(square + (along - t) ** 2) / (q[6] + widens * t)
    if p.kind == "superellipsoid":
        a1, a2, a3, e1, e2 = q
        w = np.abs(x[:, 0] / a1) ** (2 / e2) + np.abs(x[:, 1] / a2) ** (2 / e2)
        return (w ** (e2 / e1) + np.abs(x[:, 2] / a3) ** (2 / e1)) ** (e1 / 2)
    if p.kind == "supertoroid":
        a1, a2, a3, alpha, e1, e2 = q
        ring = (np.abs(x[:, 0] / a1) ** (2 / e2) + np.abs(x[:, 1] / a2) ** (2 / e2)) ** (e2 / 2)
        return (np.abs(ring - alpha) ** (2 / e1) + np.abs(x[:, 2] / a3) ** (2 / e1)) ** (e1 / 2)
    return _to_polygon(np.array(q[1:]).reshape(-1, 3), x) / q[0]


def _to_polygon(corners: F64, x: F64) -> F64:
    """(N,) distance of points from a convex planar polygon."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
    normal /= np.linalg.norm(normal)
    high = (x - corners[0]) @ normal
    flat = x - np.outer(high, normal)
    best, within = np.full(len(x), np.inf), np.full(len(x), True)
    for c, d in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge = d - c
        within &= np.cross(np.broadcast_to(edge, x.shape), flat - c) @ normal >= 0.0
        t = np.clip((flat - c) @ edge / float(edge @ edge), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(flat - (c + t[:, None] * edge), axis=1))
    return np.hypot(high, np.where(within, 0.0, best))
