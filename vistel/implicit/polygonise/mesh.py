"""The closed triangle mesh that polygonisation makes, and what can be asked of it."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32, I64
from vistel.implicit.primitives.polyhedron import Polyhedron


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceMesh:
    """A closed surface of triangles.

    vertices: (n, 3) [m]; triangles: (m, 3) vertex numbers, counter-clockwise seen from outside; normals: (k, 3) outward unit
    normals, one for each vertex, or where the mesh has hard edges those that `normal_of` (m, 3) names for the corners; attributes:
    name -> (n, c) numbers at the vertices, such as `colour` and `uv`; polygon: (m,) number of the flat polygon a triangle is a part
    of; retained: how many polygons, the first ones, are a primitive's own; residual: the largest |F - T| at a vertex.
    """

    vertices: F64
    triangles: I32
    normals: F32
    normal_of: I32 | None = None
    attributes: dict[str, F32] = field(default_factory=dict[str, F32])
    polygon: I32 | None = None
    retained: int = 0
    residual: float = 0.0

    def __repr__(self) -> str:
        return f"SurfaceMesh({len(self.vertices)} vertices, {len(self.triangles)} triangles)"

    @cached_property
    def edges(self) -> tuple[I64, I64]:
        """Edges (e, 2), lower vertex first, and how many triangles run along each in either way (e, 2)."""
        n = len(self.vertices)
        directed = np.stack([self.triangles, np.roll(self.triangles, -1, axis=1)], axis=-1).reshape(-1, 2).astype(np.int64)
        low, high = directed.min(axis=1), directed.max(axis=1)
        key, place = np.unique(low * n + high, return_inverse=True)
        counts = np.zeros((len(key), 2), np.int64)
        np.add.at(counts, (place, (directed[:, 0] > directed[:, 1]).astype(np.int64)), 1)
        return np.stack([key // n, key % n], axis=1), counts

    @property
    def watertight(self) -> bool:
        """Whether every edge has two triangles, which run along it in opposite ways."""
        return bool((self.edges[1] == 1).all())

    @cached_property
    def manifold(self) -> bool:
        """Whether the triangles round every vertex are one closed fan."""
        if not self.watertight:
            return False
        n = len(self.vertices)
        flat = self.triangles.astype(np.int64)
        centre, before, after = (np.roll(flat, -k, axis=1).ravel() for k in range(3))
        # Round a vertex `after` of one corner is `before` of the next; there is one fan if following comes round.
        of = np.argsort(centre * n + before, kind="stable")
        position = np.searchsorted((centre * n + before)[of], centre * n + after)
        if (position >= len(of)).any():
            return False
        follows = of[position]
        label = _components(follows)
        fans = np.unique(np.stack([centre, label], axis=1), axis=0)
        return len(fans) == len(np.unique(centre))

    @property
    def euler(self) -> int:
        """Vertices - edges + triangles of the vertices in use: 2 for each part less 2 for each handle."""
        return len(np.unique(self.triangles)) - len(self.edges[0]) + len(self.triangles)

    @property
    def area(self) -> float:
        """[m^2]."""
        return float(np.linalg.norm(self._crosses, axis=1).sum() / 2)

    @property
    def volume(self) -> float:
        """Enclosed volume [m^3]."""
        return float((self.vertices[self.triangles[:, 0]] * self._crosses).sum() / 6)

    @property
    def _crosses(self) -> F64:
        a, b, c = (self.vertices[self.triangles[:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    @cached_property
    def polygons(self) -> tuple[tuple[int, ...], ...]:
        """The faces as loops of vertex numbers, the triangles of one flat polygon as one face where they make a disc."""
        if self.polygon is None:
            return tuple(map(tuple, self.triangles.tolist()))
        order = np.argsort(self.polygon, kind="stable")
        starts = np.flatnonzero(np.diff(self.polygon[order], prepend=-1))
        found: list[tuple[int, ...]] = []
        for group in np.split(order, starts[1:]):
            rows: list[list[int]] = self.triangles[group].tolist()
            loop = outline(rows)
            found += [loop] if loop else [tuple(row) for row in rows]
        return tuple(found)

    def polyhedron(self) -> Polyhedron:
        """This surface as a volume for a pointblob, a point-setblob or a polyblob."""
        used, flat = np.unique(self.triangles, return_inverse=True)
        faces = flat.reshape(-1, 3).tolist()
        return Polyhedron(self.vertices[used], tuple((a, b, c) for a, b, c in faces))


def outline(triangles: list[list[int]]) -> tuple[int, ...] | None:
    """The one loop round some triangles, None where there are several."""
    if len(triangles) == 1:
        return tuple(triangles[0])
    directed = {(row[k], row[(k + 1) % 3]) for row in triangles for k in range(3)}
    rim = [(a, b) for a, b in directed if (b, a) not in directed]
    follows = dict(rim)
    if not rim or len(follows) != len(rim):
        return None
    start = min(follows)
    loop = [start]
    while follows[loop[-1]] != start:
        loop.append(follows[loop[-1]])
        if len(loop) > len(rim):
            return None
    return tuple(loop) if len(loop) == len(rim) else None


def _components(follows: I64) -> I64:
    """The least member of each cycle of a permutation, by doubling."""
    label, jump = np.arange(len(follows)), follows
    for _ in range(max(1, len(follows).bit_length())):
        following = np.minimum(label, label[jump])
        if np.array_equal(following, label):
            break
        label, jump = following, jump[jump]
    return label


def parts(triangles: NDArray[np.integer[Any]], n: int) -> I64:
    """(n,) for each of n vertices the lowest vertex of the connected part it belongs to."""
    label = np.arange(n)
    while True:
        least = label[triangles].min(axis=1)
        following = label.copy()
        for k in range(3):
            np.minimum.at(following, triangles[:, k], least)
        following = following[following]
        if np.array_equal(following, label):
            return label
        label = following


def corner_normals(vertices: F64, triangles: I32) -> F64:
    """(n, 3) unit normals of vertices, the mean of their triangles by area."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    total = np.zeros((len(vertices), 3))
    for k in range(3):
        np.add.at(total, triangles[:, k], cross)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=np.zeros_like(total), where=length > 0)
