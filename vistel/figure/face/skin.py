"""A face on the mesh of a figure."""

import numpy as np

from vistel.arrays import F32, F64, Bool
from vistel.figure.avatar.avatar import Mesh
from vistel.figure.face.landmarks import Landmarks
from vistel.figure.face.rules import FaceRules
from vistel.figure.face.shape import Expression, FaceShape
from vistel.figure.moved_part import MovedPart


class FaceSkin:
    """Adds expressions to a posed skin after its deformation, so that a contact moves a cheek and the smile stays."""

    def __init__(self, mesh: Mesh, marks: Landmarks, rules: FaceRules | None = None, still: Bool | None = None) -> None:
        """still: as `FaceShape` has it."""
        self.shape = FaceShape(mesh.vertices, marks, rules, mesh.triangles, mesh.targets, still)
        self._part = MovedPart(mesh, self.shape.vertex)
        self.vertex = self._part.vertex

    def lay(self, vertices: F32, normals: F32, head: F64, e: Expression) -> None:
        """Move a posed skin (V, 3) in place. head: (3, 3) rotation of the head joint."""
        self._part.lay(vertices, normals, self.shape.offsets(e), head)

    def room_offsets(self, head: F64, e: Expression, out: F32) -> None:
        """The same added to offsets (V, 3) in the room, for engines that move the skin elsewhere."""
        out[self.vertex] += self.shape.offsets(e) @ head.T.astype(np.float32)
