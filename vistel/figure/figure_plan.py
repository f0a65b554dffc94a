"""A figure in a posture, planned for an engine that skins and deforms elsewhere (see `vistel.implicit.deformation.deform_plan`).

Only the vertices needed to find contacts are posed here.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32
from vistel.figure.body import PosedBody, pose_body
from vistel.figure.figure import Figure
from vistel.figure.posture.posture import JointPose, Posture, pose_joints
from vistel.implicit.deformation.deform_plan import FramePlan, Planner
from vistel.implicit.deformation.ghost_source import GhostSource

_ONLY = np.zeros(1, np.int32)


@dataclass(frozen=True)
class PlannedPose:
    """A figure at one instant, room frame; plan: valid until the next of the same figure."""

    joints: JointPose
    posed: PosedBody
    plan: FramePlan


class FigurePlanner:
    """Plans the frames of one figure. Not for two threads at once."""

    def __init__(self, figure: Figure) -> None:
        self.figure = figure
        mesh = figure.avatar.mesh
        self.planner = Planner(mesh.triangles, figure.embedding)
        skin = figure.skin
        self._middles, self._blocks = skin.parts(self.planner.middles[None]), skin.parts(self.planner.index)
        self._vertices, self._normals = np.zeros_like(mesh.vertices), np.zeros_like(mesh.vertices)

    def plan(self, posture: Posture, ghosts: Sequence[GhostSource] = (), displacement: F32 | None = None) -> PlannedPose:
        """The same frame as `Figure.pose`, as a plan."""
        figure, planner = self.figure, self.planner
        joints = pose_joints(figure.avatar.skeleton, posture)
        posed = pose_body(figure.avatar.body, joints)
        bones = figure.skin.bones(joints)
        vertices, normals = self._vertices, self._normals
        self._middles.pose(_ONLY, vertices, normals)
        self._blocks.pose(planner.begin(vertices, posed.a, posed.b, ghosts, displacement), vertices, normals)
        self._blocks.pose(planner.touch(vertices, normals), vertices, normals)
        return PlannedPose(joints, posed, planner.end(vertices, normals, bones))
