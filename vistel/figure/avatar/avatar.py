"""An avatar: the shape, texture and joints of a person's figure, in the rest pose.

Every mesh lies in the model frame of `vistel.figure.skeleton` (metres, Y up, facing +Z, left arm along +X, T-pose).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, I32, U8, Bool
from vistel.figure.avatar.patch import Patch, patch_of
from vistel.figure.body import Body
from vistel.figure.skeleton import Skeleton


@dataclass(frozen=True)
class Target:
    """A morph target, as in files of faces: vertices (N,) and how far they move at weight 1 (N, 3) [m]. name: as in the file;
    `vistel.figure.face.targets` gives its meaning for a face."""

    name: str
    vertex: I32
    offset: F32

    def of(self, place: NDArray[np.integer]) -> "Target":
        """Of the part of the mesh in which vertex v has become place[v], those at -1 gone."""
        to = place[self.vertex]
        return Target(self.name, to[to >= 0].astype(np.int32), self.offset[to >= 0])


@dataclass(frozen=True)
class Mesh:
    """A closed surface and its texture coordinates.

    vertices: (V, 3) rest pose [m]; a closed 2-manifold, oriented outwards (imported ones may have holes).
    triangles: (F, 3) vertices, counter-clockwise seen from outside.
    corner_vertex: (R,) vertex of each drawn vertex (texture seams double vertices).
    uv: (R, 2) texture coordinates of the drawn vertices in [0, 1], origin bottom left.
    corner_triangles: (F, 3) the triangles again, as drawn vertices.
    limb: (V,) index into `Body.names` of the primitive each vertex belongs to.
    bone, weight: (V, 4) bones (joints, then `vistel.figure.rigid.weights.TWIST_BONES`) that a vertex follows and their
    shares, largest first; None: found from the joint chain.
    targets: morph targets of expressions from its file.
    hangs: (V,) how far below the place that holds it each vertex hangs free [m], 0 what is held; None: nothing hangs.
    """

    vertices: F32
    triangles: I32
    corner_vertex: I32
    uv: F32
    corner_triangles: I32
    limb: I32
    bone: I32 | None = None
    weight: F32 | None = None
    targets: tuple[Target, ...] = ()
    hangs: F32 | None = None


@dataclass(frozen=True)
class Registration:
    """How the texture lies on one island of the texture coordinates: about `middle` (u, v) it is turned [rad], counter-
    clockwise, and made `scale` times as large, then moved by (u, v). See `vistel.figure.avatar.texture`."""

    island: int
    move: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    scale: float = 1.0
    middle: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Avatar:
    """A person's figure at rest.

    mesh: skin, hair and clothes as one closed surface. eyeballs: left and right eye, separate closed meshes centred on
    the joints `left_eye` and `right_eye` and fixed to them, so that gaze turns them.
    albedo: (H, W, 3) sRGB texture of the mesh and the eyeballs, first row at the top (v = 1).
    coarser: the same person with fewer and fewer vertices, for pictures in which they are small.
    registration: transforms of the texture that are already applied to the texture coordinates.
    wrinkles: its wrinkle sets as the text of a file (`vistel.wrinkle.wrinkle_sets`); empty for none.
    patches: surface properties of parts of the texture, for all levels; none where the renderer decides by the limb.
    """

    name: str
    skeleton: Skeleton
    body: Body
    mesh: Mesh
    eyeballs: tuple[Mesh, ...]
    albedo: U8
    coarser: "tuple[Avatar, ...]" = ()
    registration: tuple[Registration, ...] = ()
    wrinkles: str = ""
    patches: tuple[Patch, ...] = ()


def scaled(avatar: Avatar, height: float) -> Avatar:
    """The same person `height` metres tall."""
    scale = height / avatar.skeleton.height
    if abs(scale - 1.0) < 1e-4:
        return avatar
    b = avatar.body
    body = Body(b.names, b.joint, b.a * scale, b.b * scale, b.radius_a * scale, b.radius_b * scale)
    skeleton = Skeleton(avatar.skeleton.rest * scale, avatar.skeleton.tip * scale)

    def grown(level: Avatar) -> Avatar:
        mesh, *eyes = (
            replace(
                m,
                vertices=m.vertices * np.float32(scale),
                targets=tuple(replace(t, offset=t.offset * np.float32(scale)) for t in m.targets),
                hangs=None if m.hangs is None else m.hangs * np.float32(scale),
            )
            for m in (level.mesh, *level.eyeballs)
        )
        return replace(level, skeleton=skeleton, body=body, mesh=mesh, eyeballs=tuple(eyes), coarser=())

    return replace(grown(avatar), coarser=tuple(grown(level) for level in avatar.coarser))


def flesh(avatar: Avatar) -> Bool:
    """(V,) which vertices of an avatar are its body or lie on it: not those of hair and lashes, whose surface has holes. All,
    where most is of that kind: files call bodies that, too. Nor what is rigid."""
    mesh, holed = avatar.mesh, [patch.rigid or (patch.opacity is not None and not patch.blend) for patch in avatar.patches]
    out = np.ones(len(mesh.vertices), np.bool_)
    if any(holed):
        on = patch_of(avatar.patches, mesh.uv, mesh.corner_triangles)
        out[mesh.triangles[(on >= 0) & np.array(holed)[on]]] = False
    return out if out.mean() > 0.5 else np.ones_like(out)


def clothes(avatar: Avatar) -> I32:
    """(V,) on which clothes each vertex of an avatar lies, by the number of their patch: opaque, of other surface properties than
    most of the face; -1 on skin and hair. 0 everywhere, where there are none of that kind: files often have clothes and skin in
    one."""
    mesh = avatar.mesh
    on = patch_of(avatar.patches, mesh.uv, mesh.corner_triangles)
    face = np.array([name == "face" for name in avatar.body.names])[mesh.limb][mesh.triangles].all(axis=1)
    skin = int(np.bincount(on[face] + 1).argmax()) - 1 if face.any() else -1
    soft = [patch.opacity is None and not patch.blend and not patch.rigid for patch in avatar.patches]
    cloth = np.array([*soft, False])[on] & (on != skin)
    out = np.full(len(mesh.vertices), -1, np.int32)
    out[mesh.triangles[cloth]] = on[cloth, None]
    return out if cloth.any() else np.zeros_like(out)


def rigid(avatar: Avatar) -> Bool:
    """(V,) which vertices of an avatar keep their places on their bone, whatever the skin beneath does: glasses."""
    mesh, out = avatar.mesh, np.zeros(len(avatar.mesh.vertices), np.bool_)
    if any(patch.rigid for patch in avatar.patches):
        on = patch_of(avatar.patches, mesh.uv, mesh.corner_triangles)
        out[mesh.triangles[np.array([*(patch.rigid for patch in avatar.patches), False])[on]]] = True
    return out
