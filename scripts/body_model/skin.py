"""What belongs to the mesh and not to a person: bones and weights, levels of detail, texture coordinates."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from scripts.body_model.layout import islands, laid_out
from scripts.body_model.parts import DRAWN, Rows
from scripts.body_model.wheel import BaseMesh
from vistel.arrays import F32, F64, I32
from vistel.figure.avatar.avatar import Mesh
from vistel.figure.making.joints import Jointed, jointed
from vistel.figure.making.make import limb_joints
from vistel.figure.making.primitives import fit_body
from vistel.figure.making.repose import repose
from vistel.figure.making.rigs import mapped
from vistel.figure.making.source import Rig
from vistel.figure.making.weights import blended_weights, limb_groups_of, strongest
from vistel.figure.rigid.weights import TWIST_BONES, bone_weights, smoothed
from vistel.figure.skeleton import JOINT_INDEX, JOINTS
from vistel.geometry.smoothstep import smooth

_BESIDE = 0.06, 0.17
"""How far on the neck's side of a shoulder the arm moves its top, and over what way it comes to do so wholly [m]."""
SOFTER = 8
"""Rounds of averaging that MakeHuman's weights get, which are painted for straight blends."""


@dataclass(frozen=True)
class Faces:
    """Triangles (F, 3) of what is drawn, the closed skin's first, in rows of the model; their texture coordinates (F, 3, 2) in ours
    and in MakeHuman's texture."""

    triangles: I32
    uv: F64
    old_uv: F64


def faces(mesh: BaseMesh, rows: Rows) -> Faces:
    """Of the base mesh's quads."""
    quads = rows.of[np.concatenate([mesh.quads[g] for g in DRAWN])]
    uv = np.concatenate([mesh.uv_quads[g] for g in DRAWN])
    group = np.repeat(DRAWN, [2 * len(mesh.quads[g]) for g in DRAWN])
    both = np.stack([quads, uv], axis=-1)
    tri = np.stack([both[:, [0, 1, 2]], both[:, [0, 2, 3]]], axis=1).reshape(-1, 3, 2)
    corner = np.concatenate([mesh.quads[g] for g in DRAWN])
    base = np.stack([corner[:, [0, 1, 2]], corner[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    real = (tri[:, 1, 0] != tri[:, 2, 0]) & (tri[:, 2, 0] != tri[:, 0, 0])
    tri, group = tri[real], group[real]
    old = mesh.uv[tri[:, :, 1]]
    lash = np.char.find(group, "eyelashes") >= 0
    for side in ("l", "r"):
        mine = lash & (np.char.find(group, f"-{side}-") >= 0)
        old[mine] = _along_lid(mesh.points[base[real][mine]], mesh.points[np.unique(mesh.quads[f"helper-{side}-eye"])])
    island = islands(np.ascontiguousarray(tri[:, :, 1]), len(mesh.uv))
    return Faces(np.ascontiguousarray(tri[:, :, 0], np.int32), laid_out(group.tolist(), old, island), old)


def _shoulders(weight: F64, p: F64, at: Jointed) -> F64:
    """(V, B) weights with less of the arm on top of the shoulder, towards the neck: it would turn up there as the arm goes down.
    p: (V, 3) in the T-pose."""
    out = weight.copy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        joint = at.rest.rest[JOINT_INDEX[f"{side}_upper_arm"]]
        names = (f"{side}_upper_arm", f"{side}_lower_arm")
        arm = [JOINT_INDEX[n] for n in names] + [len(JOINTS) + k for k, b in enumerate(TWIST_BONES) if b.joint in names]
        beside = smooth((sign * (p[:, 0] - joint[0]) + _BESIDE[0]) / _BESIDE[1])
        less = 1.0 - smooth((p[:, 1] - joint[1] + 0.02) / 0.03) * (1.0 - beside)
        others = np.setdiff1d(np.arange(weight.shape[1]), arm)
        has = weight[:, others].sum(axis=1) > 0.02
        out[:, arm] *= np.where(has, less, 1.0)[:, None]
    return out / out.sum(axis=1, keepdims=True)


@dataclass(frozen=True)
class Skinned:
    """bone, weight: (V, 4) of a figure; limb: (body,) primitive of each vertex of the closed skin; points: (V, 3) in the T-pose."""

    bone: I32
    weight: F32
    limb: I32
    points: F64


def _along_lid(p: F64, eye: F64) -> F64:
    """(F, 3, 2) of corners of lashes: 0 to 1 across the eye, 0 to 1 from root to tip."""
    low, high = eye.min(axis=0), eye.max(axis=0)
    radius = 0.5 * (high - low)[0]
    middle = np.array((*(0.5 * (low + high))[:2], high[2] - radius))
    away = np.linalg.norm(p - middle, axis=-1) / radius
    outward = (np.abs(p[..., 0]) - abs(middle[0])) / radius
    return np.stack([0.5 + 0.36 * outward, (away - 1.0) / 0.45], axis=-1).clip(0.0, 1.0)


def bones(rig: dict[str, Any], weight: F32, points: F64, joints: dict[str, F64], triangles: I32, body: int) -> Skinned:
    """What a usual person's mesh follows. points: (V, 3) of them; joints: theirs; weight: (V, J) of the rig; body: number of rows
    that are the closed skin."""
    names = tuple(rig)
    index = {n: i for i, n in enumerate(names)}
    parents = np.array([index.get(rig[n]["parent"], -1) for n in names], np.int32)
    known = mapped(Rig(names, parents, np.zeros((len(names), 3)), weight))
    assert known.weight is not None
    at = jointed(joints, float(points[:, 1].max()))
    limb = limb_joints(at, points, known.weight, known.joint_of_column)
    own = bone_weights(at.found, points.astype(np.float32), triangles, limb)
    first = blended_weights(known.weight, known.joint_of_column, own)
    p = repose(points, first, at)
    own = bone_weights(at.rest, p.astype(np.float32), triangles, limb)
    whole = smoothed(blended_weights(known.weight, known.joint_of_column, own), triangles, SOFTER)
    whole = _shoulders(whole, p, at)
    bone, share = strongest(whole, limb_groups_of(known.joint_of_column))
    closed = triangles[(triangles < body).all(axis=1)]
    return Skinned(bone, share, fit_body(at.rest, p[:body], closed, bone[:body, 0]).limb, p)


def level(mesh: Mesh, number: I32) -> dict[str, Any]:
    """Arrays of a level of detail. number: (V,) of its vertices."""
    return {
        "vertex": number.astype(np.uint16),
        "corner": mesh.corner_vertex.astype(np.uint16),
        "uv": np.round(mesh.uv * 65535).astype(np.uint16),
        "triangles": mesh.corner_triangles.astype(np.uint16),
    }


def joints_of(rows: Rows, points: F64) -> dict[str, F64]:
    """Places of the joints among all points of the model."""
    return dict(zip(rows.cubes, points[len(points) - len(rows.cubes) :], strict=True))
