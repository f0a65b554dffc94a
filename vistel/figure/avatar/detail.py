"""Levels of detail: the same surface with fewer vertices, for figures that are small in the picture.

A vertex is merged into a neighbour where that costs least (quadric error, Garland and Heckbert 1997), so a coarser
level keeps a part of the vertices where they are. Vertices on a texture seam move along it, both sides at once: the
surface stays closed and the texture where it was.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.avatar.detail_kernels import (
    cheapest,  # pyright: ignore[reportUnknownVariableType]
    collapse,  # pyright: ignore[reportUnknownVariableType]
    face_quadrics,  # pyright: ignore[reportUnknownVariableType]
    seam_quadrics,  # pyright: ignore[reportUnknownVariableType]
)

_AT_ONCE = 0.25
"""Share of the vertices that may be removed before costs are computed anew."""
_LONGEST = 2.2
"""Longest edge, as a multiple of that of equal triangles: flat parts must still bend with the joints."""


def with_levels(avatar: Avatar, triangles: Sequence[int]) -> Avatar:
    """`avatar` with a coarser level for each number of triangles of its skin, the eyeballs reduced by the same share."""
    levels: list[Avatar] = []
    last = avatar
    for count in triangles:
        share = count / len(last.mesh.triangles)
        eyes = tuple(coarser(eye, round(share * len(eye.triangles))) for eye in last.eyeballs)
        last = replace(last, mesh=coarser(last.mesh, count), eyeballs=eyes, coarser=())
        levels.append(last)
    return replace(avatar, coarser=tuple(levels))


def coarser(mesh: Mesh, triangles: int, importance: F64 | None = None) -> Mesh:
    """`mesh` with about `triangles` triangles; more where its shape or its seams allow no fewer. importance: (V,) by how much more
    a distance from the surface counts at each vertex; infinite: it stays. None: all alike.

    The result is closed and manifold if `mesh` is; its vertices, texture coordinates and limbs are a
    subset of the mesh's.
    """
    p = mesh.vertices.astype(np.float64)
    tri, corner = mesh.triangles.astype(np.int64), mesh.corner_triangles.astype(np.int64)
    quadric, weight = np.zeros((len(p), 10)), np.zeros(len(p))
    face_quadrics(p, tri, quadric, weight)
    seam_quadrics(p, tri, seams(tri, corner) | borders(tri), quadric)
    stays = np.zeros(len(p), np.bool_)
    if importance is not None:
        stays = np.isinf(importance)
        quadric *= np.square(np.where(stays, 1.0, importance))[:, None]
    to, cost = np.empty(len(p), np.int64), np.empty(len(p))
    longest = _LONGEST * _mean_edge(p, tri, triangles)
    living = len(tri)
    while living > triangles:
        start, fan = _fans(tri, len(p))
        cheapest(p, tri, corner, start, fan, quadric, weight, longest * longest, to, cost)
        can = np.flatnonzero((to >= 0) & ~stays)
        order = can[np.argsort(cost[can], kind="stable")]
        order = order[: max(1, int(_AT_ONCE * len(np.unique(tri))))]
        before = living
        living = int(collapse(order, to, cost, tri, corner, start, fan, quadric, weight, triangles))
        tri, corner = tri[tri[:, 0] >= 0], corner[tri[:, 0] >= 0]
        if living == before:
            break
    return of_triangles(mesh, tri, corner)


def _mean_edge(p: F64, tri: I64, triangles: int) -> float:
    """Edge [m] of `triangles` equilateral triangles of the same area as the mesh."""
    corners = p[tri]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    return float(np.sqrt(4.0 / np.sqrt(3.0) * area / triangles))


def seams(tri: I64, corner: I64) -> NDArray[np.uint8]:
    """(F, 3) 1 where the edge from corner k to k + 1 of a triangle has another texture on its other side."""
    ends = np.stack([tri, np.roll(tri, -1, axis=1)], axis=-1).reshape(-1, 2)
    drawn = np.stack([corner, np.roll(corner, -1, axis=1)], axis=-1).reshape(-1, 2)
    swap = ends[:, 0] > ends[:, 1]
    ends[swap], drawn[swap] = ends[swap][:, ::-1], drawn[swap][:, ::-1]
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    same = np.all(ends[order][1:] == ends[order][:-1], axis=1)
    differs = np.any(drawn[order][1:] != drawn[order][:-1], axis=1)
    out = np.zeros(len(ends), np.uint8)
    out[order[1:][same & differs]] = out[order[:-1][same & differs]] = 1
    return out.reshape(-1, 3)


def borders(tri: I64) -> NDArray[np.uint8]:
    """(F, 3) 1 where the edge from corner k to k + 1 of a triangle has nothing on its other side."""
    ends = np.sort(np.stack([tri, np.roll(tri, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    _, edge, uses = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    return (uses[edge.ravel()] == 1).astype(np.uint8).reshape(-1, 3)


def _fans(tri: I64, count: int) -> tuple[I64, I64]:
    """The triangles fan[start[u] : start[u + 1]] round each vertex u."""
    flat = tri.reshape(-1)
    start = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=count))])
    return start.astype(np.int64), np.argsort(flat, kind="stable") // 3


def of_triangles(mesh: Mesh, tri: I64, corner: I64) -> Mesh:
    """The part of `mesh` that these triangles use; tri, corner: (F, 3) as its `triangles` and `corner_triangles`."""
    vertices, triangles = np.unique(tri, return_inverse=True)
    corners, corner_triangles = np.unique(corner, return_inverse=True)
    place = np.full(len(mesh.vertices), -1, np.int32)
    place[vertices] = np.arange(len(vertices), dtype=np.int32)
    return Mesh(
        mesh.vertices[vertices],
        triangles.reshape(-1, 3).astype(np.int32),
        place[mesh.corner_vertex[corners]],
        mesh.uv[corners],
        corner_triangles.reshape(-1, 3).astype(np.int32),
        mesh.limb[vertices],
        None if mesh.bone is None else mesh.bone[vertices],
        None if mesh.weight is None else mesh.weight[vertices],
        tuple(t.of(place) for t in mesh.targets),
        None if mesh.hangs is None else mesh.hangs[vertices],
    )
