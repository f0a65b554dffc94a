"""Vertex normals made again where vertices moved, and only there."""

from __future__ import annotations

import numba as nb
import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]


class NormalUpdate:
    """Area-weighted normals of the triangles round moved vertices. triangles: (F, 3), vertices: how many there are."""

    def __init__(self, triangles: I32, vertices: int) -> None:
        self._triangles = np.ascontiguousarray(triangles, np.int32)
        flat = self._triangles.reshape(-1)
        self._faces = (np.argsort(flat, kind="stable") // 3).astype(np.int32)
        self._start = np.zeros(vertices + 1, np.int32)
        self._start[1:] = np.cumsum(np.bincount(flat, minlength=vertices))
        self._face_normal = np.zeros((len(triangles), 3), np.float32)
        self._face_mark, self._vertex_mark = np.zeros(len(triangles), np.uint8), np.zeros(vertices, np.uint8)

    def update(self, vertices: F32, normals: F32, moved: NDArray[np.uint8]) -> None:
        """Rewrite the normals (V, 3) of every vertex of a triangle with a moved vertex."""
        _update(
            self._triangles, self._faces, self._start, vertices, moved, self._face_normal, self._face_mark,
            self._vertex_mark, normals,
        )  # fmt: skip


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _update(triangles, faces, start, vertices, moved, face_normal, face_mark, vertex_mark, normals):  # pyright: ignore
    face_mark[:] = 0
    vertex_mark[:] = 0
    for v in range(len(moved)):
        if moved[v]:
            for f in range(start[v], start[v + 1]):
                face_mark[faces[f]] = 1
    for f in range(len(triangles)):
        if face_mark[f]:
            for c in range(3):
                vertex_mark[triangles[f, c]] = 1
    for v in range(len(vertex_mark)):
        if not vertex_mark[v]:
            continue
        nx = ny = nz = np.float32(0.0)
        for m in range(start[v], start[v + 1]):
            f = faces[m]
            if face_mark[f] < 2:
                i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
                ax, ay, az = vertices[j, 0] - vertices[i, 0], vertices[j, 1] - vertices[i, 1], vertices[j, 2] - vertices[i, 2]
                bx, by, bz = vertices[k, 0] - vertices[i, 0], vertices[k, 1] - vertices[i, 1], vertices[k, 2] - vertices[i, 2]
                face_normal[f, 0] = ay * bz - az * by
                face_normal[f, 1] = az * bx - ax * bz
                face_normal[f, 2] = ax * by - ay * bx
                face_mark[f] = 2
            nx += face_normal[f, 0]
            ny += face_normal[f, 1]
            nz += face_normal[f, 2]
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        if length > np.float32(1e-20):
            normals[v, 0], normals[v, 1], normals[v, 2] = nx / length, ny / length, nz / length
