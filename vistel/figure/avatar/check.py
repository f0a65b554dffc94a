"""Checks whether an avatar from outside can be drawn: no index in it points beyond its arrays."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.avatar.patch import fault_of
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.body import Body
from vistel.figure.rigid.weights import TWIST_BONES
from vistel.figure.skeleton import JOINTS, Skeleton

MOST_TEXELS = 4096
"""Texels along a side of a texture."""
MOST_VERTICES = 200_000
"""Vertices of one mesh."""
MOST_TRIANGLES = 400_000
"""Triangles of one mesh."""
MOST_LEVELS = 6
"""Coarser levels of detail."""
MOST_TARGETS = 300
"""Most expression targets of one mesh."""
LONGEST_M = 2.5
"""How far hair or cloth may hang [m]."""
MOST_WRINKLES = 1 << 18
"""Most characters of the text of its wrinkle sets."""


class AvatarFileError(ValueError):
    """An avatar file that cannot be used. The message is one line: which file, and why."""


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
    if any((level.mesh.hangs is None) != (avatar.mesh.hangs is None) for level in avatar.coarser):
        raise AvatarFileError(f"{where}: some levels of detail say what hangs, and some do not")
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
    check_hanging(mesh, where)
    if (mesh.bone is None) != (mesh.weight is None):
        raise AvatarFileError(f"{where}: bones without weights")
    if mesh.bone is not None and mesh.weight is not None:
        if mesh.bone.shape != (count, 4) or mesh.weight.shape != (count, 4) or not np.isfinite(mesh.weight).all():
            raise AvatarFileError(f"{where}: weights that do not fit the mesh")
        _within(mesh.bone, len(JOINTS) + len(TWIST_BONES), where)


def check_targets(mesh: Mesh, where: str) -> None:
    """Raises AvatarFileError, one line that begins with `where`, for targets that move missing vertices."""
    if len(mesh.targets) > MOST_TARGETS:
        raise AvatarFileError(f"{where}: {len(mesh.targets)} targets, expected at most {MOST_TARGETS}")
    for t in mesh.targets:
        if t.vertex.ndim != 1 or t.offset.shape != (len(t.vertex), 3) or not np.isfinite(t.offset).all():
            raise AvatarFileError(f"{where}: target {t.name!r} is damaged")
        if len(t.vertex) and (t.vertex.min() < 0 or t.vertex.max() >= len(mesh.vertices) or np.abs(t.offset).max() > 1.0):
            raise AvatarFileError(f"{where}: target {t.name!r} moves what is not there, or far away")


def check_hanging(mesh: Mesh, where: str) -> None:
    """Raises AvatarFileError, one line that begins with `where`, where it does not say of each vertex how far it hangs."""
    hangs = mesh.hangs
    if hangs is None:
        return
    if hangs.shape != (len(mesh.vertices),) or hangs.dtype.kind != "f" or not ((hangs >= 0.0) & (hangs <= LONGEST_M)).all():
        raise AvatarFileError(f"{where}: how far each vertex hangs: expected 0 to {LONGEST_M:g} m; export the avatar again")


def check_body(body: Body, skeleton: Skeleton, path: Path) -> None:
    """Raises AvatarFileError for primitives or joints of a file that do not fit together."""
    count = len(body)
    shapes = (body.joint.shape, body.a.shape, body.b.shape, body.radius_a.shape, body.radius_b.shape)
    if count == 0 or shapes != ((count,), (count, 3), (count, 3), (count,), (count,)):
        raise AvatarFileError(f"{path}: primitives of different counts; export the avatar again")
    if skeleton.rest.shape != (len(JOINTS), 3) or skeleton.tip.shape != (len(JOINTS), 3):
        raise AvatarFileError(f"{path}: {len(skeleton.rest)} joints, expected {len(JOINTS)}")
    if body.joint.min() < 0 or body.joint.max() >= len(JOINTS):
        raise AvatarFileError(f"{path}: a primitive of joint {body.joint.max()}, expected 0 to {len(JOINTS) - 1}")
    numbers = (body.a, body.b, body.radius_a, body.radius_b, skeleton.rest, skeleton.tip)
    if not all(np.isfinite(n).all() for n in numbers):
        raise AvatarFileError(f"{path}: primitives or joints that are not finite")


def check_indices(mesh: Mesh, body: Body, path: Path) -> None:
    """Raises AvatarFileError for indices of a mesh that point beyond its arrays."""
    count = len(mesh.vertices)
    for what, index, limit in (
        ("vertex", mesh.triangles, count),
        ("texture place", mesh.corner_triangles, len(mesh.uv)),
        ("primitive", mesh.limb, len(body)),
        ("bone", mesh.bone, len(JOINTS) + len(TWIST_BONES)),
    ):
        if index is not None and (not len(index) or index.min() < 0 or index.max() >= limit):
            raise AvatarFileError(f"{path}: a {what} that is not there; export the avatar again")
    if len(mesh.limb) != count or (mesh.bone is not None and (len(mesh.bone) != count or mesh.weight is None)):
        raise AvatarFileError(f"{path}: vertices and what belongs to them of different counts; export the avatar again")
    check_hanging(mesh, str(path))
    if mesh.corner_triangles.shape != mesh.triangles.shape or not np.isfinite(mesh.vertices).all():
        raise AvatarFileError(f"{path}: a mesh that is damaged; export the avatar again")


def _within(index: NDArray[np.int32], limit: int, where: str) -> None:
    if index.min() < 0 or index.max() >= limit:
        raise AvatarFileError(f"{where}: a mesh that points beyond its own arrays")
