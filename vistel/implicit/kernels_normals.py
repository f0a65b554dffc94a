"""Numba kernel of the normals round moved vertices."""

# pyright: basic

from __future__ import annotations

import numba as nb
import numpy as np


@nb.njit(cache=True, nogil=True, error_model="numpy")
def update_normals(triangles, faces, start, vertices, moved, face_normal, face_mark, vertex_mark, normals):
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
                ax, ay, az = (
                    vertices[j, 0] - vertices[i, 0],
                    vertices[j, 1] - vertices[i, 1],
                    vertices[j, 2] - vertices[i, 2],
                )
                bx, by, bz = (
                    vertices[k, 0] - vertices[i, 0],
                    vertices[k, 1] - vertices[i, 1],
                    vertices[k, 2] - vertices[i, 2],
                )
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
