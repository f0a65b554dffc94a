"""Cutting cloth from a body: the part of its skin where a field is positive, cut exactly along the line where it is zero."""

from collections.abc import Callable, Sequence

import numpy as np

from vistel.arrays import F32, F64, I32, Bool
from vistel.figure.avatar.avatar import Mesh
from vistel.figure.clothes.cloth import dense

Field = Callable[[F64], F64]
"""How far points (N, 3) lie inside a border [m], negative beyond it."""
_SNAP = 0.45
"""A vertex that is nearer to the line than this share of an edge is moved onto it, so that no slivers arise."""
_ROUND = 16
"""Vertices that a rim has, about, if it would have fewer."""


class Cutting:
    """Part of a body's skin. points, normals: (V, 3); triangles: (F, 3); weight: (V, BONES); limb: (V,); source: (V,) the nearest
    vertex of the body; rims: its borders, as `loops` gives them."""

    def __init__(self, mesh: Mesh, normals: F64, chosen: Bool, field: Field, seams: Sequence[Field] = ()) -> None:
        """chosen: (V,) vertices of the mesh that cloth may cover at all. seams: edges are laid along where these are zero."""
        points = mesh.vertices.astype(np.float64)
        value = np.where(chosen, field(points), -1.0)
        triangles = mesh.triangles[chosen[mesh.triangles].all(axis=1)]
        assert mesh.bone is not None and mesh.weight is not None, "a body has bones"
        near = _near(triangles, value) & chosen
        points[near] = _moved(points[near], field)
        value[near] = 0.0
        triangles = triangles[(value[triangles] > 0.0).any(axis=1)]
        free = chosen & ~near
        for seam in seams:
            row = np.flatnonzero(free & _near(triangles, seam(points)))
            points[row] = _moved(points[row], seam)
            free[row] = False
        self._split(points, normals, value, dense(mesh.bone, mesh.weight), mesh.limb, triangles)
        self._refine_rims()
        self.rims = loops(self.triangles)

    def _split(self, points: F64, normals: F64, value: F64, weight: F32, limb: I32, triangles: I32) -> None:
        edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        crossed = np.unique(edges[(value[edges].min(axis=1) < 0.0) & (value[edges].max(axis=1) > 0.0)], axis=0)
        a, b = crossed.T
        t = (value[a] / (value[a] - value[b]))[:, None] if len(crossed) else np.zeros((0, 1))
        number = {(int(i), int(j)): len(points) + k for k, (i, j) in enumerate(crossed)}
        points = np.vstack([points, points[a] + t * (points[b] - points[a])])
        normals = np.vstack([normals, normals[a] + t * (normals[b] - normals[a])])
        weight = np.vstack([weight, (1.0 - t) * weight[a] + t * weight[b]]).astype(np.float32)
        limb = np.concatenate([limb, np.where(value[a] > value[b], limb[a], limb[b])])
        sign = np.sign(value)
        whole = (sign[triangles] >= 0).all(axis=1)
        out = [tuple(row) for row in triangles[whole].tolist()]
        for row in triangles[~whole].tolist():
            corners: list[int] = []
            for k in range(3):
                i, j = row[k], row[(k + 1) % 3]
                if sign[i] >= 0:
                    corners.append(i)
                if sign[i] * sign[j] < 0:
                    corners.append(number[min(i, j), max(i, j)])
            out += [(corners[0], corners[k], corners[k + 1]) for k in range(1, len(corners) - 1)]
        made = _unpinched(np.array(out, np.int32).reshape(-1, 3))
        used = np.unique(made)
        place = np.full(len(points), -1, np.int32)
        place[used] = np.arange(len(used), dtype=np.int32)
        self.points, self.triangles = points[used], place[made]
        self.normals = normals[used] / np.maximum(np.linalg.norm(normals[used], axis=1, keepdims=True), 1e-12)
        self.weight, self.limb = weight[used], limb[used]
        nearer: I32 = crossed[np.arange(len(crossed)), (value[b] > value[a]).astype(np.int64)]
        self.source = np.concatenate([np.arange(len(value), dtype=np.int32), nearer])[used]

    def _refine_rims(self) -> None:
        """Put more vertices into rims that have few: arms and legs have so few round them that cuffs would have corners."""
        p, triangles = self.points, self.triangles.tolist()
        of = {(t[k], t[(k + 1) % 3]): n for n, t in enumerate(triangles) for k in range(3)}
        pairs: list[tuple[int, int, float]] = []
        for ring in loops(self.triangles):
            way: F64 = np.linalg.norm(p[np.roll(ring, -1)] - p[ring], axis=1)
            parts = np.maximum(1.0, np.rint(way * (_ROUND / float(way.sum())))).astype(np.int64)
            for start, end, count in zip(ring.tolist(), np.roll(ring, -1).tolist(), parts.tolist(), strict=True):
                n = of[start, end]
                apex = next(v for v in triangles[n] if v not in (start, end))
                first = len(p) + len(pairs)
                chain = [start, *range(first, first + count - 1), end]
                pairs += [(start, end, (k + 1) / count) for k in range(count - 1)]
                triangles[n] = [start, chain[1], apex]
                for k in range(1, count):
                    of[end, apex] = len(triangles)
                    triangles.append([chain[k], chain[k + 1], apex])
        if not pairs:
            return
        ends = np.array([pair[:2] for pair in pairs], np.int32)
        a, b = ends[:, 0], ends[:, 1]
        t = np.array([pair[2] for pair in pairs])[:, None]
        self.points = np.vstack([p, (1.0 - t) * p[a] + t * p[b]])
        normal = np.vstack([self.normals, (1.0 - t) * self.normals[a] + t * self.normals[b]])
        self.normals = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        self.weight = np.vstack([self.weight, (1.0 - t) * self.weight[a] + t * self.weight[b]]).astype(np.float32)
        nearer = np.where(t[:, 0] < 0.5, a, b)
        self.limb, self.source = (np.concatenate([old, old[nearer]]) for old in (self.limb, self.source))
        self.triangles = np.array(triangles, np.int32)


def _near(triangles: I32, value: F64) -> Bool:
    """(V,) vertices so near to where (V,) values are zero that a piece of an edge would be short."""
    out = np.zeros(len(value), np.bool_)
    for k in range(3):
        for i, j in ((triangles[:, k], triangles[:, k - 1]), (triangles[:, k - 1], triangles[:, k])):
            share = np.abs(value[i]) / np.maximum(np.abs(value[i] - value[j]), 1e-12)
            out[i[(value[i] * value[j] < 0.0) & (share < _SNAP)]] = True
    return out


def _moved(points: F64, field: Field) -> F64:
    """Points moved to where a field is zero, down its slope."""
    for _ in range(2):
        at, step = field(points), 1e-4
        slope = np.stack([(field(points + step * e) - at) / step for e in np.eye(3)], axis=1)
        points = points - (at / np.maximum((slope * slope).sum(axis=1), 0.05))[:, None] * slope
    return points


def _open(triangles: I32) -> Bool:
    """(F, 3) whether the edge from corner k to k + 1 of a triangle has nothing on its other side."""
    start, end = triangles.astype(np.int64), np.roll(triangles, -1, axis=1).astype(np.int64)
    return ~np.isin(start << 32 | end, end << 32 | start)


def _unpinched(triangles: I32) -> I32:
    """Without triangles that hang on others by a vertex, where a border would cross itself."""
    while len(triangles):
        edge = _open(triangles)
        leaving = np.bincount(triangles[edge], minlength=int(triangles.max()) + 1)
        gone = (leaving[triangles] > 1).any(axis=1) & (edge.sum(axis=1) > 1)
        if not gone.any():
            break
        triangles = triangles[~gone]
    return triangles


def loops(triangles: I32) -> list[I32]:
    """The borders of a mesh, each a closed ring of vertices, the mesh on its left seen from outside."""
    edge = _open(triangles)
    ends = np.column_stack([triangles[edge], np.roll(triangles, -1, axis=1)[edge]])
    following: dict[int, int] = dict(ends.tolist())
    out: list[I32] = []
    # Of less than a triangle's length there is none, but where triangles meet in one vertex.
    while following:
        start = min(following)
        ring = [start]
        at = following.pop(start)
        while at != start and at in following:
            ring.append(at)
            at = following.pop(at)
        if len(ring) > 2:
            out.append(np.array(ring, np.int32))
    return out
