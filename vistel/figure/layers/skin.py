"""The layers of one figure's skin. A frame runs two small kernels (see `layer_kernels`)."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.layers import layer_kernels as k
from vistel.figure.layers.bones import Bone, bones_of
from vistel.figure.layers.muscles import Muscles
from vistel.figure.layers.places import Places
from vistel.figure.layers.profiles import Profile, Skin, bone_profile, muscle_profile, turned_normals
from vistel.figure.posture.posture import JointPose
from vistel.figure.rigid.component import RigidSkin, Rows
from vistel.figure.rigid.lane_kernels import LANES
from vistel.figure.rigid.weights import TWIST_BONES
from vistel.figure.skeleton import JOINT_INDEX, JOINTS
from vistel.implicit.deformation.deform import Deformer
from vistel.implicit.deformation.deform_table import ALPHA, OFFSET
from vistel.implicit.meshes.embedding import Embedding, embed

_SLOPE_STEP = 2e-3
"""Over which the fall of the skin's own field is measured [m]."""
_LEAST_SLOPE = 4.0
"""Slope of a skin's own field, at least [1/m]."""
_FIRM = 14.0
"""Slope that layers assume, at least [1/m]. The field of a trunk, whose primitives are wide, falls so slowly that a muscle of a
limb's size would blow it up."""
_TRUNK = (*(f"spine_{i}" for i in range(4, 9)), "left_shoulder", "right_shoulder", "neck")
_BLENDS = {"deltoid": _TRUNK, "pectoral": _TRUNK, "trapezius": _TRUNK, "collar": _TRUNK}
"""Which limbs a layer blends with beside those it is fixed to: the edges of the graph to the skin (Fig. 39b)."""


class LayeredFigure(Protocol):
    """A figure whose skin layers move: the part of `vistel.figure.figure.Figure` that they need."""

    avatar: Avatar
    skin: RigidSkin
    embedding: Embedding
    deformer: Deformer


@dataclass(frozen=True)
class Anatomy:
    """The layers of one person, attached to their bones."""

    muscles: Muscles
    bones: tuple[Bone, ...]

    @staticmethod
    def of(places: Places) -> "Anatomy":
        """The muscles and bones of the person whose body `places` describes."""
        return Anatomy(Muscles.of(places), bones_of(places))


@dataclass(frozen=True)
class LayerTerms:
    """The layers by vertex: those of vertex v are start[v] : start[v + 1] (start (V + 1,)) of channel (N,) and of term (N, 4),
    along the normal [m] and to the normal; fall: (V,) how fast its own field falls where the implicit component shapes
    the skin [1/m], else 0."""

    start: I32
    channel: I32
    term: F32
    fall: F32

    @staticmethod
    def none(vertices: int) -> "LayerTerms":
        """Of a skin without layers."""
        start, no = np.zeros(vertices + 1, np.int32), np.zeros(0, np.int32)
        return LayerTerms(start, no, np.zeros((0, 4), np.float32), np.zeros(vertices, np.float32))


class SkinLayers:
    """Muscles and bones under the skin of one figure. They move its vertices at rest, before the joints carry them."""

    def __init__(self, figure: LayeredFigure, anatomy: Anatomy | None = None) -> None:
        self.anatomy = anatomy or Anatomy.of(Places(figure.avatar))
        slope = own_slope(figure)
        self.profiles = _profiles(figure, self.anatomy, slope)
        self._table, self._held = np.zeros(k.TABLE_LENGTH, np.int64), dict[int, NDArray[np.generic]]()
        self._work = np.zeros(13 * LANES + 32, np.float32)
        self._keep_drivers()
        self._keep_rows(figure)
        self._keep_folds(figure, slope)

    @property
    def names(self) -> tuple[str, ...]:
        """Of every layer, in the order of `values` and `profiles`."""
        return (*self.anatomy.muscles.names, *(bone.name for bone in self.anatomy.bones))

    @property
    def values(self) -> F32:
        """(C,) state of each layer at the last `skin`: of a muscle 1 fully contracted, below 0 stretched; of a bone 1 fully
        visible."""
        return self._value

    def skin(self, joints: JointPose, rows: Rows, dual: F32, matrix: F32, vertices: F32, normals: F32) -> None:
        """Pose the rows of the rigid component with the layers as they are with `joints`: see `RigidSkin.pose`."""
        k.drive(self._table, joints.rotation, joints.position)
        k.skin_over(
            self._table, rows.index, rows.bone, rows.single, rows.weight, rows.rest, dual, matrix, self._work, vertices, normals
        )
        k.fold(self._table, self._work)

    def lay(self, joints: JointPose, rows: Rows, rest: F32, rest_normal: F32, out: F32) -> None:
        """Write to `out` the skin at rest, both (V, 3), with the layers as they are with `joints`, for an engine that poses
        it elsewhere."""
        k.drive(self._table, joints.rotation, joints.position)
        k.lay(self._table, rows.index, rest, rest_normal, out)

    def clear(self) -> None:
        """Let no layer act on the figure any more."""
        self._moved[:] = 0.0
        k.fold(self._table, self._work)

    @property
    def moved(self) -> F32:
        """(V,) how far the last `skin` moved each vertex along its normal at rest [m]."""
        return self._moved

    def terms(self) -> LayerTerms:
        """What an engine needs that poses the skin elsewhere."""
        channel, vertex = np.nonzero(np.abs(self._terms).max(axis=1) > 0.0)
        order = np.argsort(vertex, kind="stable")
        channel, vertex = channel[order], vertex[order]
        start = np.searchsorted(vertex, np.arange(len(self._fall) + 1))
        return LayerTerms(
            start.astype(np.int32), channel.astype(np.int32), np.ascontiguousarray(self._terms[channel, :, vertex]), self._fall
        )

    def write_to(self, figure: LayeredFigure) -> None:
        """Shift the offsets of `figure`, which is the one that they were made for."""
        self._keep(k.OFFSETS, figure.deformer.calibration[1])

    def __setstate__(self, state: dict[str, Any]) -> None:
        """After unpickling, the arrays have other addresses."""
        self.__dict__.update(state)
        for slot, array in list(self._held.items()):
            self._keep(slot, array)

    def _keep(self, slot: int, array: NDArray[np.generic]) -> None:
        array = np.ascontiguousarray(array)
        self._held[slot] = array
        self._table[slot] = array.ctypes.data

    def _keep_drivers(self) -> None:
        muscles, bones = self.anatomy.muscles, self.anatomy.bones
        joint, at, offset = muscles.bodies
        self._value = np.zeros(len(muscles) + len(bones), np.float32)
        self.effort: F64 = np.zeros(len(muscles))
        """(M,) activation that each muscle has at least, whatever the posture: to be written, such as from `forces.effort`."""
        for slot, array in (
            (k.POINT_JOINT, joint),
            (k.POINT_AT, at),
            (k.POINT_OFFSET, offset),
            (k.PATH_START, muscles.start),
            (k.LENGTH, np.stack([muscles.tendon, muscles.fibre], axis=1)),
            (k.VALUE, self._value),
            (k.EFFORT, self.effort),
            (k.HINGE, np.array([b.hinge for b in bones], np.int32).reshape(-1, 2)),
            (k.DIRECTION, np.array([b.direction for b in bones]).reshape(-1, 3)),
            (k.FULL_COSINE, np.cos([b.full for b in bones])),
        ):
            self._keep(slot, array)
        self._table[k.MUSCLES], self._table[k.BONES] = len(muscles), len(bones)

    def _keep_rows(self, figure: LayeredFigure) -> None:
        index = figure.skin.rows.index
        self._terms = terms = np.array([_terms(figure, p) for p in self.profiles])
        acts: NDArray[np.bool_] = np.abs(terms).max(axis=1) > 0.0
        of_row: NDArray[np.bool_] = np.logical_or.reduce(acts[:, index], axis=2)
        channel, parts, start = list[int](), list[F32](), [0]
        for r in range(len(index)):
            acting = np.flatnonzero(of_row[:, r])
            channel += acting.tolist()
            parts += list(terms[acting][:, :, index[r]])
            start.append(len(channel))
        self._moved = np.zeros(len(figure.avatar.mesh.vertices), np.float32)
        for slot, array in (
            (k.TERM_START, np.array(start, np.int32)),
            (k.TERM_CHANNEL, np.array(channel, np.int32)),
            (k.TERM, np.array(parts, np.float32)),
            (k.MOVED, self._moved),
        ):
            self._keep(slot, array)

    def _keep_folds(self, figure: LayeredFigure, slope: F64) -> None:
        """Patches whose skin the implicit component shapes: there a layer also changes the field."""
        index, calibration = figure.deformer.calibration
        blocks, patches, rows, width = calibration.shape
        vertex = index.reshape(blocks, patches, width)
        touched = np.zeros(len(slope), bool)
        for profile in self.profiles:
            touched[profile.vertex] = True
        half = width // LANES
        self._fall = np.zeros(len(slope), np.float32)
        place, which, base, slopes = list[int](), list[I32](), list[F32](), list[F64]()
        for b, p in zip(*np.nonzero((touched[vertex] & (calibration[:, :, ALPHA] > 0.0)).any(axis=2)), strict=True):
            for h in range(half):
                lanes = slice(h * LANES, (h + 1) * LANES)
                place.append(((int(b) * patches + int(p)) * rows + OFFSET) * width + h * LANES)
                which.append(vertex[b, p, lanes])
                base.append(calibration[b, p, OFFSET, lanes].copy())
                slopes.append(slope[vertex[b, p, lanes]])
                self._fall[vertex[b, p, lanes]] = slopes[-1]
        for slot, array in (
            (k.FOLD_VERTEX, np.array(which, np.int32)),
            (k.FOLD_PLACE, np.array(place, np.int32)),
            (k.FOLD_BASE, np.array(base, np.float32)),
            (k.FOLD_SLOPE, np.array(slopes, np.float32)),
        ):
            self._keep(slot, array)
        self.write_to(figure)
        self._table[k.FOLDS] = len(place)


def own_slope(figure: LayeredFigure) -> F64:
    """(V,) how fast the weighted field of a figure's own limbs falls along the normals at rest [1/m]."""
    mesh, embedding = figure.avatar.mesh, figure.embedding
    rest, normals = figure.skin.rest
    moved = (rest + np.float32(_SLOPE_STEP) * normals).astype(np.float32)
    ahead = embed(moved, mesh.limb, embedding.limbs, embedding.fit)
    before, after = ((0.5 - e.offset) / e.weight for e in (embedding, ahead))
    return np.maximum(embedding.weight * (before - after) / _SLOPE_STEP, _LEAST_SLOPE)


def _terms(figure: LayeredFigure, profile: Profile) -> F32:
    """(4, V) what a layer adds at every vertex: along the normal, and to the three coordinates of the normal."""
    rest, _ = figure.skin.rest
    out = np.zeros((4, len(rest)), np.float32)
    out[0, profile.vertex] = profile.moved
    around, turned = turned_normals(rest.astype(np.float64), figure.avatar.mesh.triangles, figure.skin.rest[1], profile)
    out[1:, around] = turned.T
    return out


def _shares(figure: LayeredFigure) -> F32:
    """(V, J) how far each vertex follows each joint, twists counted with the bone that twists."""
    influences = figure.skin.influences
    to = np.array([*range(len(JOINTS)), *(JOINT_INDEX[b.joint] for b in TWIST_BONES)])
    out = np.zeros((len(influences.bone), len(JOINTS)), np.float32)
    for column in range(influences.bone.shape[1]):
        np.add.at(out, (np.arange(len(out)), to[influences.bone[:, column]]), influences.weight[:, column])
    return out


def _limbs_of(name: str, joints: tuple[int, ...]) -> list[int]:
    """Joints whose skin a layer blends with."""
    also = next((limbs for word, limbs in _BLENDS.items() if word in name), ())
    side = name.partition("_")[0]
    near = [f"{side}_upper_arm"] if also else []
    return sorted({*joints, *(JOINT_INDEX[j] for j in (*also, *near))})


def _profiles(figure: LayeredFigure, anatomy: Anatomy, slope: F64) -> tuple[Profile, ...]:
    skeleton, share = figure.avatar.skeleton, _shares(figure)
    rest, normals = figure.skin.rest
    skin = Skin(rest.astype(np.float64), normals.astype(np.float64), np.maximum(slope, _FIRM))

    def blends(name: str, *joints: int) -> F64:
        return np.minimum(1.0, share[:, _limbs_of(name, joints)].sum(axis=1)).astype(np.float64)

    out = [muscle_profile(m, skeleton.rest, skin, blends(m.name, m.belly.joint)) for m in anatomy.muscles.muscles]
    return (*out, *(bone_profile(b, skeleton.rest, skin, blends(b.name, *b.hinge)) for b in anatomy.bones))
