"""Which faces of a file are the person's skin, which are eyeballs, which are not to be seen; and what is wrong with them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from vistel.arrays import F64, I32
from vistel.figure.making.source import MakingError, SourceMesh

Mask = NDArray[np.bool_]

_HIDDEN = ("helper-", "joint-")
_INSIDE = ("teeth", "tongue", "lash")
WORN = "worn: "
"""What the names of groups of clothes begin with."""
_FEWEST = 200
"""Fewer triangles than this are not a person."""


@dataclass(frozen=True)
class Parts:
    """skin, eyes: (F,) faces of the source; worn: those of the skin that are clothes from another file."""

    skin: Mask
    eyes: Mask
    worn: Mask
    notes: tuple[str, ...]


def parts_of(source: SourceMesh, gaze: Mask | None = None) -> Parts:
    """By the names of groups and materials, and for eyeballs by `gaze`: (F,) faces that wholly follow the joint of an eye.
    Raises MakingError where nothing is left."""
    notes: list[str] = []
    names = [g.lower() for g in source.groups]
    materials = [m.name.lower() for m in source.materials]
    eye_group = np.array([is_eye(n) for n in names])
    eye_material = np.array([is_eye(n) for n in materials])
    eyes = eye_group[source.group] | eye_material[source.material]
    if gaze is not None:
        eyes = eyes | gaze
    hidden = np.array([n.startswith(_HIDDEN) or any(w in n for w in _INSIDE) for n in names])[source.group] & ~eyes
    skin = ~eyes & ~hidden
    if hidden.any():
        hidden_groups: list[int] = np.unique(source.group[hidden]).tolist()
        kept_groups: list[int] = np.unique(source.group[skin]).tolist()
        left_out = sorted({source.groups[g] for g in hidden_groups})
        kept = sorted({source.groups[g] or "(no name)" for g in kept_groups})
        shown = ", ".join(left_out[:4]) + (f" and {len(left_out) - 4} more" if len(left_out) > 4 else "")
        notes.append(f"kept {', '.join(kept)}; left out {shown}")
    if skin.sum() < _FEWEST:
        raise MakingError(f"{int(skin.sum())} faces of a body, expected at least {_FEWEST}; is this the mesh of a person?")
    if eyes.any():
        notes.append(f"eyeballs: {int(eyes.sum())} faces, which gaze will turn")
    worn = np.array([g.startswith(WORN) for g in source.groups])[source.group] & skin
    return Parts(skin, eyes, worn, tuple(notes))


def is_eye(name: str) -> bool:
    """Whether a group or material of that name (in small letters) is an eyeball."""
    return "eye" in name and not any(w in name for w in ("lash", "brow", "lid", "target", "joint", "wear", "glass", "shadow"))


def covered(points: F64, body: I32, worn: I32, size: float) -> Mask:
    """(F,) faces of the body that lie under what is worn: nobody sees them, and bending they would come through.

    size: of the person [m]. Near the borders of clothes the skin stays.
    """
    cloth = np.unique(worn)
    ends = np.sort(np.concatenate([worn[:, [0, 1]], worn[:, [1, 2]], worn[:, [2, 0]]]), axis=1).astype(np.int64)
    edge, uses = np.unique(ends, axis=0, return_counts=True)
    border = np.unique(edge[uses == 1])
    used = np.unique(body)
    corner = points[body]
    face = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal = np.stack([np.bincount(body.ravel(), np.repeat(face[:, k], 3), len(points)) for k in range(3)], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    # Straight above it there must be cloth, at a place that the middles of its faces tell closely enough.
    above = np.vstack([points[cloth], points[worn].mean(axis=1)])
    distance, nearest = KDTree(above).query(points[used])
    off = above[nearest] - points[used]
    height = np.einsum("ni,ni->n", off, normal[used])
    beside = np.sqrt(np.maximum(distance**2 - height**2, 0.0))
    under = (distance < 0.035 * size) & (height > -0.002 * size) & (beside < 0.009 * size)
    if len(border):
        under &= KDTree(points[border]).query(points[used])[0] > 0.016 * size
    if not under.all():
        # What is seen beside the cloth goes on a little under it: one looks into collars and sleeves.
        under &= KDTree(points[used[~under]]).query(points[used])[0] > 0.02 * size
    hidden = np.zeros(len(points), np.bool_)
    hidden[used] = under
    return np.asarray(hidden[body].all(axis=1), np.bool_)


def weld(points: F64, triangles: I32) -> tuple[I32, I32, int]:
    """Vertices at one place made one: (V,) first vertex of each place, triangles with them, how many went.

    Formats that store a vertex for each texture place double them along seams; a figure must not tear there.
    """
    size = float(np.ptp(points, axis=0).max())
    grid = np.round(points / max(1e-7 * size, 1e-12)).astype(np.int64)
    _, first, inverse = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    to = first[inverse.reshape(-1)].astype(np.int32)
    return to, to[triangles], int(len(points) - len(first))


@dataclass(frozen=True)
class Soundness:
    """Edges with one face, holes they make up, edges with more than two faces, separate pieces."""

    border: int
    holes: int
    branching: int
    pieces: int

    @property
    def manifold(self) -> bool:
        """Whether at most two faces meet at every edge."""
        return self.branching == 0

    def notes(self) -> tuple[str, ...]:
        """One line for each fault that the author of the mesh may want to mend."""
        out: list[str] = []
        if self.border:
            out.append(f"{self.holes} holes or open edges ({self.border} edges; hair and clothes count too): they stay open")
        if self.branching:
            out.append(f"not manifold at {self.branching} edges: works; coarser levels of detail are cut apart there")
        if self.pieces > 1:
            out.append(f"{self.pieces} separate pieces (clothes, hair): they move with the body together")
        return tuple(out)


def soundness(triangles: I32, count: int) -> Soundness:
    """The health of a mesh from the edges of its triangles over `count` vertices."""
    ends = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1).astype(np.int64)
    key, uses = np.unique(ends[:, 0] * count + ends[:, 1], return_counts=True)
    border = key[uses == 1]
    pieces = _components(key // count, key % count, np.unique(triangles))
    holes = _components(border // count, border % count, np.unique(np.concatenate([border // count, border % count])))
    return Soundness(len(border), holes, int(np.count_nonzero(uses > 2)), pieces)


def _components(a: NDArray[np.int64], b: NDArray[np.int64], used: NDArray[np.integer]) -> int:
    if not len(used):
        return 0
    place = np.full(int(used.max()) + 1, -1)
    place[used] = np.arange(len(used))
    graph = coo_array((np.ones(len(a)), (place[a], place[b])), shape=(len(used), len(used)))
    return int(connected_components(graph, directed=False)[0])
