"""Pieces of a figure's skin between two cross-sections, to be measured in any posture: volume and girth.

A cross-section is cut once, at rest, across a bone; its points stay where they are in the skin (a fixed share along a
mesh edge), so that a segment is the same piece of skin in every posture.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32, F64, I32
from vistel.figure.skeleton import JOINT_INDEX, Skeleton
from vistel.jit.kernel_jit import compiled

Cut = tuple[str, float]
"""A joint and a share of the length of its bone: where a cross-section lies, at right angles to the bone."""

SEGMENTS: dict[str, tuple[Cut, Cut]] = {
    "upper arm": (("upper_arm", 0.25), ("upper_arm", 1.0)),
    "forearm": (("lower_arm", 0.0), ("lower_arm", 1.0)),
    "thigh": (("upper_leg", 0.3), ("upper_leg", 1.0)),
    "shank": (("lower_leg", 0.0), ("lower_leg", 1.0)),
}
"""The limbs' segments from joint to joint; upper arm and thigh begin where they are clear of the trunk."""
JOINT_REGIONS: dict[str, tuple[Cut, Cut]] = {
    "elbow": (("upper_arm", 0.65), ("lower_arm", 0.35)),
    "knee": (("upper_leg", 0.7), ("lower_leg", 0.3)),
}
"""Skin on both sides of a joint that folds."""


@dataclass(frozen=True)
class LimbSegment:
    """points: (N, 2) vertices and share (N,): a point is (1 - share) first + share second. triangles: (F, 3) of points,
    outwards; caps: (E, 2) boundary edges, in the order of the triangles they belong to."""

    points: I32
    share: F64
    triangles: I32
    caps: I32

    def place(self, vertices: F32 | F64) -> F64:
        """(N, 3) points with the skin's vertices (V, 3) posed."""
        p, q = vertices[self.points[:, 0]].astype(np.float64), vertices[self.points[:, 1]].astype(np.float64)
        return p + self.share[:, None] * (q - p)

    def volume(self, vertices: F32 | F64) -> float:
        """Volume in cubic metres between the cross-sections, each closed by a fan about its middle."""
        p = self.place(vertices)
        origin = p.mean(axis=0)
        p -= origin
        a, b, c = p[self.triangles[:, 0]], p[self.triangles[:, 1]], p[self.triangles[:, 2]]
        total = float(np.einsum("fi,fi->", a, np.cross(b, c)))
        for ring in _rings(self.caps):
            first, second = p[ring[:, 0]], p[ring[:, 1]]
            total += float(np.einsum("i,fi->", first.mean(axis=0), np.cross(second, first)))
        return total / 6.0


@dataclass(frozen=True)
class CrossSection:
    """A ring of skin points, in order round the limb; as in `LimbSegment`."""

    points: I32
    share: F64

    def place(self, vertices: F32 | F64) -> F64:
        """(N, 3) the ring's points on a skin whose vertices are (V, 3) [m]."""
        p, q = vertices[self.points[:, 0]].astype(np.float64), vertices[self.points[:, 1]].astype(np.float64)
        return p + self.share[:, None] * (q - p)

    def area(self, vertices: F32 | F64) -> float:
        """Area of the ring's best plane [m^2]: the length of its vector area."""
        p = self.place(vertices)
        p -= p.mean(axis=0)
        return 0.5 * float(np.linalg.norm(np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)))

    def radius(self, vertices: F32 | F64) -> tuple[float, float]:
        """Least and mean distance of the ring from its middle [m]."""
        p = self.place(vertices)
        away = np.linalg.norm(p - p.mean(axis=0), axis=1)
        return float(away.min()), float(away.mean())


def limb_segment(skeleton: Skeleton, vertices: F32, triangles: I32, side: str, cuts: tuple[Cut, Cut]) -> LimbSegment:
    """The skin of one side between two cross-sections, cut from the rest pose. Raises ValueError where nothing is there."""
    (joint_0, share_0), (joint_1, share_1) = cuts
    p = np.asarray(vertices, np.float64)
    piece = _Piece.whole(p, triangles)
    piece = piece.beyond(_height(skeleton, side, joint_0, share_0))
    end = _height(skeleton, side, joint_1, share_1)
    piece = piece.beyond(lambda q: -end(q))
    middle = 0.5 * (_place(skeleton, side, joint_0, share_0) + _place(skeleton, side, joint_1, share_1))
    return piece.nearest(middle).segment()


def cross_section(skeleton: Skeleton, vertices: F32, triangles: I32, side: str, cut: Cut) -> CrossSection:
    """The ring that a plane across a bone cuts from the skin at rest."""
    piece = _Piece.whole(np.asarray(vertices, np.float64), triangles).beyond(_height(skeleton, side, *cut))
    edges = _boundary(piece.triangles)
    on = np.abs(_height(skeleton, side, *cut)(piece.at)) < 1e-8
    rings = _rings(edges[on[edges].all(axis=1)])
    if not rings:
        raise ValueError(f"no skin at {cut[1]:.2f} of {side} {cut[0]}")
    centre = _place(skeleton, side, *cut)
    ring = min(rings, key=lambda r: float(np.linalg.norm(piece.at[r[:, 0]].mean(axis=0) - centre)))
    return CrossSection(piece.points[ring[:, 0]], piece.share[ring[:, 0]])


def volume_change(segments: Sequence[LimbSegment], rest: F32, posed: F32 | F64) -> F64:
    """(S,) volume posed / at rest - 1."""
    return np.array([s.volume(posed) / s.volume(rest) - 1.0 for s in segments])


def _place(skeleton: Skeleton, side: str, joint: str, share: float) -> F64:
    j = JOINT_INDEX[f"{side}_{joint}"]
    return skeleton.rest[j] + share * skeleton.tip[j]


def _height(skeleton: Skeleton, side: str, joint: str, share: float) -> Callable[[F64], F64]:
    """How far points lie beyond a cut, along its bone [m]."""
    axis = skeleton.tip[JOINT_INDEX[f"{side}_{joint}"]]
    axis = axis / np.linalg.norm(axis)
    at = _place(skeleton, side, joint, share)

    def height(q: F64) -> F64:
        return (q - at) @ axis

    return height


@dataclass(frozen=True)
class _Piece:
    """Skin that is being cut: at (N, 3) its points at rest."""

    points: I32
    share: F64
    at: F64
    triangles: I32

    @staticmethod
    def whole(p: F64, triangles: I32) -> "_Piece":
        index = np.arange(len(p), dtype=np.int32)
        return _Piece(np.stack([index, index], axis=1), np.zeros(len(p)), p, triangles)

    def beyond(self, height: Callable[[F64], F64]) -> "_Piece":
        """What lies beyond the plane where `height` is 0. Points that an earlier cut made keep their place, so two cuts
        must not share an edge."""
        h = height(self.at)
        h = np.where(np.abs(h) < 1e-9, 1e-9, h)
        inside = h > 0.0
        count = inside[self.triangles].sum(axis=1)
        out = [self.triangles[count == 3]]
        made: dict[tuple[int, int], int] = {}
        points, share, at = [self.points], [self.share], [self.at]
        fresh: list[list[int]] = []

        def crossing(i: int, j: int) -> int:
            key = (min(i, j), max(i, j))
            if key not in made:
                made[key] = len(self.points) + len(made)
                s = h[key[0]] / (h[key[0]] - h[key[1]])
                first, second = (self._as_vertex(k) for k in key)
                points.append(np.array([[first, second]], np.int32))
                share.append(np.array([s]))
                at.append((self.at[key[0]] + s * (self.at[key[1]] - self.at[key[0]]))[None])
            return made[key]

        for t in self.triangles[(count == 1) | (count == 2)]:
            i, j, k = (int(v) for v in t)
            # The vertex that is alone on its side comes first.
            alone = next(n for n in (0, 1, 2) if inside[(i, j, k)[n]] == (inside[t].sum() == 1))
            i, j, k = ((i, j, k), (j, k, i), (k, i, j))[alone]
            a, b = crossing(i, j), crossing(i, k)
            fresh += [[i, a, b]] if inside[i] else [[a, j, k], [a, k, b]]
        triangles = np.concatenate([*out, np.array(fresh, np.int32).reshape(-1, 3)])
        return _Piece(np.concatenate(points), np.concatenate(share), np.concatenate(at), triangles)

    def _as_vertex(self, point: int) -> int:
        """The mesh vertex of a point; of one that a cut made, the nearer end of its edge."""
        return int(self.points[point, int(self.share[point] > 0.5)])

    def nearest(self, centre: F64) -> "_Piece":
        """The connected part whose middle is nearest to a place."""
        label = _components(len(self.at), self.triangles)
        of = label[self.triangles[:, 0]]
        if not len(of):
            raise ValueError("no skin between the cuts")
        middles = {int(c): self.at[np.unique(self.triangles[of == c])].mean(axis=0) for c in np.unique(of)}
        best = min(middles, key=lambda c: float(np.linalg.norm(middles[c] - centre)))
        return _Piece(self.points, self.share, self.at, self.triangles[of == best])

    def segment(self) -> LimbSegment:
        used, triangles = np.unique(self.triangles, return_inverse=True)
        triangles = triangles.reshape(-1, 3).astype(np.int32)
        return LimbSegment(self.points[used], self.share[used], triangles, _boundary(triangles))


@compiled
def _components(count: int, triangles: I32) -> I32:
    """(N,) a point that each point is connected with, the same for all of a part."""
    label = np.arange(count).astype(np.int32)
    for t in range(len(triangles)):
        for corner in range(3):
            a, b = triangles[t, corner], triangles[t, (corner + 1) % 3]
            while label[a] != a:
                label[a] = label[label[a]]
                a = label[a]
            while label[b] != b:
                label[b] = label[label[b]]
                b = label[b]
            label[max(a, b)] = min(a, b)
    for n in range(count):
        label[n] = label[label[n]]
    return label


def _boundary(triangles: I32) -> I32:
    """(E, 2) edges with a triangle on one side only."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    have = {(int(a), int(b)) for a, b in edges}
    return np.array([e for e in edges.tolist() if (e[1], e[0]) not in have], np.int32).reshape(-1, 2)


def _rings(edges: I32) -> list[I32]:
    """Closed chains of directed edges, each (n, 2)."""
    following = {int(a): int(b) for a, b in edges}
    rings: list[I32] = []
    while following:
        start, at = next(iter(following.items()))
        ring = [(start, at)]
        del following[start]
        while at in following:
            step = following.pop(at)
            ring.append((at, step))
            at = step
        rings.append(np.array(ring, np.int32))
    return rings
