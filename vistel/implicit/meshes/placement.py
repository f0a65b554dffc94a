"""Skeletons of primitives placed in a mesh that has none (Singh §2.3.1): from the boxes round its parts.

A part of a mesh is held by one cone-sphere: its axis lies along that axis of the part's box (by principal components,
every vertex counting by the area round it) along which a cone-sphere fits best; its radii are fitted to the distances
from the axis, and its ends lie inside or at the part's own ends, whichever fits better. A mesh without parts is cut at
the middle of the part that fits worst, pieces that hang together only through others becoming parts of their own;
then vertices go to the primitive whose surface is nearest, and primitives are fitted anew, as long as that helps.
"""

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I32
from vistel.implicit.meshes.embedding import Limbs
from vistel.jit.kernel_jit import compiled

_FEWEST = 12
"""Vertices a part needs."""
_ROUNDS = 12
_STEPS = 12
_INSETS = (0.0, 0.5, 1.0)
"""Ends of a skeleton tried: so many radii inside the part's own end."""


_ALIGN = 0.35
"""Weight of directions: a vertex whose normal does not point away from the axis is as far off as so many radii."""


@dataclass(frozen=True)
class _Skin:
    """Vertices of a mesh: p and unit normals n (N, 3), area (N,) round each."""

    p: F64
    n: F64
    area: F64

    def __getitem__(self, rows: NDArray[Any]) -> "_Skin":
        return _Skin(self.p[rows], self.n[rows], self.area[rows])


@dataclass(frozen=True)
class Placement:
    """Where primitives went. limbs: one group for each primitive; limb: (V,) the primitive each vertex belongs to;
    distance: (V,) from each vertex to that primitive's surface, outside positive [m]; area: (V,) of the mesh round each
    vertex [m^2]."""

    limbs: Limbs
    limb: I32
    distance: F64
    area: F64

    @property
    def mean_distance(self) -> float:
        """Mean distance of the mesh from the primitives' surfaces [m]."""
        return float(np.average(np.abs(self.distance), weights=self.area))


def place_skeletons(vertices: NDArray[np.floating], triangles: I32, count: int) -> Placement:
    """`count` cone-spheres in the mesh of vertices (V, 3) [m] and triangles (F, 3), open or closed; fewer where parts
    would have less than a dozen vertices. Raises ValueError for vertices that are not finite or a count below 1."""
    if count < 1:
        raise ValueError(f"count: expected at least 1 primitive, got {count}")
    skin, edges = _skin(_checked(vertices), triangles), _edges(triangles)
    part = np.zeros(len(skin.p), np.int32)
    cones = [_fit(skin)]
    while len(cones) < count:
        errors = [_error(c, skin[part == i]) for i, c in enumerate(cones)]
        pieces: list[NDArray[np.intp]] = []
        for worst in sorted(range(len(cones)), key=errors.__getitem__, reverse=True):
            pieces = _halves(skin, edges, np.flatnonzero(part == worst), cones[worst], count - len(cones) + 1)
            if len(pieces) > 1:
                part[pieces[0]], cones[worst] = worst, _fit(skin[pieces[0]])
                for rows in pieces[1:]:
                    part[rows] = len(cones)
                    cones.append(_fit(skin[rows]))
                break
        if len(pieces) < 2:
            break
    return _placement(skin, edges, *_settle(skin, edges, part, np.array(cones)))


def place_in_parts(vertices: NDArray[np.floating], triangles: I32, part: I32) -> Placement:
    """One cone-sphere in each part, part (V,) being 0, 1, ... Raises ValueError for parts without vertices."""
    p = _checked(vertices)
    counts = np.bincount(part)
    if len(part) != len(p) or not len(counts) or counts.min() == 0:
        raise ValueError(f"part: expected a part 0 to {max(0, len(counts) - 1)} for each of {len(p)} vertices, none of them empty")
    skin = _skin(p, triangles)
    cones = np.array([_fit(skin[part == i]) for i in range(len(counts))])
    return _placement(skin, _edges(triangles), part.astype(np.int32), cones)


def _checked(vertices: NDArray[np.floating]) -> F64:
    p = np.asarray(vertices, np.float64)
    if p.ndim != 2 or p.shape[1] != 3 or not len(p):
        raise ValueError(f"vertices: expected (V, 3) with V > 0, got {p.shape}")
    if not np.isfinite(p).all():
        raise ValueError(f"vertices: vertex {int(np.argmin(np.isfinite(p).all(axis=1)))} is not finite; repair it")
    return p


def _skin(p: F64, triangles: I32) -> _Skin:
    """The mesh's vertices; normals point outwards where it encloses a volume. Areas are never 0, so that loose vertices
    count a little."""
    corner = p[triangles]
    face = 0.5 * np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    if np.einsum("fi,fi->", corner[:, 0], face) < 0.0:
        face = -face
    area = np.bincount(triangles.ravel(), np.repeat(np.linalg.norm(face, axis=1) / 3.0, 3), len(p))
    normal = np.stack([np.bincount(triangles.ravel(), np.repeat(face[:, k], 3), len(p)) for k in range(3)], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    return _Skin(p, normal, np.maximum(area, 1e-3 * max(float(area.mean()), 1e-12)))


def _edges(triangles: I32) -> I32:
    pairs = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    return np.unique(pairs, axis=0).astype(np.int32).reshape(-1, 2)


def _fit(skin: _Skin) -> F64:
    """The cone-sphere (8 numbers: ends, radii) nearest to a part of the skin."""
    centre = np.average(skin.p, axis=0, weights=skin.area)
    q, area = skin.p - centre, skin.area
    _, axes = np.linalg.eigh((q * area[:, None]).T @ q)
    best, least = np.zeros(8), np.inf
    for u in axes.T:
        s = q @ u
        rho = np.linalg.norm(q - s[:, None] * u, axis=1)
        low, high = float(s.min()), float(s.max())
        radius = float(np.average(rho, weights=area))
        middle = np.abs(s - 0.5 * (low + high)) <= max(0.25 * (high - low), 0.5 * (high - low) - 0.5 * radius)
        slope = _slope(s[middle], rho[middle], area[middle])
        at_centre = float(np.average(rho[middle], weights=area[middle])) if middle.any() else radius
        base = float(np.average(s[middle], weights=area[middle])) if middle.any() else 0.0
        for inset in product(_INSETS, _INSETS):
            a, b = low + inset[0] * radius, high - inset[1] * radius
            if a > b:
                a = b = 0.5 * (a + b)
            ends = np.maximum(0.05 * radius + 1e-9, at_centre + slope * (np.array((a, b)) - base))
            cone = np.concatenate([centre + a * u, centre + b * u, ends])
            error = _error(cone, skin)
            if error < least:
                best, least = cone, error
    return _refined(best, least, skin, (axes, q @ axes, centre))


def _refined(cone: F64, error: float, skin: _Skin, box: tuple[F64, F64, F64]) -> F64:
    """Gauss-Newton steps (Levenberg-Marquardt) on the distances, as long as the error falls and the ends stay in the
    part's box: axes (3, 3) in columns, the part's vertices (N, 3) along them, its middle."""
    axes, inside, centre = box
    low, high = inside.min(axis=0), inside.max(axis=0)
    widest = 0.6 * float(np.sort(high - low)[1])
    damping, scale = 1e-3, max(float(cone[6:].max()), 1e-12)
    for _ in range(_STEPS):
        foot, normal, d = cone_feet(cone, skin.p)
        jacobian = -np.column_stack([(1.0 - foot)[:, None] * normal, foot[:, None] * normal, 1.0 - foot, foot])
        weighted = jacobian * skin.area[:, None]
        square = jacobian.T @ weighted
        square[np.diag_indices(8)] += damping * float(np.trace(square)) / 8.0 + 1e-30
        new = cone - np.linalg.solve(square, weighted.T @ d)
        for end in (slice(0, 3), slice(3, 6)):
            new[end] = centre + axes @ np.clip((new[end] - centre) @ axes, low, high)
        new[6:] = np.clip(new[6:], 0.05 * scale, max(widest, scale))
        length = float(np.linalg.norm(new[3:6] - new[:3]))
        steep = abs(new[7] - new[6]) > 0.7 * length and length > 1e-9
        found = np.inf if steep else _error(new, skin)
        if found < error:
            gain, cone, error, damping = error - found, new, found, 0.3 * damping
            if gain < 1e-4 * error:
                break
        else:
            damping *= 10.0
    return cone


def cone_feet(cone: F64, p: F64) -> tuple[F64, F64, F64]:
    """Of points p (N, 3): where on the axis (0 to 1) the nearest ball of a cone-sphere is, the direction from there,
    and the signed distance to the surface."""
    axis = cone[3:6] - cone[:3]
    length = float(np.linalg.norm(axis))
    w = p - cone[:3]
    foot = np.zeros(len(p))
    if length > 1e-9:
        k = min(max(float(cone[7] - cone[6]) / length, -0.999), 0.999)
        x = w @ (axis / length)
        rho = np.sqrt(np.maximum(0.0, np.square(w).sum(axis=1) - x * x))
        foot = np.clip(x + k * rho / np.sqrt(1.0 - k * k), 0.0, length) / length
    away = w - foot[:, None] * axis
    distance = np.linalg.norm(away, axis=1)
    normal = away / np.maximum(distance, 1e-12)[:, None]
    return foot, normal, distance - (cone[6] + foot * (cone[7] - cone[6]))


def _misfit(cone: F64, skin: _Skin) -> F64:
    """(N,) squared distance to the surface, larger where the skin faces another way than the surface does."""
    foot, normal, d = cone_feet(cone, skin.p)
    radius = cone[6] + foot * (cone[7] - cone[6])
    turned = 1.0 - np.einsum("ni,ni->n", normal, skin.n)
    return d * d + np.square(_ALIGN * radius * turned)


def _error(cone: F64, skin: _Skin) -> float:
    return float(skin.area @ _misfit(cone, skin))


def _slope(s: F64, rho: F64, area: F64) -> float:
    """How fast radii grow along the axis, at most 0.7: a steeper end ball would swallow the other."""
    if len(s) < 3:
        return 0.0
    d = s - np.average(s, weights=area)
    spread = float(np.sum(area * d * d))
    return float(np.clip(np.sum(area * d * rho) / spread, -0.7, 0.7)) if spread > 1e-15 else 0.0


def _halves(skin: _Skin, edges: I32, rows: NDArray[np.intp], cone: F64, most: int) -> list[NDArray[np.intp]]:
    """`rows` cut across their cone's axis where half of the area is on each side; pieces that do not hang together are
    apart, at most `most` of them. Just `rows` where they are too few."""
    axis = cone[3:6] - cone[:3]
    if np.linalg.norm(axis) < 1e-9:
        q = skin.p[rows] - skin.p[rows].mean(axis=0)
        axis = np.linalg.eigh(q.T @ q)[1][:, 2]
    along: F64 = skin.p[rows] @ axis
    order = np.argsort(along, kind="stable")
    halfway = 0.5 * float(skin.area[rows].sum())
    cut = int(np.searchsorted(np.cumsum(skin.area[rows][order]), halfway))
    label = np.full(len(skin.p), -1, np.int32)
    label[rows[order[:cut]]], label[rows[order[cut:]]] = 0, 1
    large: list[NDArray[np.intp]] = []
    for k in _components(label, edges):
        piece = np.flatnonzero(label == k)
        if len(piece) >= _FEWEST:
            large.append(piece)
    large = sorted(large, key=len, reverse=True)[:most]
    if len(large) < 2:
        return [rows]
    kept = np.full(len(skin.p), -1, np.int32)
    for k, piece in enumerate(large):
        kept[piece] = k
    _spread_labels(kept, edges, rows)
    return [np.flatnonzero(kept == k) for k in range(len(large))]


def _components(label: I32, edges: I32) -> NDArray[np.int32]:
    """Makes label (V,) the same only where vertices hang together by edges between equal labels; -1 stays. Returns the
    labels in use."""
    inside = (label[edges[:, 0]] >= 0) & (label[edges[:, 0]] == label[edges[:, 1]])
    parent = np.arange(len(label), dtype=np.int32)
    _unite(parent, edges[inside])
    used = label >= 0
    label[used] = parent[used]
    return np.unique(label[used])


@compiled
def _unite(parent: I32, edges: I32) -> None:
    """Union-find: parent (V,) becomes the lowest vertex that each hangs together with."""
    for e in range(len(edges)):
        i, j = edges[e, 0], edges[e, 1]
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        while parent[j] != j:
            parent[j] = parent[parent[j]]
            j = parent[j]
        if i < j:
            parent[j] = i
        else:
            parent[i] = j
    for v in range(len(parent)):
        parent[v] = parent[parent[v]]


def _spread_labels(label: I32, edges: I32, rows: NDArray[np.intp]) -> None:
    """Vertices of `rows` without a label (-1) take a neighbour's, at last the first label."""
    mine = np.zeros(len(label), np.bool_)
    mine[rows] = True
    edges = edges[mine[edges[:, 0]] & mine[edges[:, 1]]]
    both = np.concatenate([edges, edges[:, ::-1]])
    while True:
        bare = (label[both[:, 0]] < 0) & (label[both[:, 1]] >= 0)
        if not bare.any():
            break
        label[both[bare, 0]] = label[both[bare, 1]]
    label[rows] = np.maximum(label[rows], 0)


def _settle(skin: _Skin, edges: I32, part: I32, cones: F64) -> tuple[I32, F64]:
    """Vertices to the primitive that fits best among their own and their neighbours', primitives to their vertices, as
    long as the sum of errors falls."""
    both = np.concatenate([edges, edges[:, ::-1]])
    total = sum(_error(c, skin[part == i]) for i, c in enumerate(cones))
    for _ in range(_ROUNDS):
        new, least = part.copy(), np.empty(len(skin.p))
        for i, c in enumerate(cones):
            least[part == i] = _misfit(c, skin[part == i])
        for i, c in enumerate(cones):
            near = np.unique(both[part[both[:, 1]] == i, 0])
            misfit = _misfit(c, skin[near])
            closer = near[misfit < least[near]]
            new[closer], least[near] = i, np.minimum(least[near], misfit)
        if np.bincount(new, minlength=len(cones)).min() < _FEWEST:
            break
        fitted = np.array([_fit(skin[new == i]) for i in range(len(cones))])
        error = sum(_error(c, skin[new == i]) for i, c in enumerate(fitted))
        if error >= 0.999 * total:
            break
        part, cones, total = new, fitted, error
    return part, cones


def _placement(skin: _Skin, edges: I32, part: I32, cones: F64) -> Placement:
    pairs = part[edges]
    pairs = np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0)
    limbs = Limbs(
        cones[:, :3].copy(),
        cones[:, 3:6].copy(),
        cones[:, 6].copy(),
        cones[:, 7].copy(),
        np.arange(len(cones), dtype=np.int32),
        (),
        frozenset((int(g), int(k)) for g, k in pairs),
    )
    distance = np.empty(len(skin.p))
    for i, c in enumerate(cones):
        distance[part == i] = cone_feet(c, skin.p[part == i])[2]
    return Placement(limbs, part, distance, skin.area)
