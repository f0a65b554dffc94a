"""How far each layer moves each vertex of a skin: solved on the implicit model once, later scaled by the state of the layer.

The skin's own field is T on it; a layer adds its field as it is now less what it was at rest (Singh §4.1: primitives blend
with and thus deform the surface that envelops them). A vertex goes along its normal to where the sum is T again.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.figure.layers.bones import Bone
from vistel.figure.layers.contraction import FULL, YIELD
from vistel.figure.layers.muscles import BellyShape, Muscle
from vistel.geometry.normals import vertex_normals
from vistel.implicit.blend import QUARTIC
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.meshes.embedding_fields import cone_sphere_ratio, quartic

Field = Callable[[F64], F64]

EDGE = float(QUARTIC.inverse(THRESHOLD))
"""Surface radius / radius of influence."""
LEAST = 5e-5
"""Vertices that a layer moves by less are left out [m]."""
TENDON = 0.7
"""Part of a belly's field at rest that stays where it draws back."""
_STEPS = 6
_SLOPE_STEP = 1e-4


@dataclass(frozen=True)
class Profile:
    """What one layer does at full: vertices (n,) and how far they move along their normals (n,) [m]."""

    vertex: I64
    moved: F64


def belly_field(belly: BellyShape, rotation: F64, position: F64) -> Field:
    """The field of a belly with its joint at rotation (3, 3), position (3,): an ellipsoid with a quartic blend."""
    centre = position + rotation @ belly.centre
    frame = (belly.axes @ rotation.T) * (EDGE / belly.half)[:, None]

    def field(p: F64) -> F64:
        return quartic(np.linalg.norm((p - centre) @ frame.T, axis=-1))

    return field


def bone_field(bone: Bone, rotation: F64, position: F64) -> Field:
    """The field of a bone with its joint at rotation (3, 3), position (3,)."""
    a, b = position + rotation @ bone.a, position + rotation @ bone.b
    radius = bone.radius / EDGE

    def field(p: F64) -> F64:
        return bone.weight * quartic(cone_sphere_ratio(p, a, b, radius, radius))

    return field


def muscle_profile(muscle: Muscle, skeleton_rest: F64, skin: "Skin", share: F64) -> Profile:
    """A muscle fully contracted by posture. share: (V,) how far each vertex blends with it at all."""
    position = skeleton_rest[muscle.belly.joint]
    rest = belly_field(muscle.belly, np.eye(3), position)
    full = belly_field(muscle.belly.at_length(FULL * (1.0 - YIELD)), np.eye(3), position)
    reach = (float(muscle.belly.half.max()) * 1.25) / EDGE
    near = np.linalg.norm(skin.vertices - position - muscle.belly.centre, axis=1) < reach
    vertex = np.flatnonzero(near & (share > 1e-3))
    p, n = skin.vertices[vertex], skin.normals[vertex]
    most = 0.8 * float(muscle.belly.half[0])

    def added(q: F64) -> F64:
        # Where a belly draws back, its tendon stays.
        before = rest(q)
        return muscle.weight * (np.maximum(full(q), TENDON * before) - before)

    moved = _solve(added, p, n, skin.slope[vertex], most) * share[vertex]
    return _kept(vertex, moved)


def bone_profile(bone: Bone, skeleton_rest: F64, skin: "Skin", share: F64) -> Profile:
    """A bone that shows whole: it lifts the skin, and never draws it in."""
    position, up = skeleton_rest[bone.joint], bone.shown(1.0)
    before, now = (bone_field(b, np.eye(3), position) for b in (bone, up))
    reach = bone.radius / EDGE + 0.5 * float(np.linalg.norm(bone.b - bone.a))
    near = np.linalg.norm(skin.vertices - position - 0.5 * (up.a + up.b), axis=1) < reach
    vertex = np.flatnonzero(near & (share > 1e-3))
    p, n = skin.vertices[vertex], skin.normals[vertex]
    most = float(np.linalg.norm(bone.rise))
    moved = _solve(lambda q: now(q) - before(q), p, n, skin.slope[vertex], most) * share[vertex]
    return _kept(vertex, np.maximum(moved, 0.0))


@dataclass(frozen=True)
class Skin:
    """A mesh at rest. vertices, normals: (V, 3) [m, unit]; slope: (V,) how fast its own field falls outwards [1/m]."""

    vertices: F64
    normals: F64
    slope: F64


def _solve(added: Field, p: F64, n: F64, slope: F64, most: float) -> F64:
    """(N,) how far along n from p the field T - slope d + added is T again [m], at most `most` either way: Newton."""
    d = np.zeros(len(p))
    for _ in range(_STEPS):
        f = added(p + d[:, None] * n) - slope * d
        ahead = added(p + (d + _SLOPE_STEP)[:, None] * n) - slope * (d + _SLOPE_STEP)
        fall = np.minimum((ahead - f) / _SLOPE_STEP, -0.5 * slope)
        d = np.clip(d - f / fall, -most, most)
    return d


def _kept(vertex: I64, moved: F64) -> Profile:
    keep = np.abs(moved) > LEAST
    return Profile(vertex[keep], moved[keep])


def turned_normals(vertices: F64, triangles: NDArray[np.int32], normals: NDArray[np.float32], profile: Profile) -> tuple[I64, F64]:
    """Vertices (n,) whose normals a profile turns, and how much it adds to those unit normals (n, 3). vertices (V, 3),
    triangles (F, 3), normals (V, 3) at rest."""
    moved = np.zeros(len(vertices))
    moved[profile.vertex] = profile.moved
    around = np.unique(triangles[(moved[triangles] != 0.0).any(axis=1)]).astype(np.int64)
    touched = np.zeros(len(vertices), bool)
    touched[around] = True
    fans = triangles[touched[triangles].any(axis=1)]
    used, local = np.unique(fans, return_inverse=True)
    faces = local.reshape(-1, 3)
    before = vertex_normals(vertices[used], faces)
    after = vertex_normals(vertices[used] + (moved[used, None] * normals[used]), faces)
    return around, (after - before)[np.searchsorted(used, around)]
