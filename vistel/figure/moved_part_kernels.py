"""Offsets laid on a posed skin, and the normals there."""

# pyright: basic, reportCallIssue=false

import numpy as np

from vistel.jit.kernel_jit import compiled


@compiled(nogil=True)
def lay_offsets(vertices, normals, vertex, offset, rotation, triangles, near, index):
    """Move vertices `vertex` (F,) of a skin (V, 3) by rotation (3, 3) @ offset (F, 3), in place, and make the normals of the
    vertices `near` (N,) anew. triangles: (T, 3) all that touch those; index: (V,) place in `near`, -1 none."""
    r = rotation.astype(np.float32)
    for k in range(len(vertex)):
        x, y, z = offset[k, 0], offset[k, 1], offset[k, 2]
        if x == 0.0 and y == 0.0 and z == 0.0:
            continue
        v = vertex[k]
        for i in range(3):
            vertices[v, i] += r[i, 0] * x + r[i, 1] * y + r[i, 2] * z
    total = np.zeros((len(near), 3), np.float32)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ux, uy, uz = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2]
        wx, wy, wz = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2]
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        for v in (a, b, c):
            k = index[v]
            if k >= 0:
                total[k, 0] += nx
                total[k, 1] += ny
                total[k, 2] += nz
    for k in range(len(near)):
        x, y, z = total[k, 0], total[k, 1], total[k, 2]
        length = np.sqrt(x * x + y * y + z * z)
        if length > 1e-12:
            normals[near[k], 0], normals[near[k], 1], normals[near[k], 2] = x / length, y / length, z / length
