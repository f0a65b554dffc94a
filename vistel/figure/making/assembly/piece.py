"""A piece of a person's surface: triangles with texture coordinates at their corners, to be cut, closed and joined."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from vistel.arrays import F64, I64

Mask = NDArray[np.bool_]

SNAP = 0.05
"""A cut goes through a vertex that it passes by less than this share of the shortest edge there."""
NEAREST = 40
"""Triangles with the nearest middles among which the closest one is looked for."""


@dataclass(frozen=True)
class MeshPiece:
    """points: (V, 3) [m]; triangles: (F, 3), counter-clockwise seen from outside; uv: (F, 3, 2) texture coordinates at the
    corners, NaN where a face has none; material: (F,); part: (F,) what a face came from, -1 for what was made."""

    points: F64
    triangles: I64
    uv: F64
    material: I64
    part: I64

    def of_faces(self, keep: Mask) -> "MeshPiece":
        """These faces only; points stay."""
        return replace(self, triangles=self.triangles[keep], uv=self.uv[keep], material=self.material[keep], part=self.part[keep])

    def moved(self, matrix: F64) -> "MeshPiece":
        """Under an affine map (3, 4)."""
        return replace(self, points=self.points @ matrix[:, :3].T + matrix[:, 3])


def joined(pieces: Sequence[MeshPiece], within: float) -> MeshPiece:
    """One piece; vertices no further than `within` metres apart become one. Faces that vanish are dropped."""
    first = np.cumsum([0, *(len(p.points) for p in pieces)])
    points = np.concatenate([p.points for p in pieces])
    triangles = np.concatenate([p.triangles + n for p, n in zip(pieces, first[:-1], strict=True)])
    used = np.unique(triangles)
    pairs = KDTree(points[used]).query_pairs(within, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(used), len(used)))
    label = connected_components(graph, directed=False)[1]
    _, one = np.unique(label, return_index=True)
    to = np.zeros(len(points), np.int64)
    to[used] = label
    triangles = to[triangles]
    keep = (triangles != np.roll(triangles, -1, axis=1)).all(axis=1)
    whole = MeshPiece(
        points[used[one]],
        triangles,
        np.concatenate([p.uv for p in pieces]),
        np.concatenate([p.material for p in pieces]),
        np.concatenate([p.part for p in pieces]),
    )
    return whole.of_faces(keep)


def loops(triangles: I64) -> list[I64]:
    """Borders as vertex numbers, in the order in which a face beyond them would run; one after the other where several
    meet in a vertex."""
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    count = int(triangles.max(initial=0)) + 1
    open_edge = ~np.isin(start * count + end, end * count + start)
    follows: dict[int, list[int]] = {}
    for a, b in zip(end[open_edge].tolist(), start[open_edge].tolist(), strict=True):
        follows.setdefault(a, []).append(b)
    found: list[I64] = []
    while follows:
        at = first = next(iter(follows))
        loop: list[int] = []
        while at in follows:
            loop.append(at)
            nexts = follows[at]
            after = nexts.pop()
            if not nexts:
                del follows[at]
            at = after
            if at == first and at not in follows:
                break
        found.append(np.array(loop, np.int64))
    return found


def cut(piece: MeshPiece, level: F64) -> tuple[MeshPiece, F64]:
    """The piece with new vertices where `level` (V,) is zero along its edges, so that no face has both signs; and the
    level of all vertices, exactly zero on the cut."""
    tri = piece.triangles
    level = _snapped(piece, level)
    sign = np.sign(level)[tri]
    mixed = (sign > 0).any(axis=1) & (sign < 0).any(axis=1)
    if not mixed.any():
        return piece, level
    made: dict[tuple[int, int], int] = {}
    points: list[F64] = []
    levels: list[float] = []
    faces: list[list[int]] = []
    uvs: list[list[F64]] = []
    source: list[int] = []
    count = len(piece.points)

    def crossing(a: int, b: int) -> tuple[int, float]:
        low, high = min(a, b), max(a, b)
        share = level[low] / (level[low] - level[high])
        if (low, high) not in made:
            made[low, high] = count + len(points)
            points.append(piece.points[low] + share * (piece.points[high] - piece.points[low]))
            levels.append(0.0)
        return made[low, high], float(share if a == low else 1.0 - share)

    for f in np.flatnonzero(mixed).tolist():
        ring: list[tuple[int, F64, int]] = []
        for k in range(3):
            a, b = int(tri[f, k]), int(tri[f, (k + 1) % 3])
            ua, ub = piece.uv[f, k], piece.uv[f, (k + 1) % 3]
            ring.append((a, ua, int(sign[f, k])))
            if sign[f, k] * sign[f, (k + 1) % 3] < 0:
                v, share = crossing(a, b)
                ring.append((v, ua + share * (ub - ua), 0))
        for side in (1, -1):
            polygon = [(v, u) for v, u, s in ring if s in (0, side)]
            for k in range(1, len(polygon) - 1):
                corner = (polygon[0], polygon[k], polygon[k + 1])
                faces.append([v for v, _ in corner])
                uvs.append([u for _, u in corner])
                source.append(f)
    keep = ~mixed
    whole = MeshPiece(
        np.concatenate([piece.points, np.array(points).reshape(-1, 3)]),
        np.concatenate([tri[keep], np.array(faces, np.int64).reshape(-1, 3)]),
        np.concatenate([piece.uv[keep], np.array(uvs).reshape(-1, 3, 2)]),
        np.concatenate([piece.material[keep], piece.material[source]]),
        np.concatenate([piece.part[keep], piece.part[source]]),
    )
    return whole, np.concatenate([level, levels])


def _snapped(piece: MeshPiece, level: F64) -> F64:
    """Levels near zero, compared with those across the edges, made zero."""
    a, b = piece.triangles.reshape(-1), np.roll(piece.triangles, -1, axis=1).reshape(-1)
    least = np.full(len(level), np.inf)
    change = np.abs(level[a] - level[b])
    crossing = level[a] * level[b] < 0
    np.minimum.at(least, a[crossing], change[crossing])
    np.minimum.at(least, b[crossing], change[crossing])
    return np.where(np.abs(level) < SNAP * np.where(np.isfinite(least), least, 0.0), 0.0, level)


def connected(triangles: I64, seeds: I64) -> Mask:
    """(F,) faces that are connected with the vertices `seeds` by shared vertices."""
    count = int(triangles.max(initial=0)) + 1
    a, b = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    return np.isin(label[triangles[:, 0]], label[seeds])


def closed(piece: MeshPiece, loop: I64, part: int | None = None) -> MeshPiece:
    """With a fan over a border; its colour is that of the border, its part too where none is given."""
    centre = len(piece.points)
    ring, after = loop, np.roll(loop, -1)
    new = np.stack([ring, after, np.full(len(ring), centre)], axis=1)
    uv_of, material_of, part_of = at_vertices(piece)
    middle = uv_of[ring[0]]
    uv = np.stack([uv_of[ring], uv_of[after], np.broadcast_to(middle, (len(ring), 2))], axis=1)
    jumps = np.abs(uv - middle).max(axis=(1, 2)) > 0.25  # over a seam of the texture: one place of it
    uv[jumps] = uv[jumps, :1]
    return MeshPiece(
        np.concatenate([piece.points, piece.points[loop].mean(axis=0)[None]]),
        np.concatenate([piece.triangles, new]),
        np.concatenate([piece.uv, uv]),
        np.concatenate([piece.material, material_of[ring]]),
        np.concatenate([piece.part, part_of[ring] if part is None else np.full(len(ring), part)]),
    )


def at_vertices(piece: MeshPiece) -> tuple[F64, I64, I64]:
    """Texture coordinates, material and part at each vertex, of one of the faces there."""
    uv, material = np.full((len(piece.points), 2), np.nan), np.zeros(len(piece.points), np.int64)
    part = np.zeros(len(piece.points), np.int64)
    for k in range(3):
        uv[piece.triangles[:, k]] = piece.uv[:, k]
        material[piece.triangles[:, k]], part[piece.triangles[:, k]] = piece.material, piece.part
    return uv, material, part


def closest(points: F64, corners: F64, among: int = NEAREST) -> tuple[I64, F64, F64]:
    """For points (N, 3) the nearest of triangles (F, 3, 3), of the `among` with the nearest middles: its row, barycentric
    coordinates (N, 3) there, distance (N,)."""
    count = min(among, len(corners))
    near = KDTree(corners.mean(axis=1)).query(points, count)[1].reshape(len(points), count)
    best = np.full(len(points), np.inf)
    row, share = np.zeros(len(points), np.int64), np.zeros((len(points), 3))
    for k in range(count):
        t = near[:, k]
        b = _barycentric(points, corners[t])
        d = np.linalg.norm(np.einsum("nk,nkc->nc", b, corners[t]) - points, axis=1)
        better = d < best
        best[better], row[better], share[better] = d[better], t[better], b[better]
    return row, share, best


def _barycentric(p: F64, corner: F64) -> F64:
    """(N, 3) coordinates of the place of each triangle (N, 3, 3) that is nearest to its point."""
    a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]
    ab, ac, ap = b - a, c - a, p - a
    d00, d01, d11 = (np.einsum("ni,ni->n", x, y) for x, y in ((ab, ab), (ab, ac), (ac, ac)))
    d20, d21 = np.einsum("ni,ni->n", ap, ab), np.einsum("ni,ni->n", ap, ac)
    area = np.maximum(d00 * d11 - d01 * d01, 1e-300)
    v, w = (d11 * d20 - d01 * d21) / area, (d00 * d21 - d01 * d20) / area
    inside = np.stack([1.0 - v - w, v, w], axis=1)
    best, distance = np.full((len(p), 3), np.nan), np.full(len(p), np.inf)
    ok = (inside >= 0.0).all(axis=1)
    best[ok], distance[ok] = inside[ok], 0.0
    for i, j in ((0, 1), (1, 2), (2, 0)):
        start, along = corner[:, i], corner[:, j] - corner[:, i]
        t = np.clip(np.einsum("ni,ni->n", p - start, along) / np.maximum(np.einsum("ni,ni->n", along, along), 1e-300), 0.0, 1.0)
        d = np.linalg.norm(start + t[:, None] * along - p, axis=1)
        nearer = ~ok & (d < distance)
        place = np.zeros((len(p), 3))
        place[:, i], place[:, j] = 1.0 - t, t
        best[nearer], distance[nearer] = place[nearer], d[nearer]
    return best
