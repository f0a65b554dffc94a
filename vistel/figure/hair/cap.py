"""The cap: the skin inside the hairline, lifted, over which cards lie; and thin shells over it."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64, I32
from vistel.figure.avatar.avatar import Mesh
from vistel.figure.figure import vertex_normals
from vistel.figure.hair.cards import Strips
from vistel.figure.hair.scalp import Scalp
from vistel.geometry.smoothstep import smooth

EDGE = 0.05
"""How far a cap reaches beyond the hairline, as a share of the head's size."""
DEEP = 1.45
"""Farthest place inside the hairline, likewise."""
FINER = 0.6
"""Power that gives the hairline more texels than the top of the head."""


@dataclass(frozen=True)
class Cap:
    """How high it is over the skin, well inside the hairline, for a head of size 0.095 m: thick everywhere, crown more on top of
    the head, lumps more or less from place to place [m]."""

    thick: float
    crown: float = 0.0
    lumps: float = 0.0

    def height(self, scalp: Scalp, p: F64, inside: F64) -> F64:
        """(N,) over places (N, 3) of the skin or above it, which are `inside` (N,) [m] from the hairline [m]."""
        d = p - scalp.middle
        d /= np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-9)
        edge, far = (smooth(inside / (share * scalp.size)) for share in (0.35, 0.8))
        return (
            scalp.size / 0.095 * (self.thick * edge + far * (self.crown * smooth((d[:, 1] - 0.25) / 0.55) + self.lumps * _lumpy(d)))
        )


@dataclass(frozen=True, eq=False)
class Ground:
    """The skin inside the hairline, of a level of detail. points, normal: (V, 3); triangles: (F, 3)."""

    points: F64
    normal: F64
    triangles: I32

    def finer(self) -> "Ground":
        """With four triangles for each, rounded (Boubekeur and Alexa 2008)."""
        tri = self.triangles
        edges = np.sort(np.concatenate([tri[:, [0, 1]], tri[:, [1, 2]], tri[:, [2, 0]]]), axis=1)
        edge, at = np.unique(edges, axis=0, return_inverse=True)
        a, b = edge.T
        middle, normal = 0.5 * (self.points[a] + self.points[b]), self.normal[a] + self.normal[b]
        on = [(np.einsum("ei,ei->e", self.points[k] - middle, self.normal[k]))[:, None] * self.normal[k] for k in (a, b)]
        middle += 0.75 * 0.5 * (on[0] + on[1])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        i, j, k = (len(self.points) + at.reshape(3, -1)).astype(np.int32)
        p, q, r = tri.T
        four = np.concatenate([np.stack(t, axis=1) for t in ((p, i, k), (i, q, j), (k, j, r), (i, j, k))])
        return Ground(np.concatenate([self.points, middle]), np.concatenate([self.normal, normal]), four.astype(np.int32))


def ground(scalp: Scalp, body: Mesh) -> Ground:
    """Of a level of the body."""
    points, normals, triangles = body.vertices.astype(np.float64), vertex_normals(body).astype(np.float64), body.triangles
    head = points[:, 1] > scalp.middle[1] - 1.4 * scalp.size
    inside = np.full(len(points), -1.0)
    inside[head] = scalp.inside(points[head])
    d = points - scalp.middle
    ear = np.einsum("vi,vi->v", d, normals) < 0.35 * np.linalg.norm(d, axis=1)
    tri = triangles[(inside[triangles] > -EDGE * scalp.size).any(axis=1) & ~ear[triangles].any(axis=1)]
    used = np.unique(tri)
    place = np.full(len(points), -1, np.int32)
    place[used] = np.arange(len(used), dtype=np.int32)
    return Ground(points[used], normals[used], place[tri])


def cap(scalp: Scalp, skin: Ground, high: Cap, box: F64) -> Strips:
    """The skin inside the hairline, lifted. In its box of the picture v grows from the hairline, u round the whorl, alike on both
    sides."""
    h = scalp.inside(skin.points)
    d = skin.points - scalp.middle
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    p = skin.points + (0.0007 + high.height(scalp, skin.points, h))[:, None] * skin.normal
    # The polar angle about the whorl: no seam, as both sides have the same.
    ahead = np.array((0.0, 0.0, 1.0)) - scalp.whorl[2] * scalp.whorl
    ahead /= np.linalg.norm(ahead)
    angle = np.abs(np.arctan2(d @ np.cross(scalp.whorl, ahead), d @ ahead)) / np.pi
    v = np.clip((h / scalp.size + EDGE) / (DEEP + EDGE), 0.0, 1.0) ** FINER
    uv = box[:2] + np.column_stack([angle, v]) * (box[2:] - box[:2])
    return Strips(p, uv, skin.triangles)


def _lumpy(d: F64) -> F64:
    """(N,) about 0, at most 1: waves over directions (N, 3), the same for all levels of detail."""
    waves = ((7.1, 2.3, -4.4, 0.3), (-3.7, 8.9, 2.6, 1.9), (4.8, -5.2, 7.7, 4.1), (10.9, 6.1, 3.2, 2.7))
    return np.mean([np.sin(d @ w[:3] + w[3]) for w in waves], axis=0)
