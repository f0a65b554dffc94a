"""The rigid component: vertices follow the joints, with rotations interpolated round each joint (Singh
§2.4, §6.4).

Every vertex has up to four influences. Round a joint the rotation goes over smoothly from one limb to the
next, by quaternions about the joint's centre (blended dual quaternions: the same thing for two limbs that
share a joint, and still rigid where they do not), so that neither a bent elbow nor a twisted forearm loses
its girth. The trunk is a free-form deformation along the spine: quadratic B-spline weights over its
segments. Two kinds of bones are added to the joints: the forearm carrying the whole twist of the hand, and
the upper arm without its own twist; vertices in between take their share, so that a twist is spread along
the limb. Before all that the rest pose bulges beside folded elbows and knees (`vistel.figure.rigid.bulge`).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32
from vistel.figure.posture.posture import JointPose
from vistel.figure.rigid.bulge import BENDS, HINGE_JOINTS, HINGES, bulge_shapes
from vistel.figure.rigid.lane_kernels import LANES, skin  # pyright: ignore[reportUnknownVariableType]
from vistel.figure.rigid.skinning_kernels import (
    amplitudes,  # pyright: ignore[reportUnknownVariableType]
    bone_transforms,  # pyright: ignore[reportUnknownVariableType]
    lay_bulges,  # pyright: ignore[reportUnknownVariableType]
    skin_parts,  # pyright: ignore[reportUnknownVariableType]
)
from vistel.figure.rigid.weights import TWIST_BONES, influences
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, Skeleton


@dataclass(frozen=True)
class Influences:
    """Which bones a vertex follows: bone (V, 4) indices, weight (V, 4), largest first, summing to 1."""

    bone: I32
    weight: F32


@dataclass(frozen=True)
class Rows:
    """Vertices sorted into rows that follow the same bones; the last vertex fills up a row. See `lane_kernels.skin`."""

    index: I32
    bone: I32
    single: NDArray[np.uint8]
    weight: F32
    rest: F32

    @staticmethod
    def of(influences: Influences, vertices: F32, normals: F32) -> "Rows":
        """The rows of a mesh: vertices and normals (V, 3) at rest."""
        groups: dict[tuple[int, ...], list[int]] = {}
        for v, (bones, weights) in enumerate(zip(influences.bone.tolist(), influences.weight.tolist(), strict=True)):
            used = tuple(sorted(b for b, w in zip(bones, weights, strict=True) if w > 0.0))
            groups.setdefault(used, []).append(v)
        chunks = [
            (bones, members[start : start + LANES]) for bones, members in groups.items() for start in range(0, len(members), LANES)
        ]
        index = np.array([m + [m[-1]] * (LANES - len(m)) for _, m in chunks], np.int32).reshape(-1, LANES)
        bone = np.array([b + (b[0],) * (4 - len(b)) for b, _ in chunks], np.int32).reshape(-1, 4)
        used = np.array([len(b) for b, _ in chunks], np.int32)
        weight = np.zeros((len(chunks), 4, LANES), np.float32)
        for k in range(4):
            # The weight of the row's k-th bone for each of its vertices.
            of_bone = influences.bone[index] == bone[:, k, None, None]
            weight[:, k] = np.where(of_bone, influences.weight[index], 0.0).sum(axis=2) * (k < used)[:, None]
        rest = np.concatenate([vertices[index], normals[index]], axis=2).transpose(0, 2, 1)
        return Rows(
            index,
            bone,
            (used == 1).astype(np.uint8),
            np.ascontiguousarray(weight.reshape(len(chunks), -1)),
            np.ascontiguousarray(rest.reshape(len(chunks), -1)),
        )


class Layers(Protocol):
    """What lies under a skin and moves it at rest (see `vistel.figure.layers`)."""

    @property
    def values(self) -> F32:
        """(C,) how far each layer acts since the last call."""
        ...

    def skin(self, joints: JointPose, rows: Rows, dual: F32, matrix: F32, vertices: F32, normals: F32) -> None:
        """As `vistel.figure.rigid.lane_kernels.skin`."""
        ...

    def lay(self, joints: JointPose, rows: Rows, rest: F32, rest_normal: F32, out: F32) -> None:
        """Write the vertices at rest (V, 3) with the layers to `out`."""
        ...


class RigidSkin:
    """Poses the vertices of one mesh; everything that does not depend on the posture is done once.

    vertices, normals: (V, 3) rest pose [m, unit]; triangles: (F, 3); limb_joint: (V,) joint of the primitive
    each vertex belongs to; given: what the vertices follow, found from the joint chain where it is None.
    """

    def __init__(
        self, skeleton: Skeleton, vertices: F32, normals: F32, triangles: I32, limb_joint: I32, given: Influences | None = None
    ) -> None:
        self.influences = given or Influences(*influences(skeleton, vertices, triangles, limb_joint))
        weight = self.influences.weight
        self._vertices = np.ascontiguousarray(vertices, np.float32)
        self._normals = np.ascontiguousarray(normals, np.float32)
        self.rows = Rows.of(self.influences, self._vertices, self._normals)
        self._work = np.zeros(6 * LANES + 32, np.float32)
        self.layers: Layers | None = None
        self._single = (weight[:, 0] >= 1.0).astype(np.uint8)
        self._centres = np.concatenate([skeleton.rest, skeleton.rest[[JOINT_INDEX[b.joint] for b in TWIST_BONES]]])
        self._twist = np.array([(JOINT_INDEX[b.joint], JOINT_INDEX[b.other], b.kind) for b in TWIST_BONES], np.int32)
        count = len(JOINTS) + len(TWIST_BONES)
        self._dual = np.empty((count, 8), np.float32)
        self._matrix = np.empty((count, 12), np.float32)
        self.shapes = bulge_shapes(skeleton, vertices, limb_joint)
        self._table = np.zeros((len(HINGES), len(BENDS), 2))
        self._amplitude = np.zeros((len(HINGES), 2), np.float32)
        self._bulged = self._vertices.copy()
        self._laid = self._vertices.copy()
        of_place = self.shapes.hinge[self.rows.index]
        order = np.argsort(of_place, axis=None, kind="stable")
        self._bulge_start = np.searchsorted(of_place.reshape(-1)[order], np.arange(len(HINGES) + 1)).astype(np.int32)
        self._bulge_places = np.stack(np.divmod(order, LANES), axis=1).astype(np.int32)
        self._bulge_vertex = self.rows.index.reshape(-1)[order].copy()

    def matrices(self, joints: JointPose) -> F32:
        """(B, 12) row-major 3x4 matrices of all bones, rest to room; valid until the next call or `pose`."""
        bone_transforms(
            np.ascontiguousarray(joints.rotation),
            np.ascontiguousarray(joints.position),
            self._centres,
            self._twist,
            self._dual,
            self._matrix,
        )
        return self._matrix

    def bones(self, joints: JointPose) -> F32:
        """(at least B + 1, 20) of all bones, rest to room: the matrix as of `matrices`, the dual quaternion (x, y, z, w, then the
        dual part); row B begins with the amplitudes of the bulges, two for each of HINGES; what each layer does follows
        from row B + 1 on."""
        bones, layers = len(self._matrix), 0 if self.layers is None else len(self.layers.values)
        out = np.zeros((bones + 1 + -(-layers // 20), 20), np.float32)
        out[:bones, :12], out[:bones, 12:] = self.matrices(joints), self._dual
        self._bulge(joints)
        out[bones, : self._amplitude.size] = self._amplitude.reshape(-1)
        if self.layers is None:
            self._laid[:] = self._bulged
        else:
            self.layers.lay(joints, self.rows, self._bulged, self._normals, self._laid)
            out[bones + 1 :].reshape(-1)[:layers] = self.layers.values
        return out

    @property
    def bulges(self) -> F64:
        """(H, K, 2) amplitudes over BENDS of the shapes above and below each of HINGES; written to by who fits them."""
        return self._table

    @property
    def rest(self) -> tuple[F32, F32]:
        """Vertices and normals (V, 3) of the rest pose."""
        return self._vertices, self._normals

    def _bulge(self, joints: JointPose) -> None:
        """Lay the bulges of this pose on the rest pose."""
        changed = amplitudes(np.ascontiguousarray(joints.rotation), HINGE_JOINTS, BENDS, self._table, self._amplitude)
        if changed:
            lay_bulges(
                changed,
                self._bulge_start,
                self._bulge_places,
                self._bulge_vertex,
                self._vertices,
                self.shapes.out,
                self.shapes.along,
                self._amplitude,
                self._bulged,
                self.rows.rest,
                LANES,
            )

    def parts(self, index: I32) -> "SkinParts":
        """Parts of the skin, of vertices index (P, n), to be posed one by one with the bones as last posed."""
        return SkinParts(
            index,
            self._laid,
            self._normals[index],
            self.influences.bone[index],
            self.influences.weight[index],
            self._single[index],
            self._dual,
            self._matrix,
            np.empty((3, index.shape[1], 3), np.float32),
        )

    def pose(self, joints: JointPose, vertices: F32, normals: F32) -> None:
        """Write the posed vertices and unit normals, both (V, 3), in the room frame [m]."""
        self.matrices(joints)
        self._bulge(joints)
        lanes = self.rows
        if self.layers is not None:
            self.layers.skin(joints, lanes, self._dual, self._matrix, vertices, normals)
            return
        skin(
            lanes.index, lanes.bone, lanes.single, lanes.weight, lanes.rest, self._dual, self._matrix, self._work, vertices, normals
        )


@dataclass(frozen=True)
class SkinParts:
    """Parts of a `RigidSkin`, the arrays by part, but rest (V, 3), its own; not for two threads at once."""

    index: I32
    rest: F32
    rest_normal: F32
    bone: I32
    weight: F32
    single: NDArray[np.uint8]
    dual: F32
    matrix: F32
    room: F32

    def pose(self, parts: I32, vertices: F32, normals: F32) -> None:
        """Write the vertices and normals, both (V, 3) of the whole skin, of some parts."""
        skin_parts(
            parts,
            self.index,
            self.rest,
            self.rest_normal,
            self.bone,
            self.weight,
            self.single,
            self.dual,
            self.matrix,
            self.room,
            vertices,
            normals,
        )
