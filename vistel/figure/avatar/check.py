"""Whether an avatar that was read from somewhere can be drawn: nothing in it points beyond what is there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.avatar.patch import fault_of
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.formats.avatar_file import MOST_TEXELS, AvatarFileError
from vistel.figure.rigid.weights import TWIST_BONES
from vistel.figure.skeleton import JOINTS

MOST_VERTICES, MOST_TRIANGLES = 200_000, 400_000
MOST_LEVELS, MOST_TARGETS = 6, 300
MOST_WRINKLES = 1 << 18
"""Letters of what says which wrinkles it wears."""


def check_avatar(avatar: Avatar, where: str) -> None:
    """Raises AvatarFileError, one line that begins with `where`, when it cannot be drawn."""
    try:
        Proportions.of(avatar.skeleton, avatar.body)
    except ValueError as fault:
        raise AvatarFileError(f"{where}: {fault}") from fault
    if len(avatar.coarser) > MOST_LEVELS or len(avatar.eyeballs) > 2:
        raise AvatarFileError(f"{where}: {len(avatar.coarser)} levels, {len(avatar.eyeballs)} eyeballs")
    if len(avatar.wrinkles) > MOST_WRINKLES:
        raise AvatarFileError(f"{where}: wrinkles of {len(avatar.wrinkles)} letters, expected at most {MOST_WRINKLES}")
    texels = avatar.albedo
    if texels.dtype != np.uint8 or texels.ndim != 3 or texels.shape[2] != 3 or not 0 < max(texels.shape) <= MOST_TEXELS:
        raise AvatarFileError(f"{where}: a texture of {texels.shape}, expected at most {MOST_TEXELS} texels along a side")
    if fault := fault_of(avatar.patches, MOST_TEXELS):
        raise AvatarFileError(f"{where}: {fault}")
    for level in (avatar, *avatar.coarser):
        for mesh in (level.mesh, *level.eyeballs):
            _check_mesh(mesh, len(avatar.body), where)


def _check_mesh(mesh: Mesh, primitives: int, where: str) -> None:
    count, drawn, faces = len(mesh.vertices), len(mesh.uv), len(mesh.triangles)
    if not 3 < count <= MOST_VERTICES or not 3 < faces <= MOST_TRIANGLES or not 3 < drawn <= 3 * MOST_TRIANGLES:
        raise AvatarFileError(f"{where}: {count} vertices, {faces} triangles; expected at most {MOST_VERTICES}, {MOST_TRIANGLES}")
    shapes = (
        (mesh.vertices, (count, 3), "f"),
        (mesh.triangles, (faces, 3), "i"),
        (mesh.corner_vertex, (drawn,), "i"),
        (mesh.uv, (drawn, 2), "f"),
        (mesh.corner_triangles, (faces, 3), "i"),
        (mesh.limb, (count,), "i"),
    )
    if any(array.shape != shape or array.dtype.kind != kind for array, shape, kind in shapes):
        raise AvatarFileError(f"{where}: a mesh whose arrays do not fit together")
    if not (np.isfinite(mesh.vertices).all() and np.isfinite(mesh.uv).all()) or np.abs(mesh.vertices).max() > 10.0:
        raise AvatarFileError(f"{where}: vertices that are not finite, or far away")
    _within(mesh.triangles, count, where)
    _within(mesh.corner_triangles, drawn, where)
    _within(mesh.corner_vertex, count, where)
    _within(mesh.limb, primitives, where)
    if not np.array_equal(mesh.corner_vertex[mesh.corner_triangles], mesh.triangles):
        raise AvatarFileError(f"{where}: texture corners of other triangles")
    check_targets(mesh, where)
    if (mesh.bone is None) != (mesh.weight is None):
        raise AvatarFileError(f"{where}: bones without weights")
    if mesh.bone is not None and mesh.weight is not None:
        if mesh.bone.shape != (count, 4) or mesh.weight.shape != (count, 4) or not np.isfinite(mesh.weight).all():
            raise AvatarFileError(f"{where}: weights that do not fit the mesh")
        _within(mesh.bone, len(JOINTS) + len(TWIST_BONES), where)


def check_targets(mesh: Mesh, where: str) -> None:
    """Raises AvatarFileError, one line that begins with `where`, for targets of vertices that are not there."""
    if len(mesh.targets) > MOST_TARGETS:
        raise AvatarFileError(f"{where}: {len(mesh.targets)} targets, expected at most {MOST_TARGETS}")
    for t in mesh.targets:
        if t.vertex.ndim != 1 or t.offset.shape != (len(t.vertex), 3) or not np.isfinite(t.offset).all():
            raise AvatarFileError(f"{where}: target {t.name!r} is damaged")
        if len(t.vertex) and (t.vertex.min() < 0 or t.vertex.max() >= len(mesh.vertices) or np.abs(t.offset).max() > 1.0):
            raise AvatarFileError(f"{where}: target {t.name!r} moves what is not there, or far away")


def _within(index: NDArray[np.int32], limit: int, where: str) -> None:
    if index.min() < 0 or index.max() >= limit:
        raise AvatarFileError(f"{where}: a mesh that points beyond its own arrays")
