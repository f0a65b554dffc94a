"""The coarser levels of detail of people from files, whatever their meshes are like."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from vistel.figure.avatar.avatar import Avatar, Mesh, Target
from vistel.figure.avatar.detail import with_levels

LEVELS = (6_000, 2_600)
"""Triangles of the coarser levels of detail, as the built-in people have."""
_WORTH = 0.8
"""Share of the triangles that may stay for another level to be worth it."""


def with_coarser(avatar: Avatar, *, manifold: bool = True) -> Avatar:
    """The avatar with its coarser levels, one for each of LEVELS: which is drawn goes by their order, so a mesh that has no
    more triangles than a level asks for is that level itself. manifold: whether at most two faces meet at every edge of
    the mesh; where more do, the coarser levels are cut apart, which bending does not open."""
    at = avatar if manifold else replace(avatar, mesh=cut_apart(avatar.mesh))
    levels: list[Avatar] = []
    for count in LEVELS:
        if count < _WORTH * len(at.mesh.triangles):
            at = with_levels(at, [count]).coarser[0]
        levels.append(replace(at, coarser=()))
    return replace(avatar, coarser=tuple(levels))


def cut_apart(mesh: Mesh) -> Mesh:
    """The mesh with vertices doubled until it is manifold: faces stay together where two, and no more, of the same side
    share an edge."""
    tri = mesh.triangles.astype(np.int64)
    corner = np.arange(3 * len(tri)).reshape(-1, 3)
    start, end = tri.reshape(-1), np.roll(tri, -1, axis=1).reshape(-1)
    first, second = corner.reshape(-1), np.roll(corner, -1, axis=1).reshape(-1)
    key = np.minimum(start, end) * len(mesh.vertices) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    _, begins, uses = np.unique(key[order], return_index=True, return_counts=True)
    a, b = order[begins[uses == 2]], order[begins[uses == 2] + 1]
    opposite = start[a] == end[b]
    a, b = a[opposite], b[opposite]
    ends = np.concatenate([first[a], second[a]]), np.concatenate([second[b], first[b]])
    size = 3 * len(tri)
    new = connected_components(coo_array((np.ones(len(ends[0])), ends), shape=(size, size)), directed=False)[1]
    old = np.zeros(new.max() + 1, np.int64)
    old[new] = tri.reshape(-1)
    pairs, drawn = np.unique(np.column_stack([new, mesh.corner_triangles.reshape(-1)]), axis=0, return_inverse=True)

    return Mesh(
        mesh.vertices[old],
        new.reshape(-1, 3).astype(np.int32),
        pairs[:, 0].astype(np.int32),
        mesh.uv[pairs[:, 1]],
        drawn.reshape(-1, 3).astype(np.int32),
        mesh.limb[old],
        None if mesh.bone is None else mesh.bone[old],
        None if mesh.weight is None else mesh.weight[old],
        tuple(_doubled(t, old, len(mesh.vertices)) for t in mesh.targets),
    )


def _doubled(target: Target, old: NDArray[np.int64], count: int) -> Target:
    """A target of the mesh whose vertex k was old[k]."""
    whole = np.zeros((count, 3), np.float32)
    whole[target.vertex] = target.offset
    there = np.zeros(count, np.bool_)
    there[target.vertex] = True
    vertex = np.flatnonzero(there[old])
    return Target(target.name, vertex.astype(np.int32), whole[old[vertex]])
