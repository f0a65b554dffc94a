"""More vertices where the outline of a head shows them, fewer where nobody looks: in the mouth, on feet, under clothes."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags, identity
from scipy.sparse.linalg import splu

from scripts.body_model.layout import BOXES
from scripts.body_model.parts import Rows
from scripts.body_model.skin import Faces, level
from vistel.arrays import F32, F64, I32, Bool
from vistel.figure.avatar.avatar import Mesh, Target
from vistel.figure.avatar.detail import coarser
from vistel.figure.making.dress import drawn
from vistel.figure.rigid.weights import TWIST_BONES
from vistel.figure.skeleton import JOINTS

LONGEST = 0.0095
"""Edges of the head that are longer are halved [m]."""
TRIANGLES = (16_000, 6_000, 2_600)
"""Of the levels of detail."""
OF = {"else": 0.45, "head": 2.0, "jaw": 2.0, "neck": 1.5, "hand": 2.0, "thumb": 2.0, "index": 2.0, "middle": 2.0, "ring": 2.0,
      "little": 2.0, "foot": 0.22, "toes": 0.22, "ear": 2.2, "mouth": 0.12, "face": 5.0}  # fmt: skip
"""By how much more a distance counts on parts of a body, by what is in the name of their joint."""
FEATURES = 2.5
"""By how much more yet it counts round eyes and mouth on coarser levels: a face is known by them from across a table."""
ROUND_EYE, BELOW_EYES, BESIDE = 0.024, (0.050, 0.098), 0.034
"""What counts as that: so near an eye; so far below the eyes and within so much of the middle [m]."""
MARK = "vertex"
"""Target with which a mesh is marked: its offsets are the numbers of its vertices."""
Corners = tuple[I32, F64, F64]


@dataclass(frozen=True)
class Finer:
    """faces: with some edges halved; ends: (N, 2) of each new vertex; stencil: (N, V) of which old points a new one is the sum, so
    that the surface bends as smoothly as it can through the old points. New vertices are numbered from V."""

    faces: Faces
    ends: I32
    stencil: csr_matrix


def finer(faces: Faces, points: F64, where: Bool) -> Finer:
    """faces with all edges halved of the triangles `where` (F,). points: (V, 3) of a usual person."""
    tri = faces.triangles
    ends = np.sort(np.stack([tri, np.roll(tri, -1, axis=1)], axis=-1), axis=-1)
    ends = np.unique(ends[where].reshape(-1, 2), axis=0)
    number = {(int(a), int(b)): len(points) + k for k, (a, b) in enumerate(ends)}
    made: list[list[tuple[int, F64, F64]]] = []
    for t, uv, old in zip(tri, faces.uv, faces.old_uv, strict=True):
        corner = [(int(v), uv[k], old[k]) for k, v in enumerate(t)]
        middle = []
        for k in range(3):
            a, b = corner[k], corner[(k + 1) % 3]
            v = number.get((min(a[0], b[0]), max(a[0], b[0])))
            middle.append(None if v is None else (v, 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])))
        made += _split(corner, middle)
    new = Faces(
        np.array([[c[0] for c in t] for t in made], np.int32),
        np.array([[c[1] for c in t] for t in made]),
        np.array([[c[2] for c in t] for t in made]),
    )
    start = np.vstack([points, 0.5 * (points[ends[:, 0]] + points[ends[:, 1]])])
    return Finer(new, ends.astype(np.int32), _smoothest(start, new.triangles, len(points)))


def _split(corner: list, middle: list) -> list:
    """The triangle as its halved edges leave it; middle: of the edges after each corner, None where it is whole."""
    count = sum(m is not None for m in middle)
    if count == 0:
        return [corner]
    # Turned so that the edge after the first corner is halved, and with two of them, the next one too.
    first = next(k for k in range(3) if middle[k] is not None and (count != 2 or middle[(k + 1) % 3] is not None))
    (a, b, c), (p, q, r) = ([x[(first + k) % 3] for k in range(3)] for x in (corner, middle))
    if count == 1:
        return [[a, p, c], [p, b, c]]
    if count == 2:
        return [[p, b, q], [a, p, q], [a, q, c]]
    return [[a, p, r], [p, b, q], [r, q, c], [p, q, r]]


def _smoothest(points: F64, triangles: I32, old: int) -> csr_matrix:
    """(N, old) with which the points after the old ones lie where the Laplacian of the Laplacian is least."""
    a, b = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).T
    near = 1.0 / (np.linalg.norm(points[a] - points[b], axis=1) + 1e-6)
    weight = coo_matrix((near, (a, b)), (len(points), len(points))).tocsr()
    weight = weight + weight.T
    mean = diags(1.0 / np.maximum(np.asarray(weight.sum(axis=1)).ravel(), 1e-9)) @ weight
    bend = (identity(len(points)) - mean).tocsr()
    square = (bend.T @ bend).tocsc()
    known = square[old:, :old].toarray()
    used = np.flatnonzero(np.abs(known).max(axis=0) > 0.0)
    share = np.zeros((len(points) - old, old))
    share[:, used] = -splu(square[old:, old:].tocsc()).solve(known[:, used])
    share[np.abs(share) < 1e-4] = 0.0
    return csr_matrix(share / share.sum(axis=1, keepdims=True))


class Density:
    """From rows of the base mesh (closed skin, other skin, eyes, joints: `Rows`) to those of the model's file.

    Between them are rows with the new vertices after the closed skin: triangles, body (number of rows that are the closed skin) and
    skin (that are drawn) are of those, and left (V,) which of them the file keeps; old (V,): where the base mesh's are; kept_body:
    number of the file's rows that are the closed skin."""

    def __init__(self, faces: Faces, points: F64, rows: Rows, joints: dict[str, F64]) -> None:
        """faces, points: of a usual person, with joints' places."""
        self._finer = finer(faces, points, _long(faces, points, rows, joints))
        new = len(self._finer.ends)
        self.body, self.skin = rows.body + new, rows.skin + new
        self._order = np.concatenate([np.arange(rows.body), len(points) + np.arange(new), np.arange(rows.body, len(points))])
        place = np.empty(len(self._order), np.int32)
        place[self._order] = np.arange(len(self._order), dtype=np.int32)
        self.old = place[: rows.skin]
        self.triangles = place[self._finer.faces.triangles]
        self._joints, self._points = joints, points

    def points(self, at: F64) -> F64:
        """(W, 3) of points, or offsets, of the base mesh's rows (P, 3)."""
        return np.vstack([at, self._finer.stencil @ at])[self._order]

    def drawn(self, at: F64) -> F64:
        """Those that are drawn."""
        return self.points(at)[: self.skin]

    def weights(self, of: F32) -> F32:
        """(W, J) of weights of what is drawn (V, J)."""
        a, b = self._finer.ends.T
        return np.insert(of, np.full(len(a), self.body - len(a)), 0.5 * (of[a] + of[b]), axis=0)

    def reduce(self, points: F64, bone: I32) -> None:
        """Choose the levels' vertices. points, bone: (W, 3), (W, 4) of what is drawn, in the T-pose."""
        faces = replace(self._finer.faces, triangles=self.triangles)
        importance = _importance(self.drawn(self._points), bone, faces, self._joints, self.body)
        self._levels = reduced(_marked(points, faces), TRIANGLES, importance, self._features())
        self.left = _numbers(self._levels[0])
        self.kept_body = int((self.left < self.body).sum())

    def _features(self) -> F64:
        """(W,) by how much more distances count on coarser levels."""
        p, eyes = self.drawn(self._points), np.stack([self._joints["left_eye"], self._joints["right_eye"]])
        below = eyes[0, 1] - p[:, 1]
        mouth = (below > BELOW_EYES[0]) & (below < BELOW_EYES[1]) & (np.abs(p[:, 0]) < BESIDE) & (p[:, 2] > eyes[0, 2] - 0.01)
        near = np.linalg.norm(p[:, None] - eyes, axis=2).min(axis=1) < ROUND_EYE
        return np.where(mouth | near, FEATURES, 1.0)

    def kept(self, at: F64 | F32) -> F64:
        """(P', 3) of the file's rows."""
        made = self.points(np.asarray(at, np.float64))
        return np.vstack([made[self.left], made[self.skin :]])

    def levels(self) -> list[dict[str, Any]]:
        """Arrays of each level of detail, the finest first."""
        row = np.full(self.skin, -1)
        row[self.left] = np.arange(len(self.left))
        return [level(mesh, row[_numbers(mesh)]) for mesh in self._levels]


def _long(faces: Faces, p: F64, rows: Rows, joints: dict[str, F64]) -> Bool:
    """(F,) triangles of the head with a long edge."""
    corner = p[faces.triangles]
    edge = np.linalg.norm(corner - np.roll(corner, -1, axis=1), axis=-1).max(axis=1)
    on_head = (corner[..., 1] > joints["head"][1] - 0.02).all(axis=1) & (faces.triangles < rows.body).all(axis=1)
    return on_head & (edge > LONGEST)


def _importance(p: F64, bone: I32, faces: Faces, joints: dict[str, F64], body: int) -> F64:
    """(V,) see `reduced`; p: of a usual person as they stand."""
    joint = np.array(JOINTS + tuple(b.joint for b in TWIST_BONES))[bone[:, 0]]
    out = np.full(len(p), OF["else"])
    for word, value in OF.items():
        out[np.char.find(joint, word) >= 0] = value
    eye, head = joints["left_eye"], np.isin(joint, ("head", "jaw", "left_eye", "right_eye"))
    x, z = np.abs(p[:, 0]), p[:, 2] - eye[2]
    out[head & (z > -0.055) & (x < 0.072)] = OF["face"]
    out[head & (z < -0.035) & (z > -0.12) & (x > 0.064) & (np.abs(p[:, 1] - eye[1]) < 0.07)] = OF["ear"]
    low, high = np.array(BOXES["mouth"]).reshape(2, 2)
    middle = faces.uv.mean(axis=1)
    out[faces.triangles[((middle > low) & (middle < high)).all(axis=1)]] = OF["mouth"]
    out[body:] = np.where(head[body:], np.inf, 1.0)
    return out


def _marked(points: F64, faces: Faces) -> Mesh:
    """A mesh whose vertices are marked with their numbers."""
    vertex, uv, corner = drawn(faces.uv, faces.triangles)
    row = np.arange(len(points), dtype=np.int32)
    mark = Target(MARK, row, np.column_stack([row, row, row]).astype(np.float32))
    limb = np.zeros(len(points), np.int32)
    return Mesh(points.astype(np.float32), faces.triangles, vertex, uv, corner, limb, targets=(mark,))


def _numbers(mesh: Mesh) -> I32:
    """(V,) of the vertices left of a mesh that was marked."""
    out = np.empty(len(mesh.vertices), np.int32)
    out[mesh.targets[0].vertex] = np.round(mesh.targets[0].offset[:, 0]).astype(np.int32)
    return out


def reduced(mesh: Mesh, counts: tuple[int, ...], importance: F64, features: F64) -> list[Mesh]:
    """A marked mesh with fewer and fewer triangles. importance: (V,) factor of distances, infinite for vertices that the first of
    them keeps; features: (V,) further factor for all but the first."""
    out: list[Mesh] = []
    for count in counts:
        mesh = coarser(mesh, count, importance[_numbers(mesh)])
        importance = np.minimum(importance, OF["face"]) if out else np.minimum(importance, OF["face"]) * features
        out.append(mesh)
    return out
