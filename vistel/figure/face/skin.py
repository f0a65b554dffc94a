"""A face on the mesh of a figure."""

import numpy as np

from vistel.arrays import F32, F64
from vistel.figure.avatar.avatar import Mesh
from vistel.figure.face.landmarks import Landmarks
from vistel.figure.face.rules import FaceRules
from vistel.figure.face.shape import Expression, FaceShape
from vistel.figure.face.shape_kernels import lay_expression  # pyright: ignore[reportUnknownVariableType]


class FaceSkin:
    """Adds expressions to a posed skin after its deformation, so that a contact moves a cheek and the smile stays."""

    def __init__(self, mesh: Mesh, marks: Landmarks, rules: FaceRules | None = None) -> None:
        self.shape = FaceShape(mesh.vertices, marks, rules, mesh.triangles, mesh.targets)
        self.vertex = self.shape.vertex.astype(np.int32)
        moving = np.zeros(len(mesh.vertices), np.bool_)
        moving[self.vertex] = True
        first = mesh.triangles[moving[mesh.triangles].any(axis=1)]
        self._near = np.unique(first).astype(np.int32)
        near = np.zeros(len(mesh.vertices), np.bool_)
        near[self._near] = True
        self._triangles = np.ascontiguousarray(mesh.triangles[near[mesh.triangles].any(axis=1)])
        self._index = np.full(len(mesh.vertices), -1, np.int32)
        self._index[self._near] = np.arange(len(self._near), dtype=np.int32)

    def lay(self, vertices: F32, normals: F32, head: F64, e: Expression) -> None:
        """Move a posed skin (V, 3) in place. head: (3, 3) rotation of the head joint."""
        lay_expression(vertices, normals, self.vertex, self.shape.offsets(e), head, self._triangles, self._near, self._index)

    def room_offsets(self, head: F64, e: Expression, out: F32) -> None:
        """The same as offsets (V, 3) in the room, for engines that add them elsewhere; out: zero where no face is."""
        out[self.vertex] = self.shape.offsets(e) @ head.T.astype(np.float32)
