"""Contact points of things: small spheres that together reach the surface from inside."""

import itertools
import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I32, I64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.contacts.contact_surface_kernels import surface  # pyright: ignore[reportUnknownVariableType]
from vistel.jit.kernel_jit import compiled
from vistel.space.things.things import Thing, ThingPrimitive

MANY = 200
"""A thing with more contact points keeps SPREAD of them, spread over it."""
SPREAD = 48
"""Contact points of a thing with more than MANY."""
INSIDE = 0.001
"""A contact point this deep in another primitive of its thing reaches no surface [m]."""


@lru_cache(2048)
def contact_points_of(thing: Thing) -> tuple[F64, F64]:
    """Centres (M, 3) in the thing's frame and radii (M,) [m]."""
    points: list[F64] = []
    radii: list[float] = []
    owner: list[int] = []
    for k, p in enumerate(thing.primitives):
        r = matrix_from_quaternion(p.rotation)
        centres, own = _contact_points(p)
        points += [r @ c + p.position for c in centres]
        radii += own
        owner += [k] * len(own)
    if not points:
        return np.zeros((0, 3)), np.zeros(0)
    centre, radius = np.array(points), np.array(radii)
    if len(points) <= MANY:
        return centre, radius
    kept = _spread(centre, radius, np.array(owner), thing)
    return centre[kept], radius[kept]


def _spread(centre: F64, radius: F64, owner: NDArray[np.int64], thing: Thing) -> NDArray[np.int64]:
    """Rows of the chosen contact points: first the outermost along each axis, then always the one furthest from those chosen."""
    rotation = np.array([matrix_from_quaternion(p.rotation) for p in thing.primitives])
    position = np.array([p.position for p in thing.primitives])
    s = PrimitiveSet.of_kinds([p.kind for p in thing.primitives], [p.params for p in thing.primitives], rotation, position)
    hidden: Any = _hidden(centre, radius, owner, s.kind, s.start, s.params, s.rotation, s.position)
    rows = np.flatnonzero(~np.asarray(hidden, np.bool_))
    points = centre[rows]
    chosen: list[int] = []
    away = np.full(len(rows), np.inf)

    def choose(n: int) -> None:
        nonlocal away
        chosen.append(n)
        away = np.minimum(away, ((points - points[n]) ** 2).sum(axis=1))

    for axis, side in itertools.product(range(3), (-1.0, 1.0)):
        n = int(np.argmax(side * points[:, axis] + radius[rows]))
        if away[n] > 0.0:
            choose(n)
    while len(chosen) < min(SPREAD, len(rows)):
        n = int(np.argmax(away))
        if away[n] <= 0.0:
            break
        choose(n)
    return rows[np.array(sorted(chosen))]


@compiled
def _hidden(
    centre: F64, radius: F64, owner: I64, kind: I32, start: I32, params: F64, rotation: F64, position: F64
) -> NDArray[np.bool_]:
    """(M,) whether a contact point reaches no surface: another primitive covers all of it."""
    out = np.zeros(len(centre), np.bool_)
    seen = np.empty(5)
    for i in range(len(centre)):
        for k in range(len(kind)):
            if k == owner[i]:
                continue
            d = centre[i] - position[k]
            r = rotation[k]
            a = r[0, 0] * d[0] + r[1, 0] * d[1] + r[2, 0] * d[2]
            b = r[0, 1] * d[0] + r[1, 1] * d[1] + r[2, 1] * d[2]
            c = r[0, 2] * d[0] + r[1, 2] * d[1] + r[2, 2] * d[2]
            surface(a, b, c, kind[k], params[start[k] : start[k + 1]], seen)
            if seen[0] + radius[i] < -INSIDE:
                out[i] = True
                break
    return out


def _contact_points(p: ThingPrimitive) -> tuple[list[F64], list[float]]:
    """Centres in the primitive's frame and radii of spheres that reach the surface where it may rest."""
    q = p.params
    if p.kind == "sphere":
        return [np.zeros(3)], [q[0]]
    if p.kind == "cone_sphere":
        a, b = np.array(q[:3]), np.array(q[3:6])
        steps = np.linspace(0.0, 1.0, 5)
        return [a + t * (b - a) for t in steps], [q[6] + t * (q[7] - q[6]) for t in steps]
    if p.kind == "rounded_polygon":
        corners = list(np.array(q[1:]).reshape(-1, 3))
        edges = [0.5 * (a + b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
        return corners + edges, [q[0]] * (2 * len(corners))
    if p.kind == "superellipsoid":
        points = [
            np.array([q[0] * ce * cw, q[1] * ce * sw, q[2] * se])
            for (ce, se), (cw, sw) in itertools.product(_profile(q[3]), _outline(q[4]))
        ]
        return points, [0.0] * len(points)
    tube = min(q[0], q[2])
    return [np.array([q[0] * q[3] * c, q[1] * q[3] * s, 0.0]) for c, s in _outline(q[5])], [tube] * len(_outline(q[5]))


def _outline(e: float) -> list[tuple[float, float]]:
    """Points of a superellipse |x|^(2/e) + |y|^(2/e) = 1; for boxy ones, where the flat sides end and the corners."""
    if e < 0.5:
        angles = [math.radians(90.0 * k + a) for k in range(4) for a in (10.0, 45.0, 80.0)]
    else:
        angles = [2.0 * math.pi * k / 16 for k in range(16)]
    return [(_signed_power(math.cos(a), e), _signed_power(math.sin(a), e)) for a in angles]


def _profile(e: float) -> list[tuple[float, float]]:
    """(outwards, up) points of the profile from below to above."""
    half = (10.0, 45.0, 80.0) if e < 0.5 else (0.0, 30.0, 60.0, 85.0)
    angles = sorted({s * a for a in half for s in (-1.0, 1.0)})
    return [(_signed_power(math.cos(math.radians(a)), e), _signed_power(math.sin(math.radians(a)), e)) for a in angles]


def _signed_power(x: float, e: float) -> float:
    return math.copysign(abs(x) ** e, x) if abs(x) > 1e-12 else 0.0
