"""The texture of a blended joint: the two limbs' own near their ends, passing into one another between (Singh §5.1)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial import KDTree

from vistel.arrays import F64, I64, U8
from vistel.figure.making.assembly.piece import MeshPiece, closest, loops
from vistel.figure.making.source import MakingError, SourceMaterial
from vistel.geometry.smoothstep import smooth

TEXELS = 320
"""Along a side of the picture of one joint."""
INNER = 0.16
"""Radius in the picture of the border at the first limb."""
OUTER = 0.48
"""Radius in the picture of the border at the second limb."""
PLAIN = (214, 168, 138)


def coloured(
    made: MeshPiece, sides: Sequence[MeshPiece], limbs: Sequence[MeshPiece], materials: Sequence[SourceMaterial], names: str
) -> tuple[MeshPiece, U8]:
    """The new polygons of a joint with texture coordinates in a picture of their own, and that picture.

    sides: the kept polygons on either side; limbs: the two whole parts with the materials that their faces name.
    Raises MakingError where the polygons are no ring.
    """
    borders = loops(made.triangles)
    if len(borders) != 2:
        raise MakingError(
            f"{names}: the blend has {len(borders)} borders, expected one at each limb; set another zone there, or fill holes "
            "near the joint"
        )
    edge = [np.unique(np.round(s.points[np.unique(s.triangles)], 9), axis=0) for s in sides]
    distance = [[_away(made.points[b], e) for b in borders] for e in edge]
    first = 0 if distance[0][0] + distance[1][1] <= distance[0][1] + distance[1][0] else 1
    at_first, at_second = borders[first], borders[1 - first]
    place, share = _ring(made, at_first, at_second)
    uv = 0.5 + place
    made = MeshPiece(made.points, made.triangles, uv[made.triangles], made.material, made.part)
    return made, _painted(made, share, limbs, materials)


def _away(points: F64, others: F64) -> float:
    return float(KDTree(others).query(points)[0].mean())


def _ring(made: MeshPiece, inner: I64, outer: I64) -> tuple[F64, F64]:
    """(V, 2) places of vertices in a flat ring, each the mean of its neighbours' (Tutte); (V,) 0 at the inner border to
    1 at the outer one, in the same way."""
    count = len(made.points)
    a, b = made.triangles.reshape(-1), np.roll(made.triangles, -1, axis=1).reshape(-1)
    weight = 1.0 / np.maximum(np.linalg.norm(made.points[a] - made.points[b], axis=1), 1e-9)
    graph = coo_array((weight, (a, b)), shape=(count, count))
    graph = (graph + graph.T).tocsr()
    place, share = np.zeros((count, 2)), np.zeros(count)
    middle = made.points[np.concatenate([inner, outer])].mean(axis=0)
    axis = made.points[outer].mean(axis=0) - made.points[inner].mean(axis=0)
    axis /= max(float(np.linalg.norm(axis)), 1e-12)
    x = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.8 else (1.0, 0.0, 0.0))
    x /= np.linalg.norm(x)
    y = np.cross(axis, x)
    for border, radius, value in ((inner, INNER, 0.0), (outer, OUTER, 1.0)):
        p = made.points[border] - middle
        angle = _even(np.arctan2(p @ y, p @ x), made.points[border])
        place[border] = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        share[border] = value
    fixed = np.zeros(count, np.bool_)
    fixed[inner] = fixed[outer] = True
    used = np.zeros(count, np.bool_)
    used[made.triangles] = True
    free = np.flatnonzero(used & ~fixed)
    if len(free):
        degree = np.asarray(graph.sum(axis=1)).ravel()
        solve = splu((diags_array(degree[free]) - graph[free][:, free]).tocsc())
        known = np.flatnonzero(fixed)
        right = graph[free][:, known] @ np.column_stack([place[known], share[known]])
        found = solve.solve(np.asarray(right))
        place[free], share[free] = found[:, :2], found[:, 2]
    return place, share


def _even(angle: F64, points: F64) -> F64:
    """Angles that run once round a border in step with its length, turned and directed like the given ones on the whole."""
    step = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    along = np.concatenate([[0.0], np.cumsum(step)[:-1]]) / step.sum() * 2.0 * np.pi
    best: tuple[float, F64] | None = None
    for way in (1.0, -1.0):
        offset = np.angle(np.exp(1j * (angle - way * along)).mean())
        misfit = float(np.abs(np.exp(1j * angle) - np.exp(1j * (way * along + offset))).mean())
        if best is None or misfit < best[0]:
            best = misfit, way * along + offset
    assert best is not None
    return best[1]


def _painted(made: MeshPiece, share: F64, limbs: Sequence[MeshPiece], materials: Sequence[SourceMaterial]) -> U8:
    """The picture: at every texel the place on the surface, and there the colours of both limbs."""
    row, bary = _texels(made)
    inside = row >= 0
    corner = made.triangles[row[inside]]
    b = bary[inside]
    points = np.einsum("nk,nkc->nc", b, made.points[corner])
    t = smooth(np.einsum("nk,nk->n", b, share[corner]))
    colours = [colour_at(limb, points, materials) for limb in limbs]
    out = np.zeros((TEXELS, TEXELS, 3))
    out[inside] = (1.0 - t)[:, None] * colours[0] + t[:, None] * colours[1]
    nearest: Any = distance_transform_edt(~inside, return_distances=False, return_indices=True)
    return np.clip(np.round(out[nearest[0], nearest[1]]), 0, 255).astype(np.uint8)


def _texels(made: MeshPiece) -> tuple[I64, F64]:
    """(N, N) the triangle at the middle of each texel, -1 for none, first row at the top; (N, N, 3) where in it."""
    row, bary = np.full((TEXELS, TEXELS), -1), np.zeros((TEXELS, TEXELS, 3))
    corners = made.uv * TEXELS - 0.5
    for f, c in enumerate(corners):
        low = np.maximum(np.floor(c.min(axis=0)).astype(int), 0)
        high = np.minimum(np.ceil(c.max(axis=0)).astype(int) + 1, TEXELS)
        area = (c[1, 0] - c[0, 0]) * (c[2, 1] - c[0, 1]) - (c[2, 0] - c[0, 0]) * (c[1, 1] - c[0, 1])
        if abs(area) < 1e-12 or (high <= low).any():
            continue
        y, x = np.mgrid[low[1] : high[1], low[0] : high[0]]
        v = ((x - c[0, 0]) * (c[2, 1] - c[0, 1]) - (c[2, 0] - c[0, 0]) * (y - c[0, 1])) / area
        w = ((c[1, 0] - c[0, 0]) * (y - c[0, 1]) - (x - c[0, 0]) * (c[1, 1] - c[0, 1])) / area
        here = np.stack([1.0 - v - w, v, w], axis=-1)
        ok = (here >= -1e-9).all(axis=-1)
        at = TEXELS - 1 - y[ok], x[ok]
        row[at], bary[at] = f, here[ok]
    return row, bary


def colour_at(limb: MeshPiece, points: F64, materials: Sequence[SourceMaterial]) -> F64:
    """(N, 3) sRGB of a part's texture at the place of its surface nearest to each point."""
    row, share, _ = closest(points, limb.points[limb.triangles], 8)
    uv = np.einsum("nk,nkc->nc", share, limb.uv[row])
    out = np.empty((len(points), 3))
    numbers: list[int] = np.unique(limb.material[row]).tolist()
    for m in numbers:
        mine = limb.material[row] == m
        material = materials[m]
        out[mine] = material.colour or PLAIN
        painted = mine & np.isfinite(uv).all(axis=1)
        if material.picture is not None and painted.any():
            out[painted] = _bilinear(material.picture, uv[painted])
    return out


def _bilinear(picture: U8, uv: F64) -> F64:
    h, w, _ = picture.shape
    # Coordinates beyond the picture repeat it.
    u, v = uv[:, 0] - np.floor(uv[:, 0] - 1e-9), uv[:, 1] - np.floor(uv[:, 1] - 1e-9)
    x, y = np.clip(u * w - 0.5, 0, w - 1), np.clip((1.0 - v) * h - 0.5, 0, h - 1)
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    x1, y1 = np.minimum(x0 + 1, w - 1), np.minimum(y0 + 1, h - 1)
    fx, fy = (x - x0)[:, None], (y - y0)[:, None]
    p = picture.astype(np.float64)
    return (p[y0, x0] * (1 - fx) + p[y0, x1] * fx) * (1 - fy) + (p[y1, x0] * (1 - fx) + p[y1, x1] * fx) * fy
