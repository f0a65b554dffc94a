"""A polymesh as the cells of a regular grid that it fills."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from vistel.arrays import F64, I32, I64

ALONG = 40
"""Cells along a mesh's longest side."""
MOST_SAMPLES = 400_000


@dataclass(frozen=True)
class Cells:
    """index: (N, 3) of the filled cells; border: (N,) those that the surface runs through; low: (3,) corner of the grid [m];
    size: of a cell [m]; points: (P, 3) on the surface [m], and cell: (P,) which of the N each is in."""

    index: I64
    border: NDArray[np.bool_]
    low: F64
    size: float
    points: F64
    cell: I64

    @property
    def middles(self) -> F64:
        """(N, 3) of the cells [m]."""
        return self.low + (self.index + 0.5) * self.size

    @property
    def filled(self) -> F64:
        """(N,) share of each cell that is taken to be inside."""
        return np.where(self.border, 0.5, 1.0)


def surface_points(vertices: F64, triangles: I32, spacing: float) -> F64:
    """(N, 3) points on the faces, no further apart than about `spacing` [m]: each face cut into equal ones."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    longest = np.sqrt(np.max([((b - a) ** 2).sum(1), ((c - b) ** 2).sum(1), ((a - c) ** 2).sum(1)], axis=0))
    cuts = np.clip(np.ceil(longest / spacing), 1, 400).astype(np.int64)
    while (cuts * (cuts + 1) // 2).sum() > MOST_SAMPLES and (cuts > 1).any():
        cuts = np.maximum(1, cuts * 3 // 4)
    out: list[F64] = []
    numbers: list[int] = np.unique(cuts).tolist()
    for n in numbers:
        rows = cuts == n
        i, j = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
        u, v = ((x[i + j < n] + 1.0 / 3.0) / n for x in (i, j))
        corner = np.stack([a[rows], b[rows], c[rows]], axis=1)
        out.append(np.einsum("kc,ncx->nkx", np.stack([1.0 - u - v, u, v], axis=1), corner).reshape(-1, 3))
    return np.concatenate(out)


def cells_of(vertices: F64, triangles: I32) -> Cells:
    """The cells on the faces and those that the faces shut in; of an open mesh only the former."""
    low, high = vertices[triangles].min(axis=(0, 1)), vertices[triangles].max(axis=(0, 1))
    size = max(float((high - low).max()) / ALONG, 1e-5)
    shape = np.maximum(1, np.ceil((high - low) / size - 1e-6).astype(np.int64))
    low = 0.5 * (low + high) - 0.5 * shape * size
    points = surface_points(vertices, triangles, 0.6 * size)
    at = np.clip(((points - low) / size).astype(np.int64), 0, shape - 1)
    border = np.zeros(tuple(shape + 2), np.bool_)
    border[tuple((at + 1).T)] = True
    outside: Any = ndimage.label(~border)
    filled = np.asarray(outside[0] != outside[0][0, 0, 0])[1:-1, 1:-1, 1:-1]
    index = np.argwhere(filled)
    number = np.full(tuple(shape), -1, np.int64)
    number[tuple(index.T)] = np.arange(len(index))
    return Cells(index, border[1:-1, 1:-1, 1:-1][tuple(index.T)], low, size, points, number[tuple(at.T)])
