"""Vertex normals made again where vertices moved, and only there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vistel.implicit.kernels_normals import update_normals  # pyright: ignore[reportUnknownVariableType]

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]


class NormalUpdate:
    """Area-weighted normals of the triangles round moved vertices. triangles: (F, 3), vertices: how many
    there are."""

    def __init__(self, triangles: I32, vertices: int) -> None:
        self._triangles = np.ascontiguousarray(triangles, np.int32)
        flat = self._triangles.reshape(-1)
        self._faces = (np.argsort(flat, kind="stable") // 3).astype(np.int32)
        self._start = np.zeros(vertices + 1, np.int32)
        self._start[1:] = np.cumsum(np.bincount(flat, minlength=vertices))
        self._face_normal = np.zeros((len(triangles), 3), np.float32)
        self._face_mark, self._vertex_mark = np.zeros(len(triangles), np.int32), np.zeros(vertices, np.int32)
        self._face_list, self._vertex_list = np.zeros(len(triangles), np.int32), np.zeros(vertices, np.int32)
        self._stamp = 0

    def update(self, vertices: F32, normals: F32, moved: I32) -> None:
        """Rewrite the normals (V, 3) of every vertex of a triangle with a vertex of `moved` (N,)."""
        self._stamp += 1
        update_normals(
            self._triangles, self._faces, self._start, vertices, moved, self._face_normal, self._face_mark,
            self._vertex_mark, self._face_list, self._vertex_list, self._stamp, normals,
        )  # fmt: skip
