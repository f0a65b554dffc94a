"""Triangles for the room's primitives, exact on their surfaces.

Kinds and parameters are those of `vistel.space.things.things.ThingPrimitive` (surface sizes in metres).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.things.things import Thing, ThingPrimitive


@dataclass(frozen=True)
class Surface3:
    """vertices: (n, 3) [m], normals: (n, 3) unit, outwards, triangles: (m, 3), counter-clockwise seen from outside."""

    vertices: F32
    normals: F32
    triangles: I32

    def moved(self, position: F64, quaternion: F64) -> "Surface3":
        """The surface turned by `quaternion` (x, y, z, w), then moved by `position`."""
        r = matrix_from_quaternion(np.ascontiguousarray(quaternion, np.float64))
        return Surface3(
            (self.vertices @ r.T + position).astype(np.float32), (self.normals @ r.T).astype(np.float32), self.triangles
        )


def join(surfaces: Sequence[Surface3]) -> Surface3:
    """One surface of many."""
    starts = np.cumsum([0] + [len(s.vertices) for s in surfaces])
    return Surface3(
        np.concatenate([s.vertices for s in surfaces]),
        np.concatenate([s.normals for s in surfaces]),
        np.concatenate([s.triangles + start for s, start in zip(surfaces, starts, strict=False)]).astype(np.int32),
    )


def tessellate(primitive: ThingPrimitive, detail: float = 1.0) -> Surface3:
    """The primitive in its thing's frame; `detail` scales how many triangles it gets."""
    segments = max(8, round(28 * detail))
    rings = max(4, round(9 * detail))
    p = primitive.params
    if primitive.kind == "sphere":
        surface = _cone_sphere(np.zeros(3), np.zeros(3), p[0], p[0], segments, rings)
    elif primitive.kind == "cone_sphere":
        surface = _cone_sphere(np.array(p[0:3]), np.array(p[3:6]), p[6], p[7], segments, rings)
    elif primitive.kind == "rounded_polygon":
        surface = _rounded_polygon(p[0], np.array(p[1:], np.float64).reshape(-1, 3), rings)
    elif primitive.kind == "superellipsoid":
        surface = _superellipsoid(p[:3], p[3], p[4], segments, rings)
    else:
        surface = _supertoroid(p[:3], p[3], p[4], p[5], 2 * segments, 2 * rings)
    return surface.moved(primitive.position, primitive.rotation)


def tessellate_thing(thing: Thing, detail: float = 1.0) -> list[Surface3]:
    """The primitives of a thing, in its frame; of a bent thing those of the straight one, bent."""
    if thing.curve is None:
        return [tessellate(p, detail) for p in thing.primitives]
    arc = thing.curve.arc
    edge = (arc.high - arc.low) / 14.0
    out: list[Surface3] = []
    for p in thing.curve.straight.primitives:
        fine = _divided(tessellate(p, detail), edge)
        points, normals = arc.surface(fine.vertices.astype(np.float64), fine.normals.astype(np.float64))
        out.append(Surface3(points.astype(np.float32), normals.astype(np.float32), fine.triangles))
    return out


def _divided(s: Surface3, longest: float) -> Surface3:
    """The surface with every edge longer than `longest` halved, again and again (at most four times)."""
    both, triangles = finer(np.hstack((s.vertices, s.normals)), s.triangles, longest, times=4)
    normals = both[:, 3:] / np.maximum(np.linalg.norm(both[:, 3:], axis=1, keepdims=True), 1e-12)
    return Surface3(both[:, :3], normals, triangles)


def finer(columns: NDArray[Any], triangles: I32, longest: float, most: int = 1 << 31, times: int = 12) -> tuple[NDArray[Any], I32]:
    """Triangles with every edge longer than `longest` [m] halved, again and again, while there are no more than `most`. columns:
    (n, 3 and more), places and whatever else vertices have, of which new ones have the mean."""
    for _ in range(times):
        edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges, which = np.unique(edges, axis=0, return_inverse=True)
        ends = columns[edges]
        long = np.linalg.norm(ends[:, 1, :3] - ends[:, 0, :3], axis=1) > longest
        middle = np.where(long, len(columns) + np.cumsum(long) - 1, -1)[which.reshape(-1)].reshape(-1, 3)
        if not long.any() or len(triangles) + np.count_nonzero(middle >= 0) > most:
            break
        columns = np.concatenate([columns, ends[long].mean(axis=1)]).astype(columns.dtype)
        triangles = np.array([t for c, m in zip(triangles.tolist(), middle.tolist(), strict=True) for t in _split(c, m)], np.int32)
    return columns, triangles


def _split(c: list[int], m: list[int]) -> list[tuple[int, int, int]]:
    """A triangle's pieces; m: new vertices on its edges 01, 12, 20, or -1."""
    cut = [k for k in range(3) if m[k] >= 0]
    if not cut:
        return [(c[0], c[1], c[2])]
    k = cut[0] if len(cut) < 2 or m[(cut[0] + 1) % 3] >= 0 else cut[1]
    a, b, d = c[k], c[(k + 1) % 3], c[(k + 2) % 3]
    p, q, r = m[k], m[(k + 1) % 3], m[(k + 2) % 3]
    if len(cut) == 1:
        return [(a, p, d), (p, b, d)]
    if len(cut) == 2:
        return [(a, p, d), (p, b, q), (p, q, d)]
    return [(a, p, r), (p, b, q), (r, q, d), (p, q, r)]


def fine_cone_sphere(params: Sequence[float], spacing: float) -> Surface3:
    """A cone-sphere (ax .. rb) with a vertex about every `spacing` metres, along its side as well: for what is dented."""
    a, b, ra, rb = np.array(params[0:3]), np.array(params[3:6]), params[6], params[7]
    radius = max(ra, rb)
    segments, rings = round(2.0 * math.pi * radius / spacing), round(0.5 * math.pi * radius / spacing)
    return _cone_sphere(a, b, ra, rb, max(16, segments), max(8, rings), round(float(np.linalg.norm(b - a)) / spacing))


def _grid(points: F64, normals: F64, wrap_rows: bool = False) -> Surface3:
    """(rows, columns, 3) points; columns close round. Counter-clockwise when rows x columns points outwards."""
    size: tuple[int, ...] = points.shape
    rows, columns = size[:2]
    i, j = np.meshgrid(np.arange(rows if wrap_rows else rows - 1), np.arange(columns), indexing="ij")
    up, along = (i + 1) % rows, (j + 1) % columns
    a, b, c, d = i * columns + j, i * columns + along, up * columns + along, up * columns + j
    triangles = np.stack((a, b, c, a, c, d), axis=-1).reshape(-1, 3)
    flat = points.reshape(-1, 3)
    corner = flat[triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    n = normals.reshape(-1, 3)
    n = n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-12)
    return Surface3(flat.astype(np.float32), n.astype(np.float32), triangles[area > 1e-12].astype(np.int32))


def _around(axis: F64) -> tuple[F64, F64]:
    """Two directions that make a right-handed frame (u, v, axis)."""
    other = np.array((1.0, 0.0, 0.0)) if abs(axis[0]) < 0.8 else np.array((0.0, 1.0, 0.0))
    u = np.cross(axis, other)
    u /= np.linalg.norm(u)
    return u, np.cross(axis, u)


def _cone_sphere(a: F64, b: F64, ra: float, rb: float, segments: int, rings: int, along: int = 0) -> Surface3:
    """The hull of two balls: each surface normal belongs to the ball that reaches farther along it. along: rings between
    the balls."""
    length = float(np.linalg.norm(b - a))
    axis = (b - a) / length if length > 1e-9 else np.array((0.0, 0.0, 1.0))
    if length <= abs(ra - rb):
        centre, radius = (a, ra) if ra >= rb else (b, rb)
        a = b = centre
        ra = rb = radius
        split = 0.5 * math.pi
    else:
        split = math.acos((ra - rb) / length)  # angle from the axis of the normals of the cone
    angles = np.concatenate((np.linspace(math.pi, split, rings), np.full(along, split), np.linspace(split, 0.0, rings)))
    t = np.concatenate((np.zeros(rings), np.arange(1, along + 1) / (along + 1), np.ones(rings)))
    phi = np.linspace(0.0, 2.0 * math.pi, segments, endpoint=False)
    u, v = _around(axis)
    circle = np.cos(phi)[:, None] * u + np.sin(phi)[:, None] * v
    normals = np.sin(angles)[:, None, None] * circle[None] + (np.cos(angles)[:, None] * axis)[:, None]
    centres = (1.0 - t)[:, None] * a + t[:, None] * b
    radii = (1.0 - t) * ra + t * rb
    return _grid(centres[:, None] + radii[:, None, None] * normals, normals)


def _power(x: F64, e: float) -> F64:
    return np.sign(x) * np.abs(x) ** e


def _superquadric_angles(count: int, e: float, low: float, high: float) -> F64:
    """Angles from low to high, multiples of a right angle apart, dense where a small exponent puts its edges."""
    quarters = round((high - low) / (0.5 * math.pi))
    per = max(3, round(count / quarters))
    s = np.linspace(0.0, 1.0, per, endpoint=False)
    if e < 0.7:  # equal steps of tan^e: even along the surface instead of along the angle
        knots = np.linspace(0.0, 1.0, per // 2 + 1)
        half = np.arctan(np.maximum(knots, 0.0) ** (1.0 / e))
        s = np.concatenate((half, 0.5 * math.pi - half[-2:0:-1])) / (0.5 * math.pi)
    quarter = np.concatenate([s + k for k in range(quarters)])
    return low + 0.5 * math.pi * np.append(quarter, quarters)


def _superellipsoid(a: Sequence[float], e1: float, e2: float, segments: int, rings: int) -> Surface3:
    eta = _superquadric_angles(2 * rings, e1, -0.5 * math.pi, 0.5 * math.pi)[:, None]
    omega = _superquadric_angles(segments, e2, -math.pi, math.pi)[None, :-1]
    ce, se, co, so = np.cos(eta), np.sin(eta), np.cos(omega), np.sin(omega)
    ce[0] = ce[-1] = 0.0
    x = a[0] * _power(ce, e1) * _power(co, e2)
    y = a[1] * _power(ce, e1) * _power(so, e2)
    z = np.broadcast_to(a[2] * _power(se, e1), x.shape)
    nx = _power(ce, 2 - e1) * _power(co, 2 - e2) / a[0]
    ny = _power(ce, 2 - e1) * _power(so, 2 - e2) / a[1]
    nz = np.broadcast_to(_power(se, 2 - e1) / a[2], x.shape)
    return _grid(np.stack((x, y, z), -1), np.stack((nx, ny, nz), -1))


def _supertoroid(a: Sequence[float], alpha: float, e1: float, e2: float, segments: int, rings: int) -> Surface3:
    eta = np.linspace(-math.pi, math.pi, rings, endpoint=False)[:, None]
    omega = np.linspace(-math.pi, math.pi, segments, endpoint=False)[None, :]
    ce, se, co, so = np.cos(eta), np.sin(eta), np.cos(omega), np.sin(omega)
    ring = alpha + _power(ce, e1)
    x, y = a[0] * ring * _power(co, e2), a[1] * ring * _power(so, e2)
    z = np.broadcast_to(a[2] * _power(se, e1), x.shape)
    nx = _power(ce, 2 - e1) * _power(co, 2 - e2) / a[0]
    ny = _power(ce, 2 - e1) * _power(so, 2 - e2) / a[1]
    nz = np.broadcast_to(_power(se, 2 - e1) / a[2], x.shape)
    return _grid(np.stack((x, y, z), -1), np.stack((nx, ny, nz), -1), wrap_rows=True)


_CORNER_STEP = math.radians(23.0)
"""About how much a rounded corner turns from one column of vertices to the next."""


def _rounded_polygon(r: float, corners: F64, rings: int) -> Surface3:
    """All points within `r` of a planar convex polygon: every outward normal belongs to one of its corners."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.linalg.norm(normal)
    edges = np.roll(corners, -1, axis=0) - corners
    out = np.cross(edges, normal)
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    before = np.roll(out, 1, axis=0)
    owners: list[F64] = []
    directions: list[F64] = []
    for corner, n0, n1 in zip(corners, before, out, strict=True):
        turn = math.acos(float(np.clip(n0 @ n1, -1.0, 1.0)))
        for s in np.linspace(0.0, 1.0, 2 + int(turn / _CORNER_STEP)):
            d = n0 * (1.0 - s) + n1 * s
            owners.append(corner)
            directions.append(d / np.linalg.norm(d))
    elevation = np.linspace(-0.5 * math.pi, 0.5 * math.pi, max(5, rings))
    normals = np.cos(elevation)[:, None, None] * np.array(directions)[None] + np.sin(elevation)[:, None, None] * normal
    rim = _grid(np.array(owners)[None] + r * normals, normals)
    parts = [rim]
    count, centre = len(corners), corners.mean(axis=0)
    for sign in (-1.0, 1.0):
        ring = np.arange(count)
        fan = np.stack((np.full(count, count), ring, (ring + 1) % count), axis=1)
        points = np.vstack((corners, centre)) + sign * r * normal
        face = Surface3(
            points.astype(np.float32),
            np.tile((sign * normal).astype(np.float32), (count + 1, 1)),
            (fan if sign > 0 else fan[:, ::-1]).astype(np.int32),
        )
        parts.append(face)
    return join(parts)
