"""The part of a skin that is moved after all else, and its normals: faces, and what hangs loose."""

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64
from vistel.figure.avatar.avatar import Mesh
from vistel.figure.moved_part_kernels import lay_offsets  # pyright: ignore[reportUnknownVariableType]


class MovedPart:
    """Vertices (F,) of a mesh that are moved after its deformation, so that a contact moves them and what they do stays."""

    def __init__(self, mesh: Mesh, vertex: NDArray[np.integer]) -> None:
        self.vertex = vertex.astype(np.int32)
        moving = np.zeros(len(mesh.vertices), np.bool_)
        moving[self.vertex] = True
        self._near = np.unique(mesh.triangles[moving[mesh.triangles].any(axis=1)]).astype(np.int32)
        near = np.zeros(len(mesh.vertices), np.bool_)
        near[self._near] = True
        self._triangles = np.ascontiguousarray(mesh.triangles[near[mesh.triangles].any(axis=1)])
        self._index = np.full(len(mesh.vertices), -1, np.int32)
        self._index[self._near] = np.arange(len(self._near), dtype=np.int32)

    def lay(self, vertices: F32, normals: F32, offsets: F32, rotation: F64) -> None:
        """Move a posed skin (V, 3) by rotation (3, 3) @ offsets (F, 3) [m], in place, and make the normals there anew."""
        lay_offsets(vertices, normals, self.vertex, offsets, rotation, self._triangles, self._near, self._index)
