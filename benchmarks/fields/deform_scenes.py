"""Scenes of the deformation benchmark: a figure of 23 capsules with a mesh, a rod, people who hug."""

import math
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32, F64, I32
from vistel.figure.posture.posture import ELBOW, SHOULDER, Posture, Stance, standing
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.deform import Deformer
from vistel.implicit.meshes.embedding import Embedding, Limbs, embed

JOINTS = {
    "pelvis": (0, 1.0, 0), "spine": (0, 1.2, 0), "chest": (0, 1.4, 0), "neck": (0, 1.55, 0), "head": (0, 1.7, 0),
    "shoulder": (0.2, 1.45, 0), "elbow": (0.45, 1.25, 0.1), "wrist": (0.6, 1.1, 0.3), "hand": (0.65, 1.05, 0.4),
    "hip": (0.1, 0.95, 0), "knee": (0.12, 0.5, 0.02), "ankle": (0.13, 0.1, 0), "toe": (0.13, 0.03, 0.15),
}  # fmt: skip
MIDDLE = (
    ("pelvis", "pelvis", 0.16),
    ("pelvis", "spine", 0.15),
    ("spine", "chest", 0.16),
    ("chest", "neck", 0.09),
    ("head", "head", 0.13),
)
SIDE = (
    ("chest", "shoulder", 0.11),
    ("shoulder", "elbow", 0.07),
    ("elbow", "wrist", 0.06),
    ("wrist", "hand", 0.05),
    ("hip", "knee", 0.10),
    ("knee", "ankle", 0.075),
    ("ankle", "toe", 0.06),
    ("elbow", "elbow", 0.065),
    ("knee", "knee", 0.08),
)


def capsules(offset: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> PrimitiveSet:
    """The figure of 23 capsules (balls where both ends are one) that `collision_peers.py` gives to physics engines."""
    rows = [(JOINTS[a], JOINTS[b], r) for a, b, r in MIDDLE]
    for sign in (1.0, -1.0):
        for a, b, r in SIDE:
            rows.append((tuple(np.multiply(JOINTS[a], (sign, 1, 1))), tuple(np.multiply(JOINTS[b], (sign, 1, 1))), r))
    start, end = np.array([r[0] for r in rows], float) + offset, np.array([r[1] for r in rows], float) + offset
    radius = np.array([r[2] for r in rows])
    return PrimitiveSet.of_cone_spheres(start, end, radius, radius)


def tube(a: F64, b: F64, radius: float, count: int, seed: int, bump: float) -> tuple[F32, F32, I32]:
    """About `count` vertices on a bumpy tube with round ends: positions, unit normals (of the smooth one), triangles."""
    rng = np.random.default_rng(seed)
    length = float(np.linalg.norm(b - a))
    around = max(6, round(math.sqrt(count * 2 * math.pi * radius / (length + math.pi * radius))))
    along = max(3, count // around)
    w = (b - a) / length if length > 1e-9 else np.array([0.0, 1.0, 0.0])
    u = np.cross(w, [0.3, 0.5, 0.8])
    u /= np.linalg.norm(u)
    v = np.cross(w, u)
    arc = np.linspace(0.02, 0.98, along) * (length + math.pi * radius) - 0.5 * math.pi * radius
    middle, bend = np.clip(arc, 0.0, length), (arc - np.clip(arc, 0.0, length)) / radius
    turn = np.arange(around) * 2 * np.pi / around
    circle = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v
    normal = np.cos(bend)[:, None, None] * circle[None] + np.sin(bend)[:, None, None] * w
    size = radius * (1.0 + bump * rng.uniform(-1, 1, (along, around, 1)))
    points = a + middle[:, None, None] * w + size * normal
    i, j = np.meshgrid(np.arange(along - 1), np.arange(around), indexing="ij")
    k = (j + 1) % around
    p, q, r, s = i * around + j, i * around + k, (i + 1) * around + k, (i + 1) * around + j
    triangles = np.concatenate([np.stack([p, q, r], -1).reshape(-1, 3), np.stack([p, r, s], -1).reshape(-1, 3)])
    return (points.reshape(-1, 3).astype(np.float32), normal.reshape(-1, 3).astype(np.float32), triangles.astype(np.int32))


@dataclass(frozen=True)
class CapsuleBody:
    """A mesh over capsules, each a limb of its own, with its deformer."""

    vertices: F32
    normals: F32
    embedding: Embedding
    deformer: Deformer
    a: F64
    b: F64


def body(shapes: PrimitiveSet, vertices: int, *, bump: float = 0.03, seed: int = 0) -> CapsuleBody:
    """`vertices` in all over the capsules `shapes`; limbs that overlap at rest share skin."""
    params = shapes.params.reshape(-1, 8)
    a, b, radius = params[:, :3].copy(), params[:, 3:6].copy(), params[:, 6]
    size = radius * (np.linalg.norm(b - a, axis=1) + math.pi * radius)
    parts = [
        tube(a[i], b[i], float(radius[i]), max(24, round(vertices * size[i] / size.sum())), seed + i, bump) for i in range(len(a))
    ]
    first = np.cumsum([0] + [len(p[0]) for p in parts])
    limb = np.repeat(np.arange(len(a), dtype=np.int32), [len(p[0]) for p in parts])
    points, normals = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
    triangles = np.concatenate([p[2] + n for p, n in zip(parts, first[:-1], strict=True)]).astype(np.int32)
    limbs = Limbs(a, b, radius.copy(), radius.copy(), np.arange(len(a), dtype=np.int32))
    embedding = embed(points, limb, limbs)
    return CapsuleBody(points, normals, embedding, Deformer(triangles, embedding), a, b)


def hugging() -> tuple[Posture, Posture]:
    """Two people face to face with their arms round each other."""
    dofs = standing().dofs.copy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[SHOULDER[side]] = (0.1, -sign * 1.25, -sign * 0.25)
        dofs[ELBOW[side]] = 0.9
    return Posture(dofs), Posture(dofs, stance=Stance(np.array([0.05, 0.0, 0.36]), math.pi))
