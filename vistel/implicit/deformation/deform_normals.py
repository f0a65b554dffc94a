"""Vertex normals made again where vertices moved, and only there."""

import numpy as np

from vistel.arrays import F32, I32
from vistel.implicit.deformation.normals_kernels import (
    build_fans,  # pyright: ignore[reportUnknownVariableType]
    update_normals,  # pyright: ignore[reportUnknownVariableType]
)


class NormalUpdate:
    """Area-weighted normals of the triangles round moved vertices. triangles: (F, 3), vertices: how many
    there are."""

    def __init__(self, triangles: I32, vertices: int) -> None:
        self._start, self._fan = build_fans(np.ascontiguousarray(triangles, np.int32).reshape(-1, 3), vertices)
        self._mark, self._touched = np.zeros(vertices, np.uint8), np.zeros(vertices, np.int32)

    def update(self, vertices: F32, normals: F32, moved: I32) -> None:
        """Rewrite the normals (V, 3) of every vertex of a triangle with a vertex of `moved` (N,). A normal
        without area round it stays."""
        update_normals(self._start, self._fan, vertices, moved, self._mark, self._touched, normals)
