"""What of an avatar hangs free, as a few dozen pendulums, and how each level of detail follows them.

A pendulum is a vertex of the finest level that hangs; its root is straight above it, where the garment or the hair is held, and
goes with the bones there. All levels follow the same pendulums, so that a person swings alike at every distance.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree  # pyright: ignore[reportMissingTypeStubs]

from vistel.arrays import F64, I32, Bool
from vistel.figure.avatar.avatar import Avatar, flesh
from vistel.figure.avatar.patch import patch_of
from vistel.figure.body import PosedBody, pose_body
from vistel.figure.moved_part import MovedPart
from vistel.figure.posture.posture import rest_pose
from vistel.figure.skeleton import JOINT_INDEX
from vistel.figure.swing.swing_kernels import skin_distances  # pyright: ignore[reportUnknownVariableType]
from vistel.geometry.normals import vertex_normals

MOST = 40
"""Pendulums of a garment, or of hair."""
MOST_OF_ALL = 160
"""Pendulums of a person; what more hangs does not swing. The built-in people have 8 to 46."""
MOST_SAMPLES = 2000
"""Places of the skin that they may lie on. The built-in people have 130 to 340."""
_APART = 0.06
"""Least distance between two of them [m]."""
_SHORTEST = 0.04
"""Of pendulums [m]; what hangs less follows the nearest."""
_LEAST = 0.005
"""What hangs less does not move [m]."""
_NEIGHBOURS = 5
"""Neighbours that a pendulum is tied to, and pendulums that a vertex follows."""
_TIED = 2.2
"""Greatest distance of those, as a multiple of `_APART`."""
CLEAR = 0.006
"""Distance from the body that is asked of pendulums which are farther from it at rest [m]."""
OFF = 0.012
"""The same from skin and clothes [m]."""
_CELL = 0.035
"""Between places of the skin [m]."""
_BESIDE = 0.16
"""How far from what hangs skin is that it may come to lie on [m]."""
_UNDER = -0.003
"""What is deeper under other clothes at rest does not come to lie on them [m]."""
_ABOVE = 0.04
"""Cloth that is held so far above the hip joints lies on the lap of who sits [m]."""
_CLOTH = 60.0
_HAIR = 12.0
"""How stiff what hangs is: acceleration back to where the bones alone would have it, by distance [1/s²]."""
_HAND = ("metacarpal", "proximal", "intermediate", "distal")


@dataclass(frozen=True, eq=False)
class Hanging:
    """N pendulums. place, root: (N, 3) at rest [m]; bone, weight, root_bone, root_weight: (N, 4) what each follows; length: (N,)
    [m]; stiff: (N,) [1/s²]; tie: (E, 2) neighbours, longest: (E,) [m]; group: (N,) number of the patch that each is of; solid: (P,)
    primitives of the body that they do not pass through; clear: (N, P) their least distance from each [m]; skin: skin and clothes
    that they may come to lie on; off: (N,) their least distance from it [m]; lap: (N,) whether they lie on the lap of who
    sits."""

    place: F64
    root: F64
    bone: I32
    weight: F64
    root_bone: I32
    root_weight: F64
    length: F64
    stiff: F64
    tie: I32
    longest: F64
    group: I32
    solid: I32
    clear: F64
    skin: "SkinSamples"
    off: F64
    lap: Bool

    def __len__(self) -> int:
        return len(self.place)

    @staticmethod
    def of(avatar: Avatar) -> "Hanging | None":
        """Of an avatar with all its levels; None where nothing hangs."""
        mesh = avatar.mesh
        if mesh.hangs is None or mesh.bone is None or mesh.weight is None:
            return None
        p, hangs, group = mesh.vertices.astype(np.float64), mesh.hangs.astype(np.float64), groups(avatar)
        chosen, roots = list[int](), list[int]()
        for each in np.unique(group[hangs > _SHORTEST]).tolist():
            held = np.flatnonzero((group == each) & (hangs <= 0.0))
            free = np.flatnonzero((group == each) & (hangs > _SHORTEST))
            if not len(held) or len(chosen) + MOST > MOST_OF_ALL:
                continue
            mine = _spread(p, free[np.argsort(-hangs[free], kind="stable")].tolist())
            above = p[mine] + hangs[mine, None] * np.eye(3)[1]
            chosen += mine
            roots += held[np.asarray(KDTree(p[held]).query(above)[1], np.int64)].tolist()
        if not chosen:
            return None
        at, length, of = p[chosen], hangs[chosen], group[chosen]
        soft = ~flesh(avatar)[chosen]
        top = np.array([(at[of == each, 1] + length[of == each]).max() for each in of])
        solid = np.array([k for k, name in enumerate(avatar.body.names) if not name.endswith(_HAND)], np.int32)
        return Hanging(
            at,
            at + length[:, None] * np.eye(3)[1],
            mesh.bone[chosen],
            mesh.weight[chosen].astype(np.float64),
            mesh.bone[roots],
            mesh.weight[roots].astype(np.float64),
            length,
            np.where(soft, _HAIR, _CLOTH),
            tie := _ties(at, of),
            np.linalg.norm(at[tie[:, 0]] - at[tie[:, 1]], axis=1),
            of,
            solid,
            np.minimum(distances(at, pose_body(avatar.body, rest_pose(avatar.skeleton)), solid), CLEAR),
            skin := SkinSamples.of(avatar, at),
            _least(skin.distances(at)),
            ~soft & (top > avatar.skeleton.rest[JOINT_INDEX["left_upper_leg"], 1] + _ABOVE),
        )


@dataclass(frozen=True, eq=False)
class SkinSamples:
    """M places (M, 3) of skin and clothes, their unit normals, and the bones (M, 4) that they follow."""

    place: F64
    normal: F64
    bone: I32
    weight: F64

    @staticmethod
    def of(avatar: Avatar, hanging: F64) -> "SkinSamples":
        """What pendulums (N, 3) of an avatar may come to lie on."""
        mesh = avatar.mesh
        assert mesh.bone is not None and mesh.weight is not None, "what hangs has bones"
        p, may = mesh.vertices.astype(np.float64), flesh(avatar)
        if mesh.hangs is not None:
            may &= mesh.hangs <= 0.0
        rows = np.flatnonzero(may & (np.asarray(KDTree(hanging).query(p)[0]) < _BESIDE))
        _, first = np.unique(np.round(p[rows] / _CELL).astype(np.int64), axis=0, return_index=True)
        rows = rows[np.sort(first)][:MOST_SAMPLES]
        normal = vertex_normals(p, mesh.triangles)
        return SkinSamples(p[rows], normal[rows], mesh.bone[rows], mesh.weight[rows].astype(np.float64))

    def distances(self, x: F64) -> F64:
        """(N,) of points (N, 3) at rest [m]."""
        out = np.empty(len(x))
        skin_distances(x, self.place, self.normal, out)
        return out


def _least(off: F64) -> F64:
    """(N,) distances from skin and clothes to keep, of those at rest."""
    return np.where(off > _UNDER, np.minimum(off, OFF), -np.inf)


def groups(avatar: Avatar) -> I32:
    """(V,) which garment or hair each vertex of an avatar is of: the number of its patch, -1 for none."""
    mesh = avatar.mesh
    out = np.full(len(mesh.vertices), -1, np.int32)
    out[mesh.triangles] = patch_of(avatar.patches, mesh.uv, mesh.corner_triangles)[:, None]
    return out


def distances(p: F64, posed: PosedBody, solid: I32) -> F64:
    """(N, P) from places (N, 3) to the surfaces of primitives [m], negative inside."""
    a, b, ra, rb = posed.a[solid], posed.b[solid], posed.radius_a[solid], posed.radius_b[solid]
    way = b - a
    t = np.einsum("npk,pk->np", p[:, None] - a, way) / np.maximum(np.einsum("pk,pk->p", way, way), 1e-12)
    t = np.clip(t, 0.0, 1.0)
    return np.linalg.norm(p[:, None] - a - t[..., None] * way, axis=2) - (ra + t * (rb - ra))


def _spread(p: F64, free: list[int]) -> list[int]:
    """Of vertices `free`, the first and then always the one farthest from all before."""
    chosen = [free[0]]
    far = np.linalg.norm(p[free] - p[chosen[0]], axis=1)
    while len(chosen) < MOST and far.max() > _APART:
        chosen.append(free[int(np.argmax(far))])
        far = np.minimum(far, np.linalg.norm(p[free] - p[chosen[-1]], axis=1))
    return chosen


def _ties(p: F64, group: I32) -> I32:
    far = np.linalg.norm(p[:, None] - p, axis=2)
    far[(group[:, None] != group) | (far > _TIED * _APART)] = np.inf
    np.fill_diagonal(far, np.inf)
    pairs = [
        (min(i, j), max(i, j)) for i in range(len(p)) for j in np.argsort(far[i])[:_NEIGHBOURS].tolist() if np.isfinite(far[i, j])
    ]
    return np.array(sorted(set(pairs)), np.int32).reshape(-1, 2)


class HungMesh:
    """One level of detail: how far its vertices go when pendulums turn."""

    def __init__(self, avatar: Avatar, hanging: Hanging) -> None:
        mesh, group = avatar.mesh, groups(avatar)
        assert mesh.hangs is not None, "every level says what hangs"
        vertex = np.flatnonzero((mesh.hangs > _LEAST) & np.isin(group, hanging.group))
        self.near, self.share = np.zeros((len(vertex), _NEIGHBOURS), np.int32), np.zeros((len(vertex), _NEIGHBOURS), np.float32)
        for each in np.unique(hanging.group).tolist():
            mine, rows = np.flatnonzero(hanging.group == each), np.flatnonzero(group[vertex] == each)
            far, near = _nearest(hanging.place[mine], mesh.vertices[vertex[rows]].astype(np.float64))
            # Continuous where another one becomes the nearest but `_NEIGHBOURS`.
            weight = np.square(np.maximum(0.0, 1.0 - far[:, :-1] / far[:, -1:])) + 1e-9
            self.near[rows] = mine[near[:, :-1]]
            self.share[rows] = mesh.hangs[vertex[rows], None] * weight / weight.sum(axis=1, keepdims=True)
        self.part = MovedPart(mesh, vertex)


def _nearest(to: F64, p: F64) -> tuple[F64, I32]:
    """(F, _NEIGHBOURS + 1) distances of the nearest of places `to`, and which they are; where there are fewer, the last again."""
    count = min(_NEIGHBOURS + 1, len(to))
    far, near = KDTree(to).query(p, k=[*range(1, count + 1)])
    more = ((0, 0), (0, _NEIGHBOURS + 1 - count))
    return np.pad(far, more, mode="edge") + 1e-6, np.pad(near, more, mode="edge").astype(np.int32)
