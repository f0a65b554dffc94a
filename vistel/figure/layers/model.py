"""A whole figure as one layered implicit model: skin, joints, muscles, bones and veins and how they blend (Singh §4.1).

The graph of Fig. 39b: whatever belongs to one limb blends; limbs do not blend with each other, but both blend with the
joint between them. `vistel.implicit.compile` makes one field program of it, which can be polygonised and traced.
"""

import itertools
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from vistel.arrays import F64, I32
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.body import PosedBody, pose_body
from vistel.figure.figure_limbs import limb_groups
from vistel.figure.layers.anatomy import VEINS, VeinSpec
from vistel.figure.layers.contraction import activation, belly_length
from vistel.figure.layers.forces import surface_ratio
from vistel.figure.layers.muscles import BellyShape, Muscle
from vistel.figure.layers.places import Places, unit
from vistel.figure.layers.skeleton_shapes import bone_shapes
from vistel.figure.layers.skin import Anatomy
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import JOINT_INDEX, PARENTS, REFERENCE_HEIGHT
from vistel.implicit.blend import QUARTIC
from vistel.implicit.graph.combine import selective, total, union
from vistel.implicit.graph.shape import Shape
from vistel.implicit.primitives.offset import ConeSphere, Sphere, Sphylinder
from vistel.implicit.primitives.superquadric import Superellipsoid

Layer = Literal["skin", "joints", "muscles", "tendons", "bones", "veins"]
LAYERS: tuple[Layer, ...] = ("skin", "joints", "muscles", "tendons", "bones", "veins")

SLIMMER = 0.93
"""Radius of the skin's own primitives / of the body's: muscles under it make up the rest."""
UNDER_SKIN = 0.30
"""Weight of muscles in the blend, in parts of their weight under an embedded skin's 1."""
JOINT_SIZE = 0.80
JOINT_WEIGHT = 0.25
BONE_WEIGHT = 0.25
VEIN_WEIGHT = 0.45
BONE_CORE = 0.55
"""Radius of a bone that shows / of what stands for it under an embedded skin."""
_PARENTS: list[int] = [int(p) for p in PARENTS]
_SMOOTH = 4.0
"""Power of the union of the primitives of one limb, as in embedding."""


@dataclass(frozen=True)
class LayerPart:
    """One primitive, or several that are one: its own shape, room frame; limbs: which it belongs to; weight: in blends."""

    name: str
    layer: Layer
    shape: Shape
    limbs: frozenset[int]
    weight: float = 1.0


@dataclass(frozen=True)
class LayeredModel:
    """A person's layers in one posture, room frame."""

    parts: tuple[LayerPart, ...]

    def layer(self, *layers: Layer) -> tuple[LayerPart, ...]:
        """The parts of some layers."""
        return tuple(p for p in self.parts if p.layer in layers)

    def alone(self, *layers: Layer) -> Shape:
        """Layers uncovered: the union of their parts, each as large as it is."""
        return union(*(p.shape for p in self.layer(*layers)))

    def graph(self, layers: Collection[Layer] = LAYERS) -> tuple[tuple[LayerPart, ...], list[tuple[int, int]]]:
        """The parts, and which pairs of them blend: those that share a limb."""
        parts = self.layer(*layers)
        pairs = [(i, j) for i, p in enumerate(parts) for j in range(i) if p.limbs & parts[j].limbs]
        return parts, pairs

    def blended(self, layers: Collection[Layer] = ("skin", "joints", "muscles", "bones", "veins")) -> Shape:
        """The figure: every layer under its skin, blended as the graph says."""
        parts, pairs = self.graph(layers)
        return selective([p.weight * p.shape if p.weight != 1.0 else p.shape for p in parts], pairs)


def layered_model(
    avatar: Avatar, anatomy: Anatomy, joints: JointPose, *, physical: bool = False, veins: tuple[VeinSpec, ...] = VEINS
) -> LayeredModel:
    """`avatar` in a posture. physical: bellies swell by their blend functions instead of by their size (Singh §4.2)."""
    posed, groups = pose_body(avatar.body, joints), limb_groups(avatar.body)
    limb = _limb_of_joint(avatar, groups)
    parts = [*_skin(posed, groups), *_joints(avatar, joints, limb, posed)]
    length = anatomy.muscles.stretch(joints)
    active = activation(length)
    for muscle, ratio, a in zip(anatomy.muscles.muscles, belly_length(length, active), active, strict=True):
        limbs = frozenset({limb[muscle.belly.joint]})
        belly = muscle.belly if physical else muscle.belly.at_length(float(ratio))
        shape = _belly(belly, joints, surface_ratio(float(a)) if physical else None)
        parts.append(LayerPart(muscle.name, "muscles", shape, limbs, UNDER_SKIN * muscle.weight / 0.4))
        parts.append(LayerPart(f"{muscle.name}_tendons", "tendons", _tendons(muscle, belly, joints), limbs, 0.2))
    for joint, shape in bone_shapes(avatar, joints).items():
        parts.append(LayerPart(f"{joint}_bone", "bones", shape, frozenset({limb[JOINT_INDEX[joint]]}), BONE_WEIGHT))
    for bone in anatomy.bones:
        # As high as what moves an embedded skin, but as thin as a bone.
        outer = (1.0 - BONE_CORE) * bone.radius * unit(bone.rise)
        up = bone.shown(bone.value(joints))
        tip = avatar.skeleton.tip[bone.joint]
        ends = (up.a + outer, up.b + outer, max(0.0, float(up.b @ tip) / float(tip @ tip)) * tip)
        a, b, root = (joints.position[bone.joint] + joints.rotation[bone.joint] @ end for end in ends)
        radius = BONE_CORE * bone.radius
        # Bones that follow the one that folds are connected with it; the collar bone is included already.
        starts = (a, root) if bone.joint != bone.hinge[0] else (a,)
        shape = union(*(Sphylinder.of_surface(_three(p), _three(b), radius) for p in starts))
        parts.append(LayerPart(bone.name, "bones", shape, frozenset({limb[bone.joint]}), BONE_WEIGHT))
    places = Places(avatar)
    parts += [_vein(places, spec, joints, limb) for spec in veins]
    return LayeredModel(tuple(parts))


def _limb_of_joint(avatar: Avatar, groups: I32) -> list[int]:
    """(J,) limb of each joint, or of the nearest joint above it."""
    own = {int(j): int(g) for j, g in zip(avatar.body.joint, groups, strict=True)}
    out: list[int] = []
    for j, parent in enumerate(_PARENTS):
        out.append(own[j] if j in own else out[parent] if parent >= 0 else int(groups[0]))
    return out


def _skin(posed: PosedBody, groups: I32) -> Iterable[LayerPart]:
    for g in range(int(groups.max()) + 1):
        shapes = [_cone(posed, int(i), SLIMMER) for i in np.flatnonzero(groups == g)]
        shape = shapes[0] if len(shapes) == 1 else union(*shapes, power=_SMOOTH)
        yield LayerPart(f"limb_{g}", "skin", shape, frozenset({g}))


def _joints(avatar: Avatar, joints: JointPose, limb: list[int], posed: PosedBody) -> Iterable[LayerPart]:
    """A ball wherever one limb follows another."""
    for i in range(len(avatar.body)):
        j = int(avatar.body.joint[i])
        above = limb[_PARENTS[j]] if _PARENTS[j] >= 0 else limb[j]
        if above != limb[j] and float(np.linalg.norm(posed.a[i] - joints.position[j])) < 1e-6:
            ball = Sphere.of_surface(_three(joints.position[j]), JOINT_SIZE * float(posed.radius_a[i]))
            yield LayerPart(f"{avatar.body.names[i]}_joint", "joints", ball, frozenset({above, limb[j]}), JOINT_WEIGHT)


def _belly(belly: BellyShape, joints: JointPose, ratio: float | None) -> Shape:
    """A belly in the room; ratio: of its surface in its realm, by its blend function."""
    rotation, position = joints.rotation[belly.joint], joints.position[belly.joint]
    a, b, c = belly.half.tolist()
    shape = Superellipsoid.of_surface((0.0, 0.0, 0.0), (a, b, c))
    if ratio is not None:
        shape = Superellipsoid((0.0, 0.0, 0.0), shape.sizes, blend=QUARTIC.actuated(ratio))
    return shape.transformed(np.column_stack([rotation @ belly.axes.T, position + rotation @ belly.centre]))


def _tendons(muscle: Muscle, belly: BellyShape, joints: JointPose) -> Shape:
    """From the ends of the belly to origin and insertion."""
    rotation, position = joints.rotation[belly.joint], joints.position[belly.joint]
    thick = 0.16 * float(muscle.belly.half[:2].mean())
    pieces: list[Shape] = []
    for sign, anchor in ((-1.0, muscle.path[0]), (1.0, muscle.path[-1])):
        inner = position + rotation @ (belly.centre + sign * 0.72 * belly.half[2] * belly.axes[2])
        outer = joints.position[anchor.at] + joints.rotation[anchor.joint] @ anchor.offset
        through = [
            joints.position[v.at] + joints.rotation[v.joint] @ v.offset
            for v in muscle.path[1:-1]
            if sign * float((v.rest - muscle.path[0].rest) @ belly.axes[2] - 0.5 * muscle.rest_length) > 0.0
        ]
        line = [inner, *(through if sign > 0 else through[::-1]), outer]
        pieces += [ConeSphere.of_surface(_three(p), _three(q), thick, 0.8 * thick) for p, q in itertools.pairwise(line)]
    return total(*pieces) if len(pieces) > 1 else pieces[0]


def _vein(places: Places, spec: VeinSpec, joints: JointPose, limb: list[int]) -> LayerPart:
    """A curve just below the skin (Catmull-Rom through its places), as thin as veins are."""
    anchors = [places.anchor(site) for site in spec.path]
    radius = spec.radius * places.avatar.skeleton.height / REFERENCE_HEIGHT
    ends = np.array([joints.position[a.at] + joints.rotation[a.joint] @ a.offset for a in anchors])
    curve = smooth_curve(ends, 5)
    pieces = [Sphylinder.of_surface(_three(p), _three(q), radius) for p, q in itertools.pairwise(curve)]
    return LayerPart(spec.name, "veins", union(*pieces), frozenset(limb[a.joint] for a in anchors), VEIN_WEIGHT)


def smooth_curve(points: F64, pieces: int) -> F64:
    """Catmull-Rom curve through points (n, 3): `pieces` steps from each to the next."""
    p = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    t = np.arange(pieces)[:, None] / pieces
    out = [
        0.5
        * (
            2 * p[i + 1]
            + (p[i + 2] - p[i]) * t
            + (2 * p[i] - 5 * p[i + 1] + 4 * p[i + 2] - p[i + 3]) * t**2
            + (3 * p[i + 1] - p[i] - 3 * p[i + 2] + p[i + 3]) * t**3
        )
        for i in range(len(points) - 1)
    ]
    return np.concatenate([*out, points[-1:]])


def _cone(posed: PosedBody, i: int, scale: float) -> ConeSphere:
    return ConeSphere.of_surface(
        _three(posed.a[i]), _three(posed.b[i]), scale * float(posed.radius_a[i]), scale * float(posed.radius_b[i])
    )


def _three(v: F64) -> tuple[float, float, float]:
    x, y, z = v.tolist()
    return x, y, z
