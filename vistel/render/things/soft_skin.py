"""What of a soft thing is drawn, fine enough to be dented, and the limbs in it that its vertices are embedded in (Singh §2.3)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.deformation.ghost_source import MOST_PRIMITIVES
from vistel.implicit.meshes.embedding import Limbs
from vistel.space.files.model import Polymesh
from vistel.space.files.surfaces import SurfacePiece, pieces_of, rgb
from vistel.space.things.tessellate import Surface3, fine_cone_sphere, finer
from vistel.space.things.things import Thing, ThingPrimitive

SPACING = 0.0028
"""Between vertices, at least, where a dent is as wide as a finger [m]."""
MOST_TRIANGLES = 24_000
"""Made of a thing for the sake of its dents; it may have more of its own."""
ACROSS = 7
"""Limbs side by side in a flat primitive, at most."""


@dataclass(frozen=True, eq=False)
class SoftSkin:
    """pieces: as they are drawn; surface: all of them as one, in the thing's frame, vertices at one place made one; back: for
    every piece the vertex of `surface` that each of its own is."""

    pieces: tuple[SurfacePiece, ...]
    surface: Surface3
    back: tuple[I64, ...]


def skin_of(thing: Thing, models: Mapping[str, Polymesh]) -> SoftSkin:
    """What is drawn of it. models: what its looks need; without them its primitives stand in."""
    p = thing.primitives[0]
    if len(thing.primitives) == 1 and not thing.looks and not thing.curve and p.kind in ("sphere", "cone_sphere"):
        q = (0.0,) * 6 + (p.params[0],) * 2 if p.kind == "sphere" else p.params
        spacing = max(SPACING, max(q[6:8]) / 24.0)
        one = fine_cone_sphere(q, spacing).moved(p.position, p.rotation)
        return _welded([SurfacePiece(one, rgb(p.colour or thing.colour))])
    coarse = pieces_of(thing, models, 1.0)
    area = sum(_area(piece.surface) for piece in coarse)
    edge = max(SPACING, 1.5 * math.sqrt(area / (0.433 * MOST_TRIANGLES)))
    return _welded([_finer(piece, edge) for piece in coarse])


def limbs_in(primitives: Sequence[ThingPrimitive]) -> Limbs:
    """Cone-spheres that fill primitives, all one limb."""
    rows = [row for p in primitives for row in _inside(p)]
    if len(rows) > MOST_PRIMITIVES:  # the thinnest tell least of the shape
        rows = sorted(rows, key=lambda row: -row[2])[:MOST_PRIMITIVES]
    a, b = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    return Limbs(a, b, np.array([row[2] for row in rows]), np.array([row[3] for row in rows]), np.zeros(len(rows), np.int32))


def nearest_limb(vertices: NDArray[np.floating], limbs: Limbs) -> NDArray[np.int32]:
    """(V,) the limb whose surface is nearest to each vertex."""
    best, least = np.zeros(len(vertices), np.int32), np.full(len(vertices), np.inf)
    for n, (a, b, ra, rb) in enumerate(zip(limbs.a, limbs.b, limbs.radius_a, limbs.radius_b, strict=True)):
        along = b - a
        size = float(along @ along)
        s = np.clip((vertices - a) @ along / size, 0.0, 1.0) if size > 1e-12 else np.zeros(len(vertices))
        ratio = np.linalg.norm(vertices - a - s[:, None] * along, axis=1) / (ra + s * (rb - ra))
        closer = ratio < least
        best[closer], least[closer] = n, ratio[closer]
    return best


Row = tuple[F64, F64, float, float]


def _inside(p: ThingPrimitive) -> list[Row]:
    """Ends and radii of cone-spheres in one primitive, in the thing's frame."""
    q = p.params
    if p.kind == "sphere":
        rows: list[Row] = [(np.zeros(3), np.zeros(3), q[0], q[0])]
    elif p.kind == "cone_sphere":
        rows = [(np.array(q[0:3]), np.array(q[3:6]), q[6], q[7])]
    elif p.kind == "superellipsoid":
        rows = _in_box(np.array(q[:3]))
    elif p.kind == "supertoroid":
        ring, tube = q[3] * q[0], min(q[0], q[2])
        at = [ring * np.array([math.cos(t), math.sin(t), 0.0]) for t in np.linspace(0.0, 2.0 * math.pi, 13)]
        rows = [(a, b, tube, tube) for a, b in pairwise(at)]
    else:
        rows = _in_polygon(np.array(q[1:]).reshape(-1, 3), q[0])
    r = matrix_from_quaternion(p.rotation)
    return [(r @ a + p.position, r @ b + p.position, ra, rb) for a, b, ra, rb in rows]


def _in_box(half: F64) -> list[Row]:
    """Along the longest half axis, side by side over the middle one, as thick as the shortest."""
    thin, wide, long = np.argsort(half, kind="stable").tolist()
    radius = float(half[thin])
    room, reach = float(half[wide]) - radius, float(half[long]) - radius
    count = min(ACROSS, 1 + math.ceil(2.0 * room / (1.2 * radius))) if room > 0.1 * radius else 1
    rows: list[Row] = []
    for x in np.linspace(-room, room, count) if count > 1 else (0.0,):
        a, b = np.zeros(3), np.zeros(3)
        a[wide] = b[wide] = x
        a[long], b[long] = -reach, reach
        thick = max(radius, room / max(1, count - 1)) if count == ACROSS else radius
        rows.append((a, b, thick, thick))
    return rows


def _in_polygon(corners: F64, radius: float) -> list[Row]:
    """From its middle to its corners and along its edges."""
    middle = corners.mean(axis=0)
    rows: list[Row] = [(middle, corner, radius, radius) for corner in corners]
    return rows + [(a, b, radius, radius) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]


def _finer(piece: SurfacePiece, edge: float) -> SurfacePiece:
    s = piece.surface
    columns = [s.vertices, s.normals, *([piece.uv] if piece.uv is not None else [])]
    most = max(MOST_TRIANGLES, len(s.triangles))
    whole, triangles = finer(np.hstack(columns).astype(np.float64), s.triangles, edge, most)
    normals = whole[:, 3:6] / np.maximum(np.linalg.norm(whole[:, 3:6], axis=1, keepdims=True), 1e-12)
    surface = Surface3(whole[:, :3].astype(np.float32), normals.astype(np.float32), triangles)
    return replace(piece, surface=surface, uv=whole[:, 6:].astype(np.float32) if piece.uv is not None else None)


def _area(s: Surface3) -> float:
    corner = s.vertices[s.triangles].astype(np.float64)
    return 0.5 * float(np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1).sum())


def _welded(pieces: Sequence[SurfacePiece]) -> SoftSkin:
    """All pieces as one surface, so that nothing tears where they meet and normals are smooth where its ends close."""
    vertices = np.concatenate([p.surface.vertices for p in pieces])
    normals = np.concatenate([p.surface.normals for p in pieces]).astype(np.float64)
    starts = np.cumsum([0, *(len(p.surface.vertices) for p in pieces)])
    _, first, back = np.unique(np.round(vertices, 6), axis=0, return_index=True, return_inverse=True)
    back = back.reshape(-1)
    triangles = back[np.concatenate([p.surface.triangles + n for p, n in zip(pieces, starts, strict=False)])]
    a, b, c = triangles.T
    mean = np.stack([np.bincount(back, normals[:, k], len(first)) for k in range(3)], axis=1)
    size = np.linalg.norm(mean, axis=1, keepdims=True)
    mean = np.where(size > 1e-6, mean / np.maximum(size, 1e-6), normals[first])
    surface = Surface3(
        np.ascontiguousarray(vertices[first]),
        np.ascontiguousarray(mean, np.float32),
        np.ascontiguousarray(triangles[(a != b) & (b != c) & (c != a)], np.int32),
    )
    return SoftSkin(tuple(pieces), surface, tuple(back[a:b] for a, b in pairwise(starts)))
