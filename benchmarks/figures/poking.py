"""Skin, and cloth under cloth, that comes through what covers it."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32, F64, I32, Bool
from vistel.figure.avatar.avatar import Avatar, clothes, flesh
from vistel.figure.body import pose_body
from vistel.figure.figure import vertex_normals
from vistel.figure.posture.posture import rest_pose
from vistel.geometry.normals import vertex_normals as normals_of
from vistel.jit.kernel_jit import compiled

_OVER = 0.06
"""How far above a place what covers it lies, at most [m]."""
_UNDER = 0.015
"""How far a place that came through stands out of its cover, at most [m]: farther out it has slipped from under a border."""

_LIES = 0.005
"""How near the cloth is on which a place lies [m]."""


@dataclass(frozen=True, eq=False)
class Covered:
    """Vertices of an avatar that lie under a garment at rest, or stand out of one that they should lie under.

    vertex: (N,); own, under: (N,) the garment that it is of, -1 skin, and the one that is over it, by `clothes`; area: (N,) of
    surface that each stands for [m^2]; triangles, garment: (F, 3) and (F,) of all cloth; mesh: (M, 3) all triangles."""

    vertex: I32
    own: I32
    under: I32
    area: F64
    triangles: I32
    garment: I32
    mesh: I32

    @property
    def skin(self) -> Bool:
        """(N,) whether a vertex is of the skin."""
        return self.own < 0

    @staticmethod
    def of(avatar: Avatar) -> "Covered":
        """What of a dressed avatar is to be watched, on its finest level."""
        mesh, worn, out = avatar.mesh, clothes(avatar), _outwards(avatar)
        n, on = vertex_normals(mesh).astype(np.float64), mesh.vertices.astype(np.float64)
        # What is folded in at a hem or a collar faces the body and covers nothing.
        outside = (n * out).sum(axis=1) > 0.0
        of_triangle = worn[mesh.triangles].max(axis=1)
        cloth = (of_triangle >= 0) & outside[mesh.triangles].all(axis=1)
        inner = np.flatnonzero(flesh(avatar) & outside).astype(np.int32)
        of, n = worn[inner], n[inner]
        triangles, garment = np.ascontiguousarray(mesh.triangles[cloth]), np.ascontiguousarray(of_triangle[cloth])

        def met(way: F64, reach: float, outwards: bool) -> I32:
            any_ = np.full(len(inner), -1, np.int32)
            return _first(on[inner], way, any_, of.astype(np.int32), on, triangles, garment, reach, outwards)[0]

        over, below = met(n, _OVER, True), met(-n, _UNDER, False)
        # Of two garments the outer one is that which covers more of the other.
        counts = np.zeros((worn.max() + 2, worn.max() + 1), np.int64)
        np.add.at(counts, (of[over >= 0] + 1, over[over >= 0]), 1)
        more = np.ones_like(counts, np.bool_)
        more[1:] = counts[1:] > counts[1:].T
        under = np.where((below >= 0) & more[of + 1, below], below, -1)
        under = np.where((over >= 0) & more[of + 1, over], over, under)
        kept = under >= 0
        corner = on[mesh.triangles]
        each = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1) / 6.0
        area = np.bincount(mesh.triangles.reshape(-1), np.repeat(each, 3), len(on))[inner[kept]]
        return Covered(
            inner[kept], of[kept].astype(np.int32), under[kept].astype(np.int32), area, triangles, garment, mesh.triangles
        )

    def through(self, vertices: F32) -> F64:
        """(N,) how far each vertex stands out of its cover in a posture (V, 3) [m]; 0 where it does not, or where nobody sees it:
        other cloth is over it, or it lies on some."""
        on = vertices.astype(np.float64)
        p, n = on[self.vertex], normals_of(on, self.mesh)[self.vertex]
        free = np.full(len(p), -1, np.int32)
        over, _ = _first(p, n, free, self.own, on, self.triangles, self.garment, _OVER, True)
        _, out = _first(p, -n, self.under, free, on, self.triangles, self.garment, _UNDER, False)
        lies, _ = _first(p, n, free, free, on, self.triangles, self.garment, _LIES, False)
        return np.where((over < 0) & (lies < 0) & np.isfinite(out), out, 0.0)


def _outwards(avatar: Avatar) -> F64:
    """(V, 3) from the axis of the primitive that each vertex belongs to, at rest [m]."""
    posed, mesh = pose_body(avatar.body, rest_pose(avatar.skeleton)), avatar.mesh
    p, a = mesh.vertices.astype(np.float64), posed.a[mesh.limb]
    along = posed.b[mesh.limb] - a
    share = np.clip(((p - a) * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-12), 0.0, 1.0)
    return p - a - share[:, None] * along


@compiled
def _first(p, way, only, never, on, triangles, garment, reach, outwards):
    """Of rays from p (N, 3) along `way` (N, 3, unit): (N,) the garment first met within `reach`, -1 none, and how far. only, never:
    (N,) garments, -1 any and none. on: (V, 3). outwards: whether rays leave through a triangle's face, or come in through it."""
    found, far = np.full(len(p), -1, np.int32), np.full(len(p), np.inf)
    middle, size = np.empty((len(triangles), 3)), np.empty(len(triangles))
    for f in range(len(triangles)):
        a, b, c = on[triangles[f, 0]], on[triangles[f, 1]], on[triangles[f, 2]]
        middle[f] = (a + b + c) / 3.0
        size[f] = np.sqrt(max(((a - middle[f]) ** 2).sum(), ((b - middle[f]) ** 2).sum(), ((c - middle[f]) ** 2).sum()))
    for k in range(len(p)):
        x, y, z = p[k]
        for f in range(len(triangles)):
            if garment[f] == never[k] or (only[k] >= 0 and garment[f] != only[k]):
                continue
            room = reach + size[f]
            if abs(middle[f, 0] - x) > room or abs(middle[f, 1] - y) > room or abs(middle[f, 2] - z) > room:
                continue
            t = _met(p[k], way[k], on[triangles[f, 0]], on[triangles[f, 1]], on[triangles[f, 2]], outwards)
            if 0.0 <= t < min(reach, far[k]):
                found[k], far[k] = garment[f], t
    return found, far


@compiled
def _met(p, d, a, b, c, outwards):
    """How far along a ray a triangle is that faces as asked, -1 where it is missed (Moeller and Trumbore 1997)."""
    u, v, w = b - a, c - a, p - a
    nx, ny, nz = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    facing = nx * d[0] + ny * d[1] + nz * d[2]
    if facing <= 0.0 if outwards else facing >= 0.0:
        return -1.0
    qx, qy, qz = w[1] * d[2] - w[2] * d[1], w[2] * d[0] - w[0] * d[2], w[0] * d[1] - w[1] * d[0]
    s = -(v[0] * qx + v[1] * qy + v[2] * qz) / facing
    t = (u[0] * qx + u[1] * qy + u[2] * qz) / facing
    if s < 0.0 or t < 0.0 or s + t > 1.0:
        return -1.0
    return -(nx * w[0] + ny * w[1] + nz * w[2]) / facing
