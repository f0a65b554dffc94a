"""An avatar of a shape of the body model, by VISTEL's way with rigged meshes: jointed, in the T-pose, its primitives fitted."""

from dataclasses import replace

import numpy as np

from vistel.arrays import F32, F64, I32, U8
from vistel.figure.avatar.avatar import Avatar, Mesh, Target
from vistel.figure.avatar.patch import Patch
from vistel.figure.body import Body
from vistel.figure.body_model.model import BodyModel, Level, Shape
from vistel.figure.face.closed_lips import closed
from vistel.figure.face.landmarks import landmarks_of
from vistel.figure.face.lips import sides_of_mouth
from vistel.figure.making.joints import jointed
from vistel.figure.making.primitives import BodyFit, fit_to_limbs
from vistel.figure.making.repose import repose
from vistel.figure.rigid.weights import TWIST_BONES
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, Skeleton

_RINGS = 16
"""Of an eyeball, from pole to pole."""
_SECTORS = 28
"""Of each ring."""
EYE_POWER = 0.6
"""In an eyeball's picture a place lies (angle from the pole / pi) to this power of the way to its edge."""
_CORNEA = 0.07, 0.42
"""How far the cornea stands out of an eyeball, and how wide it is, as shares of the radius."""


_UNPAINTED = np.full((1, 1, 3), 128, np.uint8)


def assemble(model: BodyModel, shape: Shape, *, name: str) -> Avatar:
    """The avatar, in one grey."""
    p, rest, fit, floor = _jointed(model, shape)
    skull = fit.body.names.index("skull")
    limb = np.full(len(p), fit.body.names.index("face"), np.int32)
    limb[: model.body] = model.limb
    # Expressions are those of the base's head, larger or smaller with this one.
    size = float(np.linalg.norm(shape.eyes[0] - shape.eyes[1])) / model.eyes_apart
    eyes = tuple(_eyeball(middle + floor, shape.eye_radius, model.boxes["eye"], skull) for middle in shape.eyes)
    levels = [Avatar(name, rest, fit.body, _mesh(model, level, p, limb, size), eyes, _UNPAINTED) for level in model.levels]
    finest, closing = model.levels[0].vertex, np.zeros(len(p))
    closing[finest] = _closing(levels[0])
    levels = [
        replace(level, mesh=replace(level.mesh, vertices=_raised(level.mesh.vertices, closing[of.vertex])))
        for level, of in zip(levels, model.levels, strict=True)
    ]
    return replace(levels[0], coarser=tuple(levels[1:]))


def painted(body: Avatar, albedo: U8, patches: tuple[Patch, ...]) -> Avatar:
    """The avatar with a texture (H, W, 3) in the model's coordinates, and its patches, on every level of detail."""
    levels = [replace(level, albedo=albedo, patches=patches, coarser=()) for level in (body, *body.coarser)]
    return replace(levels[0], coarser=tuple(levels[1:]))


def limbs(model: BodyModel, shape: Shape) -> tuple[Skeleton, Body]:
    """The joint chain and the primitives of the avatar of a shape."""
    _, rest, fit, _ = _jointed(model, shape)
    return rest, fit.body


def _jointed(model: BodyModel, shape: Shape) -> tuple[F64, Skeleton, BodyFit, F64]:
    """Points in the T-pose (V, 3), joints, primitives, and by how much all was moved to stand over the ankles (3,) [m]."""
    joints = jointed(shape.joints | {"left_eye": shape.eyes[0], "right_eye": shape.eyes[1]}, shape.stature)
    weight = np.zeros((len(shape.points), len(JOINTS) + len(TWIST_BONES)))
    np.put_along_axis(weight, model.bone.astype(np.int64), model.weight.astype(np.float64), axis=1)
    p = repose(shape.points, weight, joints)
    ankles = 0.5 * (joints.rest.rest[JOINT_INDEX["left_foot"], 2] + joints.rest.rest[JOINT_INDEX["right_foot"], 2])
    floor = np.array((0.0, -p[:, 1].min(), -ankles))
    p, rest = p + floor, Skeleton(joints.rest.rest + floor, joints.rest.tip)
    fit = fit_to_limbs(rest, p[: model.body], model.closed, model.limb)
    return p, rest, fit, floor


def _closing(body: Avatar) -> F64:
    """(V,) how far up each vertex goes for its lips to meet [m]: the model's faces are measured, and those of some leave a gap."""
    marks, triangles = landmarks_of(body), body.mesh.triangles.astype(np.int64)
    p = body.mesh.vertices.astype(np.float64)
    return closed(p, triangles, *sides_of_mouth(p, triangles, marks), marks)


def _raised(points: F32, by: F64) -> F32:
    out = points.copy()
    out[:, 1] += by.astype(np.float32)
    return out


def _mesh(model: BodyModel, level: Level, points: F64, limb: I32, size: float) -> Mesh:
    place = np.full(len(model.base), -1, np.int32)
    place[level.vertex] = np.arange(len(level.vertex), dtype=np.int32)
    units = model.units
    targets = tuple(
        Target(name, units.vertex[a:b], np.float32(size) * units.offset[a:b]).of(place)
        for name, a, b in zip(units.names, units.start[:-1], units.start[1:], strict=True)
    )
    v = level.vertex
    own = points[v].astype(np.float32), level.triangles, level.corner_vertex, level.uv, level.corner_triangles, limb[v]
    return Mesh(*own, model.bone[v], model.weight[v], targets)


def _eyeball(middle: F64, radius: float, box: F64, limb: int) -> Mesh:
    """A sphere with a cornea, its pole to the front, on which its picture lies as it is seen from there."""
    # Rings are close on the cornea, whose lights show how round it is, and far apart where no one sees them.
    polar = np.pi * np.linspace(0.0, 1.0, _RINGS + 1) ** 1.4
    around = np.arange(_SECTORS) * (2.0 * np.pi / _SECTORS)
    ring = np.stack([np.cos(around), np.sin(around)], axis=-1)
    unit = np.concatenate([np.column_stack([np.sin(t) * ring, np.full(_SECTORS, np.cos(t))]) for t in polar[1:-1]])
    unit = np.vstack([(0.0, 0.0, 1.0), unit, (0.0, 0.0, -1.0)])
    high, wide = _CORNEA
    out = 1.0 + high * np.exp(-np.square(np.hypot(unit[:, 0], unit[:, 1]) / wide)) * (unit[:, 2] > 0.0)
    k, n = np.arange(_SECTORS), np.roll(np.arange(_SECTORS), -1)
    triangles = [np.column_stack([np.zeros_like(k), 1 + k, 1 + n])]
    for r in range(_RINGS - 2):
        a, b = 1 + r * _SECTORS, 1 + (r + 1) * _SECTORS
        triangles += [np.column_stack([a + k, b + k, b + n]), np.column_stack([a + k, b + n, a + n])]
    last = 1 + (_RINGS - 2) * _SECTORS
    triangles.append(np.column_stack([last + k, np.full_like(k, len(unit) - 1), last + n]))
    # By the angle from the pole: what faces back has a place too, and the iris most texels.
    flat = unit[:, :2] / np.maximum(np.hypot(unit[:, 0], unit[:, 1]), 1e-9)[:, None]
    away = (np.arccos(np.clip(unit[:, 2], -1.0, 1.0))[:, None] / np.pi) ** EYE_POWER
    uv = box[:2] + (0.5 + 0.5 * away * flat) * (box[2:] - box[:2])
    tri = np.concatenate(triangles).astype(np.int32)
    vertices = (middle + radius * out[:, None] * unit).astype(np.float32)
    return Mesh(vertices, tri, np.arange(len(unit), dtype=np.int32), uv.astype(np.float32), tri, np.full(len(unit), limb, np.int32))
