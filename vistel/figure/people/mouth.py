"""The inside of a mouth: the skin cut open along the line between the lips, and a bag behind it with two rows of teeth, gums,
a palate and a tongue. Reference person, metres, model frame.

The bag closes the surface again, so that it stays one closed manifold; at rest the lips' edges lie on each other.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.figure.people.head import MOUTH_Y

HALF = 0.0222
"""From the middle of the mouth to where the cut ends."""
_FRONT = 0.06
"""The lips are in front of this z [m]."""
_NEAR = 0.012
"""The lips are no farther than this from the line between them, and reach so far beyond its ends [m]."""
_APART = 6e-5
"""Between the lips' edges at rest [m]."""
_SNAP = 0.0005
"""A vertex so close to the line is moved onto it [m]."""

# Colours inside the mouth, sRGB 0..255.
_LIP = (132.0, 58.0, 56.0)
_GUM = (150.0, 72.0, 70.0)
_TOOTH = (226.0, 217.0, 198.0)
_TONGUE = (150.0, 74.0, 72.0)
_DARK = (58.0, 20.0, 20.0)  # behind the teeth
_THROAT = (14.0, 5.0, 5.0)

# Rings of the bag from the lips' edges inwards: how far behind the edge, how far above the line between the lips (upper half) and
# below it (lower half) [mm], how wide for the mouth's width, colours of both halves.
_RINGS = (
    (2.5, 0.5, 2.5, -0.6, 1.00, _LIP, _LIP),
    (6.0, 2.0, 6.0, -2.4, 0.99, _LIP, _LIP),
    (7.6, 7.2, 8.0, -8.6, 0.98, _GUM, _GUM),
    (9.0, 7.4, 11.0, -9.0, 0.97, _GUM, _GUM),
    (9.2, 6.2, 11.2, -7.6, 0.96, _TOOTH, _TOOTH),
    (9.0, -3.2, 11.6, -3.4, 0.95, _TOOTH, _TOOTH),
    (10.6, -2.8, 13.4, -3.6, 0.92, _DARK, _DARK),
    (12.4, 5.6, 14.2, -6.4, 0.90, _DARK, _TONGUE),
    (20.0, 8.6, 20.0, -3.0, 0.84, _DARK, _TONGUE),
    (32.0, 8.4, 32.0, -1.6, 0.76, _THROAT, _DARK),
    (40.0, 3.0, 40.0, -4.0, 0.66, _THROAT, _THROAT),
)
_TEETH_MM = (4.2, 11.6, 18.2)
"""Where teeth meet, to either side."""


@dataclass(frozen=True, eq=False)
class Mouth:
    """bag, face: the first vertex and the first triangle of the bag; all after them are its own, and its triangles begin at the
    lips' edges. colour: (V, 3) sRGB 0..255 of what lies inside, zero elsewhere."""

    bag: int
    face: int
    colour: F64


def line(x: F64) -> F64:
    """(N,) height of the line between the lips."""
    return MOUTH_Y + 0.0002 + 0.0008 * (x / 0.026) ** 2


def open_mouth(vertices: F64, triangles: I64) -> tuple[F64, I64, Mouth]:
    """The skin (V, 3), (T, 3) with its mouth cut open and the bag behind it. Raises ValueError where there are no lips."""
    v, t, on = _along(vertices, triangles)
    chain = _chain(v, t, on)
    middle = chain[1:-1]
    lower = chain.copy()
    lower[1:-1] = len(v) + np.arange(len(middle))
    new = np.arange(len(v) + len(middle))
    new[middle] = lower[1:-1]
    below = np.isin(t, middle).any(axis=1) & (_height(v)[t].sum(axis=1) < 0.0)
    t[below] = new[t[below]]
    v = np.concatenate((v, v[middle]))
    # Ever so little apart, so that nobody who joins what lies in one place sews the mouth up.
    v[middle, 1] += 0.5 * _APART
    v[-len(middle) :, 1] -= 0.5 * _APART
    bag, faces, colour = _bag(v, chain, lower)
    out = np.zeros((len(v) + len(bag), 3))
    out[np.concatenate((chain, lower[1:-1]))] = _LIP
    out[len(v) :] = colour
    return np.concatenate((v, bag)), np.concatenate((t, faces)), Mouth(len(v), len(t), out)


def shade(p: F64, colour: F64) -> F64:
    """(N, 3) colours of points on the bag: the gaps between teeth, darker towards the corners of the mouth."""
    x = 1e3 * np.abs(p[:, 0])
    tooth = np.clip((colour.min(axis=1) - 110.0) / 60.0, 0.0, 1.0)
    gap = np.exp(-((1e3 * p[:, 0] / 0.35) ** 2))
    for at in _TEETH_MM:
        gap = np.maximum(gap, np.exp(-(((x - at - 4.2) / 0.35) ** 2)))
    light = (1.0 - 0.5 * tooth * gap) * (1.0 - 0.55 * np.clip((x - 9.0) / 13.0, 0.0, 1.0))
    return colour * light[:, None]


def _height(v: F64) -> F64:
    """(V,) above the line between the lips; 0 on it."""
    return v[:, 1] - line(v[:, 0])


def _along(vertices: F64, triangles: I64) -> tuple[F64, I64, NDArray[np.bool_]]:
    """The skin with vertices all along the line: which ones are."""
    v, t = vertices.copy(), triangles.copy()
    height = _height(v)
    lips = (np.abs(v[:, 0]) < HALF + _NEAR) & (np.abs(height) < _NEAR) & (v[:, 2] > _FRONT)
    snapped = lips & (np.abs(height) < _SNAP) & (np.abs(v[:, 0]) <= HALF)
    v[snapped, 1] = line(v[snapped, 0])
    height[snapped] = 0.0
    edges = np.unique(np.sort(np.concatenate((t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]])), axis=1), axis=0)
    a, b = edges[lips[edges].all(axis=1) & (height[edges[:, 0]] * height[edges[:, 1]] < 0.0)].T
    share = height[a] / (height[a] - height[b])
    cut = v[a] + share[:, None] * (v[b] - v[a])
    near = np.abs(cut[:, 0]) <= HALF
    a, b, cut = a[near], b[near], cut[near]
    cut[:, 1] = line(cut[:, 0])
    place = {(int(i), int(j)): len(v) + k for k, (i, j) in enumerate(zip(a, b, strict=True))}
    faces: list[tuple[int, ...]] = []
    for face in t.tolist():
        faces += _split(face, [place.get((min(face[k], face[k - 2]), max(face[k], face[k - 2]))) for k in range(3)])
    on = np.concatenate((snapped, np.ones(len(cut), np.bool_)))
    return np.concatenate((v, cut)), np.array(faces, np.int64), on


def _split(face: list[int], cut: list[int | None]) -> list[tuple[int, ...]]:
    """A triangle whose edge from corner k to the next has the new vertex cut[k], or none."""
    count = sum(c is not None for c in cut)
    if count == 0:
        return [(face[0], face[1], face[2])]
    if count == 1:
        k = next(k for k in range(3) if cut[k] is not None)
        a, b, c = (face[(k + j) % 3] for j in range(3))
        m = cut[k]
        assert m is not None
        return [(a, m, c), (m, b, c)]
    k = next(k for k in range(3) if cut[k] is None)
    # The edge from a to b is whole; c is alone on its side.
    a, b, c = (face[(k + j) % 3] for j in range(3))
    m, n = cut[(k + 1) % 3], cut[(k + 2) % 3]
    assert m is not None and n is not None
    return [(a, b, m), (a, m, n), (n, m, c)]


def _chain(v: F64, t: I64, on: NDArray[np.bool_]) -> I64:
    """The vertices on the line from the person's right to their left, each joined to the next by an edge."""
    edges = np.concatenate((t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]))
    edges = edges[on[edges].all(axis=1)]
    after = dict[int, int]()
    for a, b in edges[v[edges[:, 0], 0] < v[edges[:, 1], 0]].tolist():
        if a not in after or v[b, 0] < v[after[a], 0]:
            after[a] = b
    best: list[int] = []
    for start in sorted(after, key=lambda k: float(v[k, 0])):
        walk = [start]
        while walk[-1] in after:
            walk.append(after[walk[-1]])
        if len(walk) > len(best):
            best = walk
    if len(best) < 5 or v[best[0], 0] > -0.6 * HALF or v[best[-1], 0] < 0.6 * HALF:
        raise ValueError("the skin has no line between lips that it could be cut along")
    return np.array(best, np.int64)


def _bag(v: F64, upper: I64, lower: I64) -> tuple[F64, I64, F64]:
    """Vertices, triangles and colours of the bag behind the loop of both lips' edges."""
    edge = v[upper]
    across = edge[:, 0] / max(abs(edge[0, 0]), abs(edge[-1, 0]))
    tall = 0.12 + 0.88 * np.sqrt(np.maximum(0.0, 1.0 - across * across))
    loop = np.concatenate((upper, lower[1:-1][::-1]))
    # Towards the corners a ring draws together, so that cheeks keep their thickness.
    places: list[F64] = []
    colours: list[F64] = []
    for back_up, up, back_down, down, wide, above, under in _RINGS:
        roof, floor = edge.copy(), edge.copy()
        for ring, back, height in ((roof, back_up, up), (floor, back_down, down)):
            ring[:, 0] *= wide
            ring[:, 1] += 1e-3 * height * tall
            ring[:, 2] -= 1e-3 * back * (0.35 + 0.65 * tall)
        places.append(np.concatenate((roof, floor[1:-1][::-1])))
        colours.append(np.concatenate((np.tile(above, (len(roof), 1)), np.tile(under, (len(floor) - 2, 1)))))
    count, rings = len(loop), len(_RINGS)
    index = np.concatenate((loop, len(v) + np.arange(count * rings))).reshape(rings + 1, count)
    faces: list[tuple[int, int, int]] = []
    for a, b in pairwise(index):
        for k in range(count):
            n = (k + 1) % count
            faces += [(a[k], b[k], b[n]), (a[k], b[n], a[n])]
    # The end: each of the roof joined to that of the floor below it.
    last, m = index[-1], len(upper)
    under = np.concatenate(([last[0]], last[m:][::-1], [last[m - 1]]))
    for k in range(m - 1):
        for face in ((last[k], under[k], under[k + 1]), (last[k], under[k + 1], last[k + 1])):
            if len(set(face)) == 3:
                faces.append(face)
    return np.concatenate(places), np.array(faces, np.int64), np.concatenate(colours)
