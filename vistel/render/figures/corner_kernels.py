"""Drawn vertices of a posed mesh: one for each corner that the texture's seams part."""

# pyright: basic

from vistel.jit.kernel_jit import compiled


@compiled(nogil=True)
def lay_corners(vertices, normals, corner, rows):
    """Into rows (n, 6): place and normal of the vertex (V, 3) that each of `corner` (n,) is of."""
    for k in range(len(corner)):
        v = corner[k]
        for axis in range(3):
            rows[k, axis] = vertices[v, axis]
            rows[k, 3 + axis] = normals[v, axis]
