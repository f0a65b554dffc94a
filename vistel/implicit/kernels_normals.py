"""Numba kernel of the normals round moved vertices."""

# pyright: basic

from __future__ import annotations

import numba as nb
import numpy as np


@nb.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def face_cross(triangles, f, vertices, out):
    """Normal of a triangle, as long as twice its area."""
    i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
    x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
    ax, ay, az = vertices[j, 0] - x, vertices[j, 1] - y, vertices[j, 2] - z
    bx, by, bz = vertices[k, 0] - x, vertices[k, 1] - y, vertices[k, 2] - z
    out[f, 0], out[f, 1], out[f, 2] = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@nb.njit(cache=True, nogil=True, error_model="numpy")
def update_normals(
    triangles, faces, start, vertices, moved, face_normal, face_mark, vertex_mark, face_list, vertex_list, stamp,
    normals,
):  # fmt: skip
    """Normals of the vertices round the moved ones; marks equal to `stamp` are of this call."""
    n_faces = 0
    for m in range(len(moved)):
        for c in range(start[moved[m]], start[moved[m] + 1]):
            f = faces[c]
            if face_mark[f] != stamp:
                face_mark[f] = stamp
                face_list[n_faces] = f
                n_faces += 1
    n_vertices = 0
    for m in range(n_faces):
        f = face_list[m]
        face_cross(triangles, f, vertices, face_normal)
        for c in range(3):
            v = triangles[f, c]
            if vertex_mark[v] != stamp:
                vertex_mark[v] = stamp
                vertex_list[n_vertices] = v
                n_vertices += 1
    for m in range(n_vertices):
        v = vertex_list[m]
        nx = ny = nz = np.float32(0.0)
        for c in range(start[v], start[v + 1]):
            f = faces[c]
            if face_mark[f] != stamp:
                face_cross(triangles, f, vertices, face_normal)
            nx += face_normal[f, 0]
            ny += face_normal[f, 1]
            nz += face_normal[f, 2]
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        if length > np.float32(1e-20):
            normals[v, 0], normals[v, 1], normals[v, 2] = nx / length, ny / length, nz / length
