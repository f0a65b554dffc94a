"""A figure: an avatar in a posture. Joints, rigid component, then the implicit deformation."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32
from vistel.figure.avatar.avatar import Avatar, Mesh, flesh, rigid
from vistel.figure.body import PosedBody, pose_body
from vistel.figure.figure_limbs import limbs_of
from vistel.figure.hems import with_hems_outwards
from vistel.figure.layers.skin import SkinLayers
from vistel.figure.posture.posture import JointPose, Posture, pose_joints
from vistel.figure.rigid.bulge_fit import fit_bulges
from vistel.figure.rigid.component import Influences, RigidSkin
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.normals import vertex_normals as normals_of
from vistel.geometry.rotation import move_points
from vistel.implicit.deformation.deform import Deformer, DeformReport
from vistel.implicit.deformation.ghost_source import GhostSource
from vistel.implicit.meshes.embedding import Embedding, embed, group_fields


@dataclass(frozen=True)
class FigureState:
    """A figure at one instant, room frame. The arrays are the figure's own buffers: valid until its next
    `pose`.

    vertices, normals: (V, 3) of the avatar's mesh [m, unit]; draw them as `vertices[mesh.corner_vertex]`.
    eyeballs: vertices and normals of each eyeball. joints: every joint; posed: the primitives.
    report: statistics of the implicit deformation.
    """

    vertices: F32
    normals: F32
    eyeballs: tuple[tuple[F32, F32], ...]
    joints: JointPose
    posed: PosedBody
    report: DeformReport


_ON_BONE = ("skull", "face")
_DENT = 0.025
"""Greatest depth to which a contact presses the skin of a head [m]."""
_RISE = 0.004
"""How far the skin of a head rises beside that [m]. Noses and lips stand far out of the one primitive of a face, where its field is
shallow: the rise beside a finger on the cheek would throw them aside by centimetres."""


def _held_by_the_skull(embedding: Embedding, avatar: Avatar) -> Embedding:
    names, stiff = np.isin(avatar.body.names, _ON_BONE)[avatar.mesh.limb], rigid(avatar)
    inward, outward = (
        np.where(stiff, 0.0, np.where(names, np.minimum(room, most), room)).astype(room.dtype)
        for room, most in ((embedding.inward, _DENT), (embedding.outward, _RISE))
    )
    return replace(embedding, inward=inward, outward=outward)


class Figure:
    """Poses and deforms one avatar. Not for two threads at once; different figures are independent.

    same_body: a figure of another level of detail of the same avatar, so that both have the same primitives.
    """

    def __init__(self, avatar: Avatar, *, same_body: "Figure | None" = None) -> None:
        self.avatar = avatar
        mesh = avatar.mesh
        normals = with_hems_outwards(avatar, vertex_normals(mesh))
        given = None if mesh.bone is None or mesh.weight is None else Influences(mesh.bone, mesh.weight)
        limb_joint = avatar.body.joint[mesh.limb]
        self.skin = RigidSkin(avatar.skeleton, mesh.vertices, normals, mesh.triangles, limb_joint, given)
        limbs = limbs_of(avatar.skeleton, avatar.body)
        fit = same_body.embedding.fit if same_body is not None else None
        self.embedding = _held_by_the_skull(embed(mesh.vertices, mesh.limb, limbs, fit, normals, flesh(avatar)), avatar)
        self.deformer = Deformer(mesh.triangles, self.embedding)
        self._layers: SkinLayers | None = None
        self._vertices, self._normals = np.empty_like(mesh.vertices), np.empty_like(mesh.vertices)
        if same_body is not None:
            self.skin.bulges[:] = same_body.skin.bulges
        else:
            fit_bulges(avatar.skeleton, mesh.vertices, mesh.triangles, self.skin.bulges, self._folded)
        self._eyes = [
            (mesh.vertices - avatar.skeleton.rest[joint].astype(np.float32), vertex_normals(mesh), joint)
            for mesh, joint in zip(avatar.eyeballs, (JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]), strict=False)
        ]
        self._posed_eyes = tuple((np.empty_like(p), np.empty_like(n)) for p, n, _ in self._eyes)

    def pose(self, posture: Posture, ghosts: Sequence[GhostSource] = (), displacement: F32 | None = None) -> FigureState:
        """The figure in `posture`, deformed by its own limbs and by the ghosts of other bodies.

        displacement: (V,) of the skin along its normal [m], wrinkles; flattened where something presses. Make ghosts with
        `Figure.ghosts` of another figure and `vistel.implicit.deformation.ghost_source.ghosts_of` of things.
        """
        joints = pose_joints(self.avatar.skeleton, posture)
        self.skin.pose(joints, self._vertices, self._normals)
        posed = pose_body(self.avatar.body, joints)
        report = self.deformer.deform(self._vertices, self._normals, posed.a, posed.b, ghosts, displacement)
        return FigureState(self._vertices, self._normals, self._pose_eyes(joints), joints, posed, report)

    def _folded(self, posture: Posture) -> F32:
        """Vertices of `pose`, for fitting."""
        joints = pose_joints(self.avatar.skeleton, posture)
        self.skin.pose(joints, self._vertices, self._normals)
        posed = pose_body(self.avatar.body, joints)
        self.deformer.solve(self._vertices, self._normals, posed.a, posed.b)
        return self._vertices

    def __setstate__(self, state: dict[str, Any]) -> None:
        """After it was read back: its layers write where its deformer reads."""
        self.__dict__.update(state)
        if self._layers is not None:
            self._layers.write_to(self)

    @property
    def layers(self) -> SkinLayers | None:
        """Muscles and bones under this figure's skin; None, the default: it follows the joints alone."""
        return self._layers

    @layers.setter
    def layers(self, layers: SkinLayers | None) -> None:
        if self._layers is not None:
            self._layers.clear()
        self._layers = layers
        self.skin.layers = layers

    def ghosts(self, posed: PosedBody, *, target: NDArray[np.bool_] | None = None) -> GhostSource:
        """This figure, posed, as ghosts for another one: a group per limb, with the radii fitted to its own
        skin.

        target: (P,) primitives of the other figure to act on, None for all.
        """
        return self.deformer.ghosts(posed.a, posed.b, target)

    @property
    def moved(self) -> NDArray[np.uint8]:
        """(V,) 1 where the implicit deformation of the last `pose` moved a vertex."""
        return self.deformer.moved

    def fields(self, posed: PosedBody, points: F32) -> NDArray[np.float64]:
        """(G, N) fields of this figure's limbs, posed, at points (N, 3) [m]: for measuring, double
        precision."""
        return group_fields(np.asarray(points, np.float64), self.embedding, posed.a, posed.b)

    def _pose_eyes(self, joints: JointPose) -> tuple[tuple[F32, F32], ...]:
        for (offsets, normals, joint), out in zip(self._eyes, self._posed_eyes, strict=True):
            move_points(offsets, normals, joints.rotation[joint], joints.position[joint], *out)
        return self._posed_eyes


def vertex_normals(mesh: Mesh) -> F32:
    """(V, 3) unit vertex normals, faces weighted by their area."""
    return normals_of(mesh.vertices.astype(np.float64), mesh.triangles).astype(np.float32)
