"""From the field to a closed triangle mesh: marching cubes on a grid that is finer at head and hands."""

from __future__ import annotations

from typing import Any

import numpy as np
from skimage import measure

from vistel.arrays import F64, I64
from vistel.figure.people.field import Solid, boxes
from vistel.figure.people.field_kernels import field_block, field_block_rows
from vistel.implicit.constants import THRESHOLD

_BLOCK = 10
_measure: Any = measure


def graded_axis(spans: list[tuple[float, float]], last: float) -> F64:
    """Grid planes: from each span's start to the next start (or `last`) in steps of about its cell size [m]."""
    edges = [start for start, _ in spans] + [last]
    parts: list[F64] = []
    for (start, cell), end in zip(spans, edges[1:], strict=True):
        n = max(1, round((end - start) / cell))
        parts.append(np.linspace(start, end, n, endpoint=False))
    return np.append(np.concatenate(parts), last)


def polygonise(solid: Solid, axes: tuple[F64, F64, F64]) -> tuple[F64, I64]:
    """Vertices (V, 3) [m] and outward triangles (F, 3) of F = T on the grid, to about a fifth of a cell.

    Closed if the grid holds the whole surface. Raises ValueError when there is no surface on the grid.
    """
    xs, ys, zs = axes
    low, high = boxes(solid.rows)
    vertices: list[F64] = []
    triangles: list[I64] = []
    base = 0
    for i in range(0, len(xs) - 1, _BLOCK):
        bx = xs[i : i + _BLOCK + 1]
        in_x = (low[:, 0] <= bx[-1]) & (high[:, 0] >= bx[0])
        for j in range(0, len(ys) - 1, _BLOCK):
            by = ys[j : j + _BLOCK + 1]
            in_xy = in_x & (low[:, 1] <= by[-1]) & (high[:, 1] >= by[0])
            if not in_xy.any():
                continue
            for k in range(0, len(zs) - 1, _BLOCK):
                bz = zs[k : k + _BLOCK + 1]
                near = in_xy & (low[:, 2] <= bz[-1]) & (high[:, 2] >= bz[0])
                if not near.any():
                    continue
                active = field_block_rows(
                    solid.rows,
                    solid.tables,
                    np.flatnonzero(near),
                    np.array((bx[0], by[0], bz[0])),
                    np.array((bx[-1], by[-1], bz[-1])),
                )
                if not len(active):
                    continue
                block = np.empty((len(bx), len(by), len(bz)), np.float32)
                if not field_block(solid.rows, solid.tables, active, bx, by, bz, block):
                    continue
                # No sample exactly on the surface: each crossing then lies inside an edge and cannot degenerate.
                block[np.abs(block - THRESHOLD) < 1e-5] = THRESHOLD + 1e-5
                v, t, _, _ = _measure.marching_cubes(block, THRESHOLD, gradient_direction="ascent")
                vertices.append(v + np.array((i, j, k)))
                triangles.append(t.astype(np.int64) + base)
                base += len(v)
    if not vertices:
        raise ValueError("the field nowhere reaches the threshold on this grid")
    # Blocks share their border samples, hence compute the same crossings there: weld them by grid coordinate.
    grid = np.concatenate(vertices)
    _, first, index = np.unique(np.round(grid * 1048576.0).astype(np.int64), axis=0, return_index=True, return_inverse=True)
    grid = grid[first]
    faces = index.reshape(-1)[np.concatenate(triangles)]
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    # Crossings keep clear of the samples: a mesh without slivers can be reduced; the caller projects it later.
    whole = np.floor(grid)
    part = grid - whole
    grid = whole + np.where(part > 0.0, np.clip(part, 0.2, 0.8), 0.0)
    out = np.stack([np.interp(grid[:, c], np.arange(len(axes[c])), axes[c]) for c in range(3)], axis=1)
    return out, faces
